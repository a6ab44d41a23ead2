"""Which leg to drive before there is a calibration: headings well apart, in different places, inside the image."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, hypot, inf, isfinite, pi, remainder, sin, sqrt
from typing import TYPE_CHECKING

from airground.control.legs.look import inside_px
from airground.control.legs.types import DriveLeg
from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.control.legs.local_map import LocalMap
    from airground.control.legs.types import DrivenLeg

__all__ = ["ScriptOptions", "scripted_leg"]

HEADINGS = 12
ALIKE_RAD = 0.44  # headings closer than this, either way along them, tell much the same
RECENT = 6  # legs that count: a hexagon
TURN_SHARE = 0.15  # what turning round takes off a leg's worth
MIDDLE_SHARE = 0.3  # what ending in the middle of the image adds
Map = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class ScriptOptions:
    """Lengths and speeds of scripted legs."""

    first_m: float = 0.3
    """Length while nothing is known [m]."""

    first_mps: float = 0.12
    """Speed then [m/s]."""

    length_m: float = 0.6
    """Length where there is room [m]."""

    shortest_m: float = 0.2
    """Shorter ones tell too little [m]."""

    guessed_share: float = 0.7
    """How much of the room is used that only a guess of the map tells."""

    known_share: float = 0.9
    """The same where the map is known."""

    def __post_init__(self) -> None:
        for name in ("first_m", "first_mps", "length_m", "shortest_m"):
            if not 0 < getattr(self, name) < inf:
                raise InputError(f"{name} must be positive and finite, not {getattr(self, name)}")
        for name in ("guessed_share", "known_share"):
            if not 0 < getattr(self, name) <= 1:
                raise InputError(f"{name} must be in 0..1, not {getattr(self, name)}")


def scripted_leg(
    local_map: LocalMap,
    uv: tuple[float, float],
    image_size_px: tuple[int, int],
    driven: Sequence[DrivenLeg] = (),
    *,
    heading_rad: float,
    margin_px: float = 40.0,
    others: Sequence[tuple[float, float, float]] = (),
    options: ScriptOptions | None = None,
) -> DriveLeg:
    """Give the next leg while there is no calibration.

    The first leads straight on, short and slow. Those after it go along headings that differ from those driven, and are
    as long as the robot's own motion in the image says that there is room for.

    Parameters
    ----------
    local_map : LocalMap
        What that motion told.
    uv : (float, float) [px]
        Where the mark is.
    image_size_px : (int, int) [px]
        Width and height.
    driven : sequence of DrivenLeg
        Legs so far.
    heading_rad : float [rad]
        By compass, now.
    margin_px : float [px]
        Distance to keep from the image's border.
    others : sequence of (float, float, float) [px]
        Everything else in view: u, v, and the distance to keep from it.
    options : ScriptOptions, optional
        Lengths and speeds; the defaults where not given.

    Returns
    -------
    leg : DriveLeg
        What to drive.

    Raises
    ------
    InputError
        If the position or the heading is not finite.
    """
    options = options or ScriptOptions()
    if not isfinite(sum(uv) + heading_rad):
        raise InputError(f"uv and heading_rad must be finite, not {uv} and {heading_rad}")
    maps = local_map.guesses(uv)
    if not maps:  # nothing was seen of its motion: another way than those that were tried
        heading = heading_rad + (pi / 3 if driven else 0.0)
        return DriveLeg(remainder(heading, 2 * pi), options.first_m, options.first_mps)
    base = driven[0].heading_rad if driven else heading_rad
    share = options.known_share if len(maps) == 1 else options.guessed_share
    best, best_worth, widest = None, 0.0, (0.0, heading_rad)
    for k in range(HEADINGS):
        heading = remainder(base + 2 * pi * k / HEADINGS, 2 * pi)
        steps = [_step(one, heading) for one in maps]
        room = min(_room_m(uv, step, image_size_px, margin_px, others) for step in steps)
        length = min(share * room, options.length_m)
        widest = max(widest, (length, heading))
        if length < options.shortest_m:
            continue
        end = min(inside_px(_along(uv, step, length), image_size_px) for step in steps)
        worth = length * (1 + MIDDLE_SHARE * 2 * end / min(image_size_px)) / _crowd(heading, driven)
        worth *= 1 - TURN_SHARE * abs(remainder(heading - heading_rad, 2 * pi)) / pi
        if worth > best_worth:
            best, best_worth = DriveLeg(heading, length), worth
    if best is not None:
        return best
    if widest[0] > options.shortest_m / 2:
        return DriveLeg(widest[1], widest[0], options.first_mps)
    inward = local_map.inward(uv, image_size_px)
    heading = heading_rad if inward is None else inward
    return DriveLeg(heading, options.first_m, options.first_mps)


def _step(one: Map, heading: float) -> tuple[float, float]:
    c, s = cos(heading), sin(heading)
    return one[0] * c + one[1] * s, one[2] * c + one[3] * s


def _along(
    uv: tuple[float, float], step: tuple[float, float], length: float
) -> tuple[float, float]:
    return uv[0] + length * step[0], uv[1] + length * step[1]


def _room_m(
    uv: tuple[float, float],
    step: tuple[float, float],
    image_size_px: tuple[int, int],
    margin_px: float,
    others: Sequence[tuple[float, float, float]],
) -> float:
    """How far it is to the margin, or to something else; from beyond the margin there is room inwards only."""
    scale = hypot(*step)
    if scale == 0:
        return 0.0
    room = inf
    for at, rate, size in zip(uv, step, image_size_px, strict=True):
        low, high = margin_px - 0.5, size - 0.5 - margin_px
        if rate != 0:
            room = min(room, ((high if rate > 0 else low) - at) / rate)
    for u, v, clearance in others:
        along = ((u - uv[0]) * step[0] + (v - uv[1]) * step[1]) / scale
        across = hypot(u - uv[0], v - uv[1]) ** 2 - along**2
        if along > 0 and across < clearance**2:  # it lies ahead
            room = min(room, (along - sqrt(clearance**2 - across)) / scale)
    return max(room, 0.0)


def _crowd(heading: float, driven: Sequence[DrivenLeg]) -> float:
    """1 and more, the more legs were driven along that heading or against it."""
    crowd = 1.0
    for leg in driven[-RECENT:]:
        away = remainder(heading - leg.heading_rad, pi)
        tried = min(1.0, leg.length_m / 0.3) if leg.whole else 1.0
        crowd += 4.0 * tried * exp(-((away / ALIKE_RAD) ** 2))
    return crowd
