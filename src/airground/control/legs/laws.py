"""What a robot is told while it turns to a leg, and while it drives one."""

from __future__ import annotations

from math import copysign
from typing import TYPE_CHECKING

from airground.control.command import VelocityCommand
from airground.control.drive_laws import closing_rate, turn_reach

if TYPE_CHECKING:
    from airground.control.legs.types import LegDriveOptions
    from airground.control.limits import Limits

__all__ = ["driving", "turning"]

TURN_GAIN = 2.5  # [1/s] at the end of a turn: readings and motors are late by some 0.2 s
HOLD_GAIN = 2.0  # [1/s] of the heading under way
HOLD_RADPS = 0.6  # fastest correction of the heading under way
END_GAIN = 2.5  # [1/s] at the end of a leg
CREEP_MPS = 0.04  # what motors still do
WIDER = 1.1  # arcs are so much wider than the tightest


def turning(
    error_rad: float, gear: int, limits: Limits, options: LegDriveOptions
) -> VelocityCommand:
    """Turn towards a heading.

    Parameters
    ----------
    error_rad : float [rad]
        To turn by, with its sign.
    gear : int
        1 forwards, -1 in reverse; of what turns on arcs only.
    limits : Limits
        Of the robot.
    options : LegDriveOptions
        How fast.

    Returns
    -------
    command : VelocityCommand
        On the spot, or on an arc where the robot needs one.
    """
    braking = 0.5 * limits.turn_acceleration_radps2
    rate = min(options.turn_radps, limits.turn_rate_radps)
    omega = copysign(closing_rate(abs(error_rad), TURN_GAIN, rate, braking), error_rad)
    if limits.turn_radius_m == 0:
        return VelocityCommand(0.0, omega)
    v = min(options.back_mps, limits.speed_mps)
    if gear < 0:
        v = min(v, limits.reverse_mps)
    reach = v / (limits.turn_radius_m * WIDER)
    return VelocityCommand(gear * v, min(max(omega, -reach), reach))


def driving(
    left_m: float, error_rad: float, speed_mps: float, limits: Limits, gear: int = 1
) -> VelocityCommand:
    """Drive straight on, holding the heading.

    Parameters
    ----------
    left_m : float [m]
        To the end, where it shall rest.
    error_rad : float [rad]
        Of the heading: to turn by, with its sign.
    speed_mps : float [m/s]
        Wanted, positive.
    limits : Limits
        Of the robot.
    gear : int
        1 forwards, -1 in reverse.

    Returns
    -------
    command : VelocityCommand
        Slower near the end.
    """
    most = min(speed_mps, limits.speed_mps if gear > 0 else limits.reverse_mps)
    v = closing_rate(left_m, END_GAIN, most, 0.6 * limits.deceleration_mps2)
    v = max(v, min(CREEP_MPS, most))
    reach = min(HOLD_RADPS, turn_reach(limits, v))
    omega = min(max(HOLD_GAIN * error_rad, -reach), reach)
    return VelocityCommand(gear * v, omega)
