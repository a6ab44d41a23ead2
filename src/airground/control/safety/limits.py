"""Commands held within a robot's limits, on their way from one tick to the next; the path is kept where that can be."""

from __future__ import annotations

from math import copysign, hypot, inf, sqrt
from typing import TYPE_CHECKING

from airground.control.command import VelocityCommand

if TYPE_CHECKING:
    from airground.control.limits import Limits

__all__ = ["limited", "steady"]


def limited(
    asked: VelocityCommand, before: VelocityCommand, dt: float, limits: Limits
) -> VelocityCommand:
    """Nearest command that the limits allow after another one.

    Speed and turn rate are scaled together, so that the curve stays the one that was asked for. Only where no speed
    on that curve can be reached within `dt` does each go as far towards what was asked as it can.

    Parameters
    ----------
    asked : VelocityCommand
        What is wanted; finite.
    before : VelocityCommand
        What was sent last: at rest, or within the limits.
    dt : float [s]
        Since then, positive.
    limits : Limits
        What the robot may do.

    Returns
    -------
    command : VelocityCommand
        Within all limits, and reached from `before` within the accelerations.
    """
    if asked.at_rest:
        return _braked(before, dt, limits)
    v, omega, side = steady(asked.v, asked.omega, asked.lateral, limits)
    # What drives sideways gains speed in two directions at once.
    share = 1.0 if side == 0 and before.lateral == 0 else sqrt(0.5)
    v_range = _reach(before.v, dt, limits, share)
    side_range = (0.0, 0.0) if share == 1 else _reach(before.lateral, dt, limits, share)
    turn = limits.turn_acceleration_radps2 * dt
    omega_range = (before.omega - turn, before.omega + turn)

    spans = [(v, v_range), (omega, omega_range)]
    if share < 1:
        spans.append((side, side_range))
    least, most = 0.0, 1.0  # of the share of the wanted command
    for value, (low, high) in spans:
        if value > 0:
            least, most = max(least, low / value), min(most, high / value)
        elif value < 0:
            least, most = max(least, high / value), min(most, low / value)
        elif not low <= 0 <= high:
            most = -inf
    if least <= most:
        # Static limits hold: they do along all of the way from rest to a command within them.
        return VelocityCommand(v * most, omega * most, side * most)
    if share < 1:  # straight from one velocity to the other, as speed is bounded in all directions
        most = min(
            1.0,
            _part(before.v, v, v_range),
            _part(before.lateral, side, side_range),
        )
        v = before.v + most * (v - before.v)
        side = before.lateral + most * (side - before.lateral)
    else:
        v = _clip(v, *v_range)
    return _bent(v, _clip(omega, *omega_range), side, omega_range, before=before, limits=limits)


def steady(v: float, omega: float, side: float, limits: Limits) -> tuple[float, float, float]:
    """Scale a command so that it may be held for ever.

    Parameters
    ----------
    v, omega, side : float [m/s, rad/s, m/s]
        Speed, turn rate and sideways speed; finite.
    limits : Limits
        What the robot may do.

    Returns
    -------
    v, omega, side : float [m/s, rad/s, m/s]
        Within the limits that do not depend on time.
    """
    if v < 0 and limits.reverse_mps == 0:
        v = 0.0  # what may not reverse may still turn
    scale = min(
        1.0,
        limits.speed_mps / max(hypot(v, side), 1e-300),
        limits.reverse_mps / -v if v < 0 else 1.0,
        limits.turn_rate_radps / max(abs(omega), 1e-300),
    )
    v, omega, side = v * scale, omega * scale, side * scale
    across = hypot(v, side) * abs(omega)
    if across > limits.lateral_acceleration_mps2:
        scale = sqrt(limits.lateral_acceleration_mps2 / across)
        v, omega, side = v * scale, omega * scale, side * scale
    radius = limits.turn_radius_m
    if radius > 0:
        widest = hypot(v, side) / radius
        omega = _clip(omega, -widest, widest)
    return v, omega, side


def _reach(before: float, dt: float, limits: Limits, share: float) -> tuple[float, float]:
    """Speeds that can be had after dt: braking first, then away on the other side."""
    gain, loss = limits.acceleration_mps2 * share, limits.deceleration_mps2 * share
    speed = abs(before)
    stop = speed / loss
    slow = speed - loss * dt if dt <= stop else -gain * (dt - stop)
    fast = speed + gain * dt
    return (slow, fast) if before >= 0 else (-fast, -slow)


def _bent(
    v: float,
    omega: float,
    side: float,
    omega_range: tuple[float, float],
    *,
    before: VelocityCommand,
    limits: Limits,
) -> VelocityCommand:
    """Bring a command that leaves the wanted curve back to what a curve may be.

    The command before was within the limits, so that going towards it always ends there.
    """
    speed = hypot(v, side)
    gentlest = _clip(0.0, *omega_range)
    widest = limits.lateral_acceleration_mps2 / max(speed, 1e-300)
    if limits.turn_radius_m > 0:
        widest = min(widest, speed / limits.turn_radius_m)
    if abs(omega) <= widest:
        return VelocityCommand(v, omega, side)
    omega = copysign(max(widest, abs(gentlest)), omega if gentlest == 0 else gentlest)
    if abs(omega) <= widest:
        return VelocityCommand(v, omega, side)
    # It cannot turn that little yet: the speed stays nearer to what it was.
    was = hypot(before.v, before.lateral)
    slowest, fastest = 0.0, limits.lateral_acceleration_mps2 / abs(omega)
    if limits.turn_radius_m > 0:
        slowest = limits.turn_radius_m * abs(omega)
    share = _share(v, side, before, slowest, fastest) if was > 0 else 0.0
    return VelocityCommand(
        before.v + share * (v - before.v),
        omega,
        before.lateral + share * (side - before.lateral),
    )


def _share(v: float, side: float, before: VelocityCommand, slowest: float, fastest: float) -> float:
    """How far a speed may go from the one before towards another, within bounds that hold for the one before."""
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = (low + high) / 2
        speed = hypot(
            before.v + middle * (v - before.v), before.lateral + middle * (side - before.lateral)
        )
        if slowest <= speed <= fastest:
            low = middle
        else:
            high = middle
    return low


def _braked(before: VelocityCommand, dt: float, limits: Limits) -> VelocityCommand:
    """Towards rest on the curve that is being driven."""
    loss = limits.deceleration_mps2 * dt
    turn = limits.turn_acceleration_radps2 * dt
    shrink = min(
        1.0,
        loss / max(hypot(before.v, before.lateral), 1e-300),
        turn / max(abs(before.omega), 1e-300),
    )
    if shrink >= 1.0:
        return VelocityCommand(0.0, 0.0)
    keep = 1.0 - shrink
    return VelocityCommand(before.v * keep, before.omega * keep, before.lateral * keep)


def _part(before: float, wanted: float, span: tuple[float, float]) -> float:
    """How much of a change stays within a span."""
    change = wanted - before
    if change == 0:
        return 1.0
    return (span[1] - before if change > 0 else span[0] - before) / change


def _clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
