"""What steers like a car: speed and steering angle for a command, and the curves that it can drive."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan, copysign, pi, tan
from typing import TYPE_CHECKING

from airground.control.command import VelocityCommand
from airground.control.vehicles.wheels import require_positive
from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.limits import Limits

__all__ = ["Ackermann", "SpeedSteering"]


@dataclass(frozen=True, slots=True)
class SpeedSteering:
    """Of what steers like a car."""

    speed: float
    """Of the rear axle's middle [m/s]; negative in reverse."""

    steering: float
    """Angle of the (middle) front wheel [rad], positive to the left."""


@dataclass(frozen=True, slots=True)
class Ackermann:
    """Steers like a car; its place is that of the rear axle's middle."""

    wheelbase_m: float
    """Distance between the axles [m]."""

    max_steering_rad: float
    """Largest angle of the (middle) front wheel, either way [rad], below pi / 2."""

    clockwise: bool = False
    """Whether headings count clockwise, seen from above."""

    def __post_init__(self) -> None:
        require_positive(self, "wheelbase_m", "max_steering_rad")
        if not self.max_steering_rad < pi / 2:
            raise InputError(f"max_steering_rad must be below pi / 2, not {self.max_steering_rad}")

    @property
    def turn_radius_m(self) -> float:
        """Smallest radius of the rear axle's middle [m]."""
        return self.wheelbase_m / tan(self.max_steering_rad)

    def to_vehicle(self, command: VelocityCommand) -> SpeedSteering:
        """Speed and steering: ``tan(steering) = wheelbase omega / v``.

        Parameters
        ----------
        command : VelocityCommand
            Wanted; lateral speed is left out.

        Returns
        -------
        actuators : SpeedSteering
            The angle held at its limit; at rest the wheels stand straight, as the curve is not known.
        """
        if command.v == 0:
            return SpeedSteering(0.0, 0.0)
        left_turn = -command.omega if self.clockwise else command.omega
        angle = atan(self.wheelbase_m * left_turn / command.v)
        most = self.max_steering_rad
        return SpeedSteering(command.v, min(max(angle, -most), most))

    def from_vehicle(self, actuators: SpeedSteering) -> VelocityCommand:
        """Motion of the rear axle's middle.

        Parameters
        ----------
        actuators : SpeedSteering
            Speed and steering.

        Returns
        -------
        command : VelocityCommand
            With no lateral speed.
        """
        left_turn = actuators.speed * tan(actuators.steering) / self.wheelbase_m
        return VelocityCommand(actuators.speed, -left_turn if self.clockwise else left_turn)

    def feasible(self, command: VelocityCommand) -> VelocityCommand:
        """Keep the speed, and the curve unless it is too tight; a turn on the spot becomes rest.

        Parameters
        ----------
        command : VelocityCommand
            Wanted.

        Returns
        -------
        command : VelocityCommand
            Without lateral speed, and no curve tighter than the smallest radius.
        """
        most = abs(command.v) / self.turn_radius_m
        omega = command.omega
        if abs(omega) > most:
            omega = copysign(most, omega)
        return VelocityCommand(command.v, omega)

    def limits(self, base: Limits) -> Limits:
        """Set the smallest radius.

        Parameters
        ----------
        base : Limits
            As set by the operator.

        Returns
        -------
        limits : Limits
            With a radius no smaller than steering allows.
        """
        return replace(base, turn_radius_m=max(base.turn_radius_m, self.turn_radius_m))
