"""Laws in one dimension that controllers share: how fast to close a gap, and what can be commanded next."""

from __future__ import annotations

from math import copysign, hypot, pi, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from airground.control.limits import Limits
    from airground.control.state import RobotState

__all__ = ["closing_rate", "corner_speed", "steered", "toward", "turn_reach", "wrapped"]


def wrapped(angle: float) -> float:
    """The same angle in -pi..pi.

    Parameters
    ----------
    angle : float [rad]
        Any.

    Returns
    -------
    angle : float [rad]
        At least -pi and below pi.
    """
    return (angle + pi) % (2 * pi) - pi


def closing_rate(gap: float, gain: float, rate: float, braking: float) -> float:
    """Speed that closes a gap and comes to rest at its end: ``gain * gap`` when near, braking evenly when far.

    The two pieces join smoothly, so that no more than `braking` is asked for anywhere.

    Parameters
    ----------
    gap : float [m]
        What is left; negative counts as closed. In radians with the rest if it is an angle.
    gain : float [1/s]
        Of the end.
    rate : float [m/s]
        Largest speed.
    braking : float [m/s^2]
        Deceleration that it plans with.

    Returns
    -------
    speed : float [m/s]
        0 or more.
    """
    if gap <= 0:
        return 0.0
    joint = braking / gain**2
    if gap <= joint:
        return min(rate, gain * gap)
    return min(rate, sqrt(2 * braking * (gap - joint / 2)))


def toward(angle: float, gain: float, limits: Limits) -> float:
    """Turn rate that closes an angle.

    Parameters
    ----------
    angle : float [rad]
        To turn by, with its sign.
    gain : float [1/s]
        Of the end.
    limits : Limits
        Of the robot; 0.6 of its turn acceleration is planned with, which leaves some for what was not foreseen.

    Returns
    -------
    omega : float [rad/s]
        With the sign of `angle`.
    """
    braking = 0.6 * limits.turn_acceleration_radps2
    return copysign(closing_rate(abs(angle), gain, limits.turn_rate_radps, braking), angle)


def turn_reach(limits: Limits, v: float) -> float:
    """Largest turn rate that goes with a speed.

    Parameters
    ----------
    limits : Limits
        Of the robot.
    v : float [m/s]
        Speed along the heading.

    Returns
    -------
    omega : float [rad/s]
        From turn rate, lateral acceleration and turn radius.
    """
    speed, reach = abs(v), limits.turn_rate_radps
    if speed * reach > limits.lateral_acceleration_mps2:
        reach = limits.lateral_acceleration_mps2 / speed
    if limits.turn_radius_m > 0:
        reach = min(reach, speed / limits.turn_radius_m)
    return reach


def steered(
    limits: Limits, v: float, omega: float, state: RobotState, window: float
) -> tuple[float, float]:
    """What can be had of a wanted speed and turn rate within a short time.

    Parameters
    ----------
    limits : Limits
        Of the robot.
    v : float [m/s]
        Wanted speed along the heading.
    omega : float [rad/s]
        Wanted turn rate.
    state : RobotState
        Its speed and turn rate are where the change starts from.
    window : float [s]
        The time.

    Returns
    -------
    v : float [m/s]
        Within the limits.
    omega : float [rad/s]
        Within the limits at that speed.
    """
    v = _gained(state.v, v, limits, window)
    v = min(max(v, -limits.reverse_mps), limits.speed_mps)
    change = limits.turn_acceleration_radps2 * window
    omega = min(max(omega, state.omega - change), state.omega + change)
    reach = turn_reach(limits, v)
    return v, min(max(omega, -reach), reach)


def _gained(now: float, wanted: float, limits: Limits, window: float) -> float:
    """Speed after a time, where it is lost faster than it is gained."""
    if wanted < now:
        return -_gained(-now, -wanted, limits, window)
    gain, loss = limits.acceleration_mps2, limits.deceleration_mps2
    if now >= 0:
        return min(wanted, now + gain * window)
    rest = -now / loss  # time until it stands
    if rest >= window:
        return min(wanted, now + loss * window)
    return min(wanted, gain * (window - rest))


def corner_speed(
    limits: Limits, cut: float, inward: tuple[float, float], outward: tuple[float, float]
) -> float:
    """Speed at which a corner can be rounded on an arc that begins some way before it.

    Parameters
    ----------
    limits : Limits
        Of the robot.
    cut : float [m]
        Distance from the corner at which the arc begins; it passes the corner at ``cut * tan(turn / 4)``.
    inward, outward : (float, float) [m]
        The way to the corner and the way from it; a length of zero means no corner.

    Returns
    -------
    speed : float [m/s]
        From turn rate and lateral acceleration; 0 where it goes straight back.
    """
    length = hypot(*inward) * hypot(*outward)
    if length == 0:
        return limits.speed_mps
    cos = (inward[0] * outward[0] + inward[1] * outward[1]) / length
    if cos >= 1 - 1e-9:
        return limits.speed_mps
    radius = cut * sqrt(max(0.0, (1 + cos) / (1 - cos)))  # cut / tan(turn / 2)
    return min(
        limits.speed_mps,
        limits.turn_rate_radps * radius,
        sqrt(limits.lateral_acceleration_mps2 * radius),
    )
