"""What drives in all directions: wheels with rollers, mecanum or omni.

A wheel that rolls along a, with rollers that let it slide along b, only feels what of its hub's velocity h is not along
b: ``speed = (h . n) / (r (a . n))``, n perpendicular to b. For an omni wheel b is across the wheel, for a mecanum wheel
at 45 degrees to it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, inf, sin
from typing import TYPE_CHECKING, Self

import numpy as np

from airground.control.command import VelocityCommand
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from airground.control.limits import Limits

__all__ = ["Omnidirectional"]


@dataclass(frozen=True, slots=True, eq=False)
class Omnidirectional:
    """Three wheels or more that can move it in all directions; build it with `mecanum` or `omni_wheels`."""

    wheels_from_motion: FloatArray
    """(N, 3). Wheel speeds [rad/s] for speeds forwards [m/s], to the left [m/s] and turn rate to the left [rad/s]."""

    wheel_speed_radps: float = inf
    """Largest speed of a wheel [rad/s]."""

    clockwise: bool = False
    """Whether headings count clockwise, seen from above: lateral speeds and turn rates are then to the right."""

    _motion_from_wheels: FloatArray = field(init=False, repr=False)
    """(3, N). Least squares: wheels that disagree slip."""

    def __post_init__(self) -> None:
        matrix = readonly(self.wheels_from_motion, (None, 3), "wheels_from_motion")
        singular = np.linalg.svd(matrix, compute_uv=False)
        if len(matrix) < 3 or not singular[2] > 1e-9 * singular[0]:
            raise InputError(
                "these wheels do not move it in all directions; give three or more that differ"
            )
        if not self.wheel_speed_radps > 0:
            raise InputError(f"wheel_speed_radps must be positive, not {self.wheel_speed_radps}")
        object.__setattr__(self, "wheels_from_motion", matrix)
        object.__setattr__(self, "_motion_from_wheels", np.linalg.pinv(matrix))

    @classmethod
    def mecanum(
        cls,
        *,
        wheel_radius_m: float,
        wheelbase_m: float,
        track_width_m: float,
        wheel_speed_radps: float = inf,
        clockwise: bool = False,
    ) -> Self:
        """Four mecanum wheels whose rollers, seen from above, form an X.

        Parameters
        ----------
        wheel_radius_m : float [m]
            Of the wheels.
        wheelbase_m : float [m]
            From front to rear axle.
        track_width_m : float [m]
            From left to right wheels.
        wheel_speed_radps : float [rad/s]
            Largest speed of a wheel.
        clockwise : bool
            Whether headings count clockwise.

        Returns
        -------
        vehicle : Omnidirectional
            Wheels in the order front left, front right, rear left, rear right.

        Raises
        ------
        InputError
            If a length is not positive.
        """
        _lengths(
            wheel_radius_m=wheel_radius_m, wheelbase_m=wheelbase_m, track_width_m=track_width_m
        )
        k = 0.5 * (wheelbase_m + track_width_m)
        rows = np.array([[1, -1, -k], [1, 1, k], [1, 1, -k], [1, -1, k]]) / wheel_radius_m
        return cls(rows, wheel_speed_radps, clockwise)

    @classmethod
    def omni_wheels(
        cls,
        *,
        wheel_radius_m: float,
        distance_m: float,
        bearings_rad: tuple[float, ...],
        wheel_speed_radps: float = inf,
        clockwise: bool = False,
    ) -> Self:
        """Omni wheels on a circle, each rolling along it; positive speeds turn the vehicle to the left.

        Parameters
        ----------
        wheel_radius_m : float [m]
            Of the wheels.
        distance_m : float [m]
            Of each wheel from the centre.
        bearings_rad : tuple of float [rad]
            Where each wheel is, from straight ahead to the left; thirds of a turn for three wheels.
        wheel_speed_radps : float [rad/s]
            Largest speed of a wheel.
        clockwise : bool
            Whether headings count clockwise.

        Returns
        -------
        vehicle : Omnidirectional
            Wheels in the order given.

        Raises
        ------
        InputError
            If a length is not positive, or the wheels do not reach all directions.
        """
        _lengths(wheel_radius_m=wheel_radius_m, distance_m=distance_m)
        rows = np.array([[-sin(b), cos(b), distance_m] for b in bearings_rad]).reshape(-1, 3)
        return cls(rows / wheel_radius_m, wheel_speed_radps, clockwise)

    def to_vehicle(self, command: VelocityCommand) -> tuple[float, ...]:
        """Wheel speeds.

        Parameters
        ----------
        command : VelocityCommand
            Wanted.

        Returns
        -------
        wheels : tuple of float [rad/s]
            Not bounded.
        """
        sign = -1.0 if self.clockwise else 1.0
        motion = (command.v, sign * command.lateral, sign * command.omega)
        return tuple((self.wheels_from_motion @ motion).tolist())

    def from_vehicle(self, actuators: tuple[float, ...]) -> VelocityCommand:
        """Motion of the centre that fits the wheels best.

        Parameters
        ----------
        actuators : tuple of float [rad/s]
            Speed of each wheel.

        Returns
        -------
        command : VelocityCommand
            By least squares, where there are more wheels than three.

        Raises
        ------
        InputError
            If there is not one speed for each wheel.
        """
        speeds = readonly(actuators, (len(self.wheels_from_motion),), "actuators")
        sign = -1.0 if self.clockwise else 1.0
        forward, left, turn = (self._motion_from_wheels @ speeds).tolist()
        return VelocityCommand(forward, sign * turn, sign * left)

    def feasible(self, command: VelocityCommand) -> VelocityCommand:
        """Slow all wheels alike, so that the curve and the direction stay.

        Parameters
        ----------
        command : VelocityCommand
            Wanted.

        Returns
        -------
        command : VelocityCommand
            With no wheel too fast.
        """
        fastest = max(abs(speed) for speed in self.to_vehicle(command))
        if not fastest > self.wheel_speed_radps:
            return command
        f = self.wheel_speed_radps / fastest
        return VelocityCommand(f * command.v, f * command.omega, f * command.lateral)

    def limits(self, base: Limits) -> Limits:
        """Bound the speed by the slowest direction, and the turn rate, each alone.

        Parameters
        ----------
        base : Limits
            As set by the operator.

        Returns
        -------
        limits : Limits
            Tighter where need be.
        """
        rows = self.wheels_from_motion
        speed = self.wheel_speed_radps / float(np.hypot(rows[:, 0], rows[:, 1]).max())
        turn = self.wheel_speed_radps / float(np.abs(rows[:, 2]).max())
        return replace(
            base,
            speed_mps=min(base.speed_mps, speed),
            reverse_mps=min(base.reverse_mps, speed),
            turn_rate_radps=min(base.turn_rate_radps, turn),
        )


def _lengths(**lengths: float) -> None:
    for name, value in lengths.items():
        if not 0 < value < inf:
            raise InputError(f"{name} must be positive and finite, not {value}")
