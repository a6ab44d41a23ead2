"""A robot of the embedded world: a simulated vehicle that runs for days, can be hindered, and tells of its motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.sim.live_memory import REST, ShortHistory, ShortNoise
from airground.sim.vehicle_drives import drive_train
from airground.sim.vehicle_odometry import Odometer, OdometryNoise
from airground.sim.vehicle_plant import VehiclePlant

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.control.command import VelocityCommand
    from airground.sim.live_faults import RobotFaults
    from airground.sim.live_options import EmbeddedOptions, RobotPlace

__all__ = ["LiveOdometer", "LiveVehicle"]

PUSH_S = 0.2
HALT_S = 2.0  # by then its watchdog has stopped it


class LiveVehicle(VehiclePlant):
    """A vehicle whose faults are switched while it drives; of its past it keeps some seconds.

    Parameters
    ----------
    place : RobotPlace
        Where it starts.
    options : EmbeddedOptions
        Its nature.
    rng : Generator
        Of the slip.
    start_s : float [s]
        Time at which it stands there.
    faults : callable
        What is wrong with it now.
    """

    def __init__(
        self,
        place: RobotPlace,
        options: EmbeddedOptions,
        *,
        rng: np.random.Generator,
        start_s: float,
        faults: Callable[[], RobotFaults],
    ) -> None:
        super().__init__(
            place.start_m,
            place.heading_rad,
            options.kind,
            options.plant,
            rng=rng,
            start_s=start_s,
        )
        self._faults = faults
        self._history: ShortHistory = ShortHistory(start_s, self.xy, self.theta)
        self._slips = tuple(
            ShortNoise(one, options.plant.slip_s, start_s) for one in rng.spawn(len(self._slips))
        )
        self._kept: tuple[float, ...] = REST  # what a runaway goes on doing
        self._push = (0.0, 0.0, 0.0)
        self._push_end = start_s

    @property
    def place(self) -> tuple[float, float, float]:
        """Position [m] and heading [rad] now, quickly."""
        return self._history.newest

    def command(self, t: float, command: VelocityCommand) -> None:
        """Send a command, which gets lost where the link is gone.

        Parameters
        ----------
        t : float [s]
            As for `VehiclePlant.command`.
        command : VelocityCommand
            What to do.

        Raises
        ------
        InputError
            If the command is not finite, asks for what the vehicle has no wheels for, or comes too late.
        """
        if not self._faults().link_gone:
            super().command(t, command)

    def push(self, ahead_m: float, left_m: float, turn_rad: float) -> None:
        """Push it, from now on for a fifth of a second.

        Parameters
        ----------
        ahead_m, left_m : float [m]
            How far, along its own axes.
        turn_rad : float [rad]
            How far it is turned.
        """
        self._push = (ahead_m / PUSH_S, turn_rad / PUSH_S, left_m / PUSH_S)
        self._push_end = self.now + PUSH_S

    def skip(self, t: float) -> None:
        """Let time pass in which nobody tells it anything: it comes to rest and stands.

        Parameters
        ----------
        t : float [s]
            Not before now.

        Raises
        ------
        InputError
            If it is.
        """
        self.advance(min(t, self.now + HALT_S))
        if t > self.now:
            self._drive = drive_train(self.kind, self.options)
            self._history.drive([t], [REST])
            self._now = t

    def _over_ground(self, t: float) -> tuple[float, ...]:
        motion, faults = super()._over_ground(t), self._faults()
        if faults.runaway:
            motion = self._kept
        self._kept = motion
        if faults.motor_off:
            motion = REST
        if faults.blocked:
            motion = (0.0, 0.0, 0.0, *motion[3:])
        if t < self._push_end:
            motion = (*(a + b for a, b in zip(motion, self._push, strict=False)), *motion[3:])
        return motion


class LiveOdometer(Odometer):
    """Readings of a vehicle that runs for days.

    Parameters
    ----------
    body : LiveVehicle
        The vehicle.
    noise : OdometryNoise
        How badly it knows its motion.
    rng : Generator
        Where all noise comes from.
    """

    def __init__(self, body: LiveVehicle, noise: OdometryNoise, rng: np.random.Generator) -> None:
        super().__init__(body, noise, rng)
        self._slow = tuple(ShortNoise(one, noise.slow_s, body.now) for one in rng.spawn(3))

    def skip(self, t: float) -> None:
        """Leave out what would have arrived until now.

        Parameters
        ----------
        t : float [s]
            Now.
        """
        due = (t - self.noise.latency_s - self._start) * self.noise.rate_hz
        self._next = max(self._next, int(np.floor(due + 1e-6)) + 1)
