"""Legs in words, for a person who drives by hand and looks at the image."""

from __future__ import annotations

from math import atan2, degrees, hypot, isfinite, pi, remainder
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.control.legs.local_map import LocalMap
    from airground.control.legs.types import DrivenLeg

__all__ = ["advise"]

SIDES = ("right", "lower right", "bottom", "lower left", "left", "upper left", "top", "upper right")
STRAIGHT_DEG, ROUND_DEG = 12, 155
APART_RAD = 0.5  # headings closer than this, either way along them, are one
WANTED = 3


class _Leg(Protocol):
    """Of this package, or of `calibration.guidance`."""

    @property
    def heading_rad(self) -> float: ...

    @property
    def length_m(self) -> float: ...


def advise(
    leg: _Leg | None,
    *,
    heading_rad: float | None,
    local_map: LocalMap,
    uv: tuple[float, float] | None,
    driven: Sequence[DrivenLeg] = (),
) -> str:
    """Say how to drive a leg by hand.

    Parameters
    ----------
    leg : DriveLeg or Leg or None
        What to drive; None where nobody has chosen one.
    heading_rad : float or None [rad]
        By compass, now.
    local_map : LocalMap
        What the robot's motion told of the image so far: which side left is, and where the leg leads in the image.
    uv : (float, float) or None [px]
        Where the mark is.
    driven : sequence of DrivenLeg
        Legs so far.

    Returns
    -------
    line : str
        Such as "turn left by about 60 deg and drive 1.0 m towards the lower right".
    """
    if leg is None:
        return _without(driven)
    step = None
    if uv is not None and isfinite(sum(uv)):
        step = local_map.px_per_m(uv, leg.heading_rad)
    towards = f" towards the {_side(step)}" if step is not None and hypot(*step) > 0 else ""
    drive = f"drive {leg.length_m:.1f} m{towards}"
    if heading_rad is None or not isfinite(heading_rad):
        return drive
    turn = degrees(remainder(leg.heading_rad - heading_rad, 2 * pi))
    size = abs(turn)
    if size < STRAIGHT_DEG:
        return f"{drive}, straight on"
    if size > ROUND_DEG:
        return f"turn round and {drive}"
    clockwise = local_map.clockwise
    if clockwise is None:
        compass = round(degrees(remainder(leg.heading_rad, 2 * pi)))
        return (
            f"turn by about {_round(size)} deg, until the compass says {compass} deg, and {drive}"
        )
    side = "right" if (turn > 0) == clockwise else "left"
    return f"turn {side} by about {_round(size)} deg and {drive}"


def _without(driven: Sequence[DrivenLeg]) -> str:
    apart: list[float] = []
    for leg in driven:
        if all(abs(remainder(leg.heading_rad - one, pi)) > APART_RAD for one in apart):
            apart.append(leg.heading_rad)
    if not apart:
        return "drive straight on for about half a metre"
    missing = WANTED - len(apart)
    if missing > 0:
        more = "one more direction" if missing == 1 else f"{missing} more directions"
        return f"drive straight along {more}, well apart from those driven"
    return "drive straight legs in other places, and along other directions"


def _side(step: tuple[float, float]) -> str:
    return SIDES[round(atan2(step[1], step[0]) / (pi / 4)) % 8]


def _round(angle_deg: float) -> int:
    return 10 * round(angle_deg / 10)
