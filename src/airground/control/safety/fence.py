"""Whether a robot is inside its fence, and will come to rest inside."""

from __future__ import annotations

from math import cos, hypot, inf, sin
from typing import TYPE_CHECKING

from airground.control.safety.types import Place, StopReason

if TYPE_CHECKING:
    from airground.control.limits import Limits
    from airground.control.safety.bounds import SafetyBounds
    from airground.control.safety.types import Cause, FenceTest

__all__ = ["STANDS_MPS", "leaving_causes", "outside_causes", "spare_m"]

TINY_M = 1e-9  # for what goes along a straight fence

STANDS_MPS = 0.02
"""What an estimate of the speed of a robot at rest may say [m/s]."""


def outside_causes(
    place: Place, fence: FenceTest, bounds: SafetyBounds
) -> tuple[list[Cause], float]:
    """Ask the fence about where the robot is.

    Parameters
    ----------
    place : Place
        There.
    fence : FenceTest
        The fence.
    bounds : SafetyBounds
        What clearance it must have.

    Returns
    -------
    causes : list of Cause
        One if it is outside.
    spare : float [m]
        Clearance beyond what it must have.
    """
    spare = spare_m(place.x, place.y, place.sigma_m, fence, bounds)
    short = -spare - bounds.fence_sigmas * place.sigma_m
    if not short <= 0:
        return [(StopReason.FENCE, f"{short:.2f} m too far out")], spare
    return [], spare


def spare_m(x: float, y: float, sigma_m: float, fence: FenceTest, bounds: SafetyBounds) -> float:
    """Clearance beyond what a robot must have.

    Parameters
    ----------
    x, y : float [m]
        Ground point.
    sigma_m : float [m]
        Standard deviation of the position.
    fence : FenceTest
        The fence.
    bounds : SafetyBounds
        Margin and standard deviations.

    Returns
    -------
    spare : float [m]
        Negative outside; infinite where nothing bounds the ground.
    """
    boundary = fence.boundary(x, y)
    if boundary is None:
        return inf
    return boundary.clearance_m - bounds.fence_margin_m - bounds.fence_sigmas * sigma_m


def leaving_causes(
    place: Place,
    spare: float,
    motion: tuple[float, float, float],
    fence: FenceTest,
    *,
    limits: Limits,
    bounds: SafetyBounds,
) -> list[Cause]:
    """Follow the way on which a robot would come to rest, and ask the fence along it.

    Clearance changes by no more than the way does, so that where there is much of it, large steps are safe.

    Parameters
    ----------
    place : Place
        Where the robot is, inside.
    spare : float [m]
        Clearance that it has beyond what it must have; negative where it may only go inwards.
    motion : (float, float, float) [m/s, rad/s, m/s]
        Speed, turn rate and sideways speed from which it brakes.
    fence : FenceTest
        The fence.
    limits : Limits
        How it brakes.
    bounds : SafetyBounds
        How long it reacts.

    Returns
    -------
    causes : list of Cause
        One if it would come to rest outside, or pass there.
    """
    v, omega, side = motion
    speed = hypot(v, side)
    stop = speed * bounds.reaction_s + speed * speed / (2 * limits.deceleration_mps2)
    if spare >= stop or speed < STANDS_MPS:
        return []
    # Where noise took it too near the fence, it may go inwards.
    least = min(spare, 0.0)
    at, step = 0.0, max(spare, stop / 8)
    while at < stop:
        at = min(at + step, stop)
        # The chord of the arc, at the mean heading; the curve is kept while it brakes.
        half = omega * at / speed / 2
        chord = at * (sin(half) / half if abs(half) > 1e-9 else 1.0) / speed
        c, s = cos(place.theta + half), sin(place.theta + half)
        x, y = place.x + chord * (c * v - s * side), place.y + chord * (s * v + c * side)
        left = spare_m(x, y, place.sigma_m, fence, bounds)
        if not left >= least - TINY_M:
            return [
                (
                    StopReason.LEAVING,
                    f"from {speed:.2f} m/s it comes to rest {stop:.2f} m on, outside",
                )
            ]
        step = max(left, stop / 8)
    return []
