"""Where in the image a robot would come to rest, and whether that is too near to something."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from airground.control.legs.gauge import Gauge
    from airground.control.legs.local_map import LocalMap
    from airground.control.legs.types import LegDriveOptions, LegInput
    from airground.control.limits import Limits

__all__ = ["inside_px", "rests", "stopping_m", "too_near"]

Pair = tuple[float, float]

NOISE_PX = 2.0  # of what is foreseen: it is nearer only by more than that
BRAKES = 0.8  # share of the deceleration that is counted on
SLOWEST_MPS = 0.06  # below, the image's own velocity says little about a metre


def stopping_m(speed_mps: float, late_s: float, limits: Limits) -> float:
    """How far a robot goes on from where it was seen.

    Parameters
    ----------
    speed_mps : float [m/s]
        Either way.
    late_s : float [s]
        Age of the picture, and how late the robot follows its commands.
    limits : Limits
        How it brakes.

    Returns
    -------
    way : float [m]
        Until it rests.
    """
    speed = abs(speed_mps)
    return speed * late_s + speed * speed / (2 * BRAKES * limits.deceleration_mps2)


def rests(
    uv: Pair, uv_dot: Pair | None, step: Pair | None, way_m: float, speed_mps: float
) -> tuple[Pair, ...]:
    """Where the mark may come to rest, if the robot brakes now.

    Parameters
    ----------
    uv : (float, float) [px]
        Where it was seen.
    uv_dot : (float, float) or None [px/s]
        How it was seen to move.
    step : (float, float) or None [px/m]
        What a metre in the direction of driving is in the image, where that is known.
    way_m : float [m]
        Until it rests.
    speed_mps : float [m/s]
        Of the robot, either way.

    Returns
    -------
    places : tuple of (float, float) [px]
        By either account; none where there is none.
    """
    found: list[Pair] = []
    if step is not None:
        found.append((uv[0] + step[0] * way_m, uv[1] + step[1] * way_m))
    if uv_dot is not None and abs(speed_mps) >= SLOWEST_MPS:
        s = way_m / abs(speed_mps)
        found.append((uv[0] + uv_dot[0] * s, uv[1] + uv_dot[1] * s))
    return tuple(found)


def too_near(
    now: LegInput,
    gauge: Gauge,
    local_map: LocalMap,
    *,
    gear: int,
    told_mps: float,
    limits: Limits,
    options: LegDriveOptions,
) -> str:
    """Say what a robot would come too near to, and nearer than it is, if it braked only now.

    Parameters
    ----------
    now : LegInput
        With a mark.
    gauge : Gauge
        How it moves.
    local_map : LocalMap
        How that looks in the image.
    gear : int
        1 forwards, -1 in reverse.
    told_mps : float [m/s]
        What it was told last, in that direction.
    limits : Limits
        How it brakes.
    options : LegDriveOptions
        How late things are.

    Returns
    -------
    what : str
        For a person; empty where there is nothing.
    """
    assert now.uv is not None
    seen_t = now.t if now.seen_t is None else now.seen_t
    late = max(now.t - seen_t, 0.0) + options.latency_s + options.response_s
    way = stopping_m(max(abs(gauge.speed), told_mps), late, limits)
    step = local_map.px_per_m(now.uv, gauge.heading_rad)
    if step is not None:
        step = (gear * step[0], gear * step[1])
    moving = gauge.speed if gauge.speed * gear > 0 else 0.0
    places = rests(now.uv, now.uv_dot, step, way, moving)
    return _nearer(now.uv, places, now)


def _nearer(uv: Pair, places: Iterable[Pair], now: LegInput) -> str:
    inside = inside_px(uv, now.image_size_px)
    for place in places:
        then = inside_px(place, now.image_size_px)
        if then < now.margin_px and then < inside - NOISE_PX:
            return "the border"
        for u, v, clearance in now.others:
            away = hypot(place[0] - u, place[1] - v)
            if away < clearance and away < hypot(uv[0] - u, uv[1] - v) - NOISE_PX:
                return "something else"
    return ""


def inside_px(uv: Pair, image_size_px: tuple[int, int]) -> float:
    """Distance from the image's border.

    Parameters
    ----------
    uv : (float, float) [px]
        Of what.
    image_size_px : (int, int) [px]
        Width and height.

    Returns
    -------
    distance : float [px]
        Negative outside.
    """
    width, height = image_size_px
    return min(uv[0] + 0.5, width - 0.5 - uv[0], uv[1] + 0.5, height - 0.5 - uv[1])
