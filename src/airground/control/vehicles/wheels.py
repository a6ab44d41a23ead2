"""Kinds of vehicles: what their wheels must do for a command, and what of a command they can do.

Each says in its own terms what a `VelocityCommand` is (`to_vehicle`), what command its own state amounts to
(`from_vehicle`), which command nearest to one it can do (`feasible`, the curve kept), and what it makes of `Limits`.
Left and right are those of someone who sits in it; where headings count clockwise, a positive turn rate is to the right
and a positive lateral speed too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Protocol, TypeVar

from airground.control.command import VelocityCommand
from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.limits import Limits

__all__ = [
    "DifferentialDrive",
    "Unicycle",
    "Vehicle",
    "WheelSpeeds",
    "require_positive",
]

Actuators = TypeVar("Actuators")
"""What a kind of vehicle is told in its own terms."""


class Vehicle(Protocol[Actuators]):
    """What knows how a kind of vehicle moves."""

    def to_vehicle(self, command: VelocityCommand) -> Actuators:
        """What the vehicle's actuators must do.

        Parameters
        ----------
        command : VelocityCommand
            Wanted; what of it the vehicle cannot do at all is left out, speeds are not bounded (see `feasible`).

        Returns
        -------
        actuators : Actuators
            In the vehicle's own terms.
        """
        ...

    def from_vehicle(self, actuators: Actuators) -> VelocityCommand:
        """How the vehicle moves.

        Parameters
        ----------
        actuators : Actuators
            What its actuators do.

        Returns
        -------
        command : VelocityCommand
            Motion of the axle's middle, or of the centre of what has no axle.
        """
        ...

    def feasible(self, command: VelocityCommand) -> VelocityCommand:
        """Nearest command that the vehicle can do, on the same curve if it can drive that.

        Parameters
        ----------
        command : VelocityCommand
            Wanted.

        Returns
        -------
        command : VelocityCommand
            Slower where need be.
        """
        ...

    def limits(self, base: Limits) -> Limits:
        """What the vehicle's build makes of limits.

        Parameters
        ----------
        base : Limits
            As set by the operator.

        Returns
        -------
        limits : Limits
            None of them wider.
        """
        ...


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Of a pair of driven wheels, or of two tracks."""

    left: float
    """[rad/s]. Forwards is positive."""

    right: float
    """[rad/s]."""


@dataclass(frozen=True, slots=True)
class Unicycle:
    """What drives and turns, and that is all that is known of it."""

    def to_vehicle(self, command: VelocityCommand) -> tuple[float, float]:
        """Speed and turn rate.

        Parameters
        ----------
        command : VelocityCommand
            Wanted.

        Returns
        -------
        v, omega : (float, float) [m/s], [rad/s]
            Its speed and its turn rate.
        """
        return command.v, command.omega

    def from_vehicle(self, actuators: tuple[float, float]) -> VelocityCommand:
        """Command with no lateral speed.

        Parameters
        ----------
        actuators : (float, float) [m/s], [rad/s]
            Speed and turn rate.

        Returns
        -------
        command : VelocityCommand
            The same.
        """
        return VelocityCommand(actuators[0], actuators[1])

    def feasible(self, command: VelocityCommand) -> VelocityCommand:
        """Leave out the lateral speed.

        Parameters
        ----------
        command : VelocityCommand
            Wanted.

        Returns
        -------
        command : VelocityCommand
            Without lateral speed.
        """
        return VelocityCommand(command.v, command.omega)

    def limits(self, base: Limits) -> Limits:
        """Limits as they are.

        Parameters
        ----------
        base : Limits
            As set by the operator.

        Returns
        -------
        limits : Limits
            The same.
        """
        return base


@dataclass(frozen=True, slots=True)
class DifferentialDrive:
    """Two driven wheels on one axle, or two tracks (with the track width that fits how they slip)."""

    wheel_radius_m: float
    """Of the driven wheels [m]; 1 for speeds in m/s."""

    track_width_m: float
    """Distance between the wheels [m]."""

    wheel_speed_radps: float = inf
    """Largest speed of a wheel [rad/s]."""

    clockwise: bool = False
    """Whether headings count clockwise, seen from above."""

    def __post_init__(self) -> None:
        require_positive(self, "wheel_radius_m", "track_width_m")
        require_positive(self, "wheel_speed_radps", finite=False)

    def to_vehicle(self, command: VelocityCommand) -> WheelSpeeds:
        """Wheel speeds.

        Parameters
        ----------
        command : VelocityCommand
            Wanted; lateral speed is left out.

        Returns
        -------
        wheels : WheelSpeeds
            Not bounded.
        """
        left_turn = -command.omega if self.clockwise else command.omega
        apart = 0.5 * self.track_width_m * left_turn
        r = self.wheel_radius_m
        return WheelSpeeds((command.v - apart) / r, (command.v + apart) / r)

    def from_vehicle(self, actuators: WheelSpeeds) -> VelocityCommand:
        """Motion of the axle's middle.

        Parameters
        ----------
        actuators : WheelSpeeds
            Of both wheels.

        Returns
        -------
        command : VelocityCommand
            With no lateral speed.
        """
        r = self.wheel_radius_m
        left_turn = r * (actuators.right - actuators.left) / self.track_width_m
        omega = -left_turn if self.clockwise else left_turn
        return VelocityCommand(0.5 * r * (actuators.right + actuators.left), omega)

    def feasible(self, command: VelocityCommand) -> VelocityCommand:
        """Slow both wheels alike, so that the curve stays.

        Parameters
        ----------
        command : VelocityCommand
            Wanted.

        Returns
        -------
        command : VelocityCommand
            Without lateral speed, and with no wheel too fast.
        """
        wheels = self.to_vehicle(command)
        fastest = max(abs(wheels.left), abs(wheels.right))
        if not fastest > self.wheel_speed_radps:
            return VelocityCommand(command.v, command.omega)
        f = self.wheel_speed_radps / fastest
        return VelocityCommand(f * command.v, f * command.omega)

    def limits(self, base: Limits) -> Limits:
        """Bound speed and turn rate by what the wheels can do, each alone.

        Parameters
        ----------
        base : Limits
            As set by the operator.

        Returns
        -------
        limits : Limits
            Tighter where need be. Both at once may still be too fast for the outer wheel: see `feasible`.
        """
        speed = self.wheel_radius_m * self.wheel_speed_radps
        return replace(
            base,
            speed_mps=min(base.speed_mps, speed),
            reverse_mps=min(base.reverse_mps, speed),
            turn_rate_radps=min(base.turn_rate_radps, 2 * speed / self.track_width_m),
        )


def require_positive(owner: object, *names: str, finite: bool = True) -> None:
    """Raise where a field of a vehicle is not positive.

    Parameters
    ----------
    owner : object
        The vehicle.
    *names : str
        Fields.
    finite : bool
        Whether infinity is refused too.

    Raises
    ------
    InputError
        If one is not what it must be.
    """
    for name in names:
        value = getattr(owner, name)
        if not value > 0 or (finite and value == inf):
            raise InputError(f"{name} must be positive{' and finite' * finite}, not {value}")
