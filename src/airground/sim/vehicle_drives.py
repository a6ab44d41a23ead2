"""Drive trains: how wheels follow what they are told. What is here is mechanics, not control."""

from __future__ import annotations

from math import atan, copysign, exp, tan
from typing import TYPE_CHECKING, Literal

from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.sim.vehicle_options import PlantOptions

__all__ = [
    "AckermannDrive",
    "DifferentialDrive",
    "DriveTrain",
    "VehicleKind",
    "drive_train",
    "follow",
    "rounded",
]

VehicleKind = Literal["unicycle", "differential", "ackermann", "omni"]


class DriveTrain:
    """Speed, sideways speed and turn rate, each driven by itself: a unicycle, or what drives in all directions.

    Parameters
    ----------
    options : PlantOptions
        Limits and lags.
    sideways : bool
        Whether it drives in all directions.
    """

    def __init__(self, options: PlantOptions, *, sideways: bool = False) -> None:
        self.options = options
        self.sideways = sideways
        self.v = self.lateral = self.omega = 0.0

    def step(self, told: VelocityCommand, dt: float) -> None:
        """Let the wheels follow.

        Parameters
        ----------
        told : VelocityCommand
            Finite; what holds during the step.
        dt : float [s]
            Of the step.
        """
        o = self.options
        v = _within(_alive(told.v, o.dead_band_mps), -o.reverse_mps, o.speed_mps)
        omega = _within(
            _alive(told.omega, o.dead_band_radps), -o.turn_rate_radps, o.turn_rate_radps
        )
        self.v = follow(self.v, v, o.speed_lag_s, o.acceleration_mps2, dt)
        self.omega = follow(self.omega, omega, o.turn_lag_s, o.turn_acceleration_radps2, dt)
        if self.sideways:
            side = _within(_alive(told.lateral, o.dead_band_mps), -o.speed_mps, o.speed_mps)
            self.lateral = follow(self.lateral, side, o.speed_lag_s, o.acceleration_mps2, dt)


class DifferentialDrive(DriveTrain):
    """Two wheels on one axle; each is driven and saturates by itself, so that at full speed it does not turn.

    Parameters
    ----------
    options : PlantOptions
        Limits and lags.
    """

    def __init__(self, options: PlantOptions) -> None:
        super().__init__(options)
        self.wheels = (0.0, 0.0)  # right, left [m/s]

    def step(self, told: VelocityCommand, dt: float) -> None:
        """Let both wheels follow.

        Parameters
        ----------
        told : VelocityCommand
            Finite; what holds during the step.
        dt : float [s]
            Of the step.
        """
        o = self.options
        half = o.track_width_m / 2
        v = _within(told.v, -o.reverse_mps, o.speed_mps)
        omega = _within(told.omega, -o.turn_rate_radps, o.turn_rate_radps)
        right, left = (
            follow(
                now,
                _within(
                    _alive(v + side * half * omega, o.dead_band_mps), -o.speed_mps, o.speed_mps
                ),
                o.speed_lag_s,
                o.acceleration_mps2,
                dt,
            )
            for now, side in zip(self.wheels, (1, -1), strict=True)
        )
        self.wheels = (right, left)
        self.v = (right + left) / 2
        self.omega = (right - left) / o.track_width_m


class AckermannDrive(DriveTrain):
    """A car: it turns by steering, only while it drives, and no tighter than its steering lets it.

    Parameters
    ----------
    options : PlantOptions
        Limits and lags.
    """

    def __init__(self, options: PlantOptions) -> None:
        super().__init__(options)
        self.steering = 0.0  # [rad]

    def step(self, told: VelocityCommand, dt: float) -> None:
        """Let speed and steering follow; told to stand, it leaves the steering as it is.

        Parameters
        ----------
        told : VelocityCommand
            Finite; what holds during the step.
        dt : float [s]
            Of the step.
        """
        o = self.options
        v = _within(_alive(told.v, o.dead_band_mps), -o.reverse_mps, o.speed_mps)
        self.v = follow(self.v, v, o.speed_lag_s, o.acceleration_mps2, dt)
        if told.v != 0:
            angle = atan(o.wheelbase_m * told.omega / told.v)
            wanted = _within(angle, -o.steering_rad, o.steering_rad)
            self.steering = follow(self.steering, wanted, o.turn_lag_s, o.steering_rate_radps, dt)
        self.omega = self.v * tan(self.steering) / o.wheelbase_m


def drive_train(kind: VehicleKind, options: PlantOptions) -> DriveTrain:
    """Build what moves a vehicle.

    Parameters
    ----------
    kind : str
        unicycle, differential, ackermann or omni.
    options : PlantOptions
        Limits and lags.

    Returns
    -------
    drive : DriveTrain
        At rest.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    if kind == "differential":
        return DifferentialDrive(options)
    if kind == "ackermann":
        return AckermannDrive(options)
    if kind in ("unicycle", "omni"):
        return DriveTrain(options, sideways=kind == "omni")
    raise InputError(f"kind must be unicycle, differential, ackermann or omni, not {kind!r}")


def follow(now: float, wanted: float, lag: float, rate: float, dt: float) -> float:
    """First-order lag within a rate limit.

    Parameters
    ----------
    now, wanted : float
        Value at the start, and where it goes.
    lag : float [s]
        Time constant; 0 for none.
    rate : float
        Largest change per second.
    dt : float [s]
        Duration.

    Returns
    -------
    value : float
        At the end.
    """
    change = (wanted - now) * (1.0 - exp(-dt / lag) if lag > 0 else 1.0)
    return now + _within(change, -rate * dt, rate * dt)


def rounded(value: float, quantum: float) -> float:
    """Round to what a message can hold.

    Parameters
    ----------
    value : float
        A number.
    quantum : float
        Its unit; 0 for none.

    Returns
    -------
    value : float
        A multiple of it, halves away from zero.
    """
    if quantum == 0:
        return value
    return copysign(int(abs(value) / quantum + 0.5) * quantum, value)


def _within(value: float, least: float, most: float) -> float:
    return min(max(value, least), most)


def _alive(value: float, dead_band: float) -> float:
    """What is left of a command where friction holds the wheels."""
    return 0.0 if abs(value) < dead_band else value
