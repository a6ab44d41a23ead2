"""The robots of the embedded world: what they are told, what they tell, and where they are seen."""

from __future__ import annotations

from collections import deque
from functools import partial
from itertools import combinations
from math import hypot, inf, isfinite
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.robots.protocol import RobotReading
from airground.sim.live_vehicle import LiveOdometer, LiveVehicle

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.geometry.arrays import FloatArray
    from airground.sim.body_poses import PoseOfTime
    from airground.sim.live_faults import Faults, RobotFaults
    from airground.sim.live_options import EmbeddedOptions, RobotPlace

__all__ = ["LiveFleet"]

MOST_READINGS = 500  # that nobody asks for
NOWHERE_M = (0.0, -100.0)  # behind the camera


class LiveFleet:
    """Robots that are advanced together.

    Parameters
    ----------
    places : tuple of RobotPlace
        Names, and where they start.
    options : EmbeddedOptions
        Their nature.
    faults : Faults
        What is wrong with them.
    rng : Generator
        Of all their noise.
    start_s : float [s]
        Time at which they stand at their places.
    """

    def __init__(
        self,
        places: tuple[RobotPlace, ...],
        options: EmbeddedOptions,
        faults: Faults,
        rng: np.random.Generator,
        start_s: float,
    ) -> None:
        self._faults = faults
        self._late_s = options.odometry.latency_s
        self.vehicles: dict[str, LiveVehicle] = {}
        """By name."""
        self._odometers: dict[str, LiveOdometer] = {}
        self._heard: dict[str, deque[RobotReading]] = {}
        self._compass: dict[str, float | None] = {}
        for place, (wheels, tells) in zip(
            places, (one.spawn(2) for one in rng.spawn(len(places))), strict=True
        ):
            name = place.name
            vehicle = LiveVehicle(
                place, options, rng=wheels, start_s=start_s, faults=partial(self._wrong_with, name)
            )
            self.vehicles[name] = vehicle
            self._odometers[name] = LiveOdometer(vehicle, options.odometry, tells)
            self._heard[name] = deque(maxlen=MOST_READINGS)
            self._compass[name] = None

    def advance(self, t: float) -> None:
        """Drive on, and tell.

        Parameters
        ----------
        t : float [s]
            Until when.
        """
        for name, push in self._faults.take_pushes():
            self.vehicles[name].push(*push)
        for name, vehicle in self.vehicles.items():
            vehicle.advance(t)
            faults = self._wrong_with(name)
            for reading in self._odometers[name].readings(t):
                if faults.link_gone:
                    continue
                heading = reading.theta if isfinite(reading.theta) else None
                if not faults.compass_stuck or self._compass[name] is None:
                    self._compass[name] = heading
                self._heard[name].append(
                    RobotReading(
                        reading.t + self._late_s, self._compass[name], reading.v, reading.omega
                    )
                )

    def skip(self, t: float) -> None:
        """Let much time pass quickly, at rest and unheard.

        Parameters
        ----------
        t : float [s]
            Until when.
        """
        for name, vehicle in self.vehicles.items():
            vehicle.skip(t)
            self._odometers[name].skip(t)
            self._heard[name].clear()

    def command(self, name: str, t: float, command: VelocityCommand) -> None:
        """Send a command.

        Parameters
        ----------
        name : str
            To which robot.
        t : float [s]
            When.
        command : VelocityCommand
            What to do.

        Raises
        ------
        InputError
            If there is no such robot, or the command is not finite, or not for its kind, or too late.
        """
        self.vehicle(name).command(t, command)

    def readings(self, name: str, t: float) -> list[RobotReading]:
        """Give what a robot has told and nobody has asked for yet.

        Parameters
        ----------
        name : str
            Which robot.
        t : float [s]
            Now.

        Returns
        -------
        readings : list of RobotReading
            In order.

        Raises
        ------
        InputError
            If there is no such robot.
        """
        self.vehicle(name)
        heard, found = self._heard[name], []
        while heard and heard[0].t <= t + 1e-9:
            found.append(heard.popleft())
        return found

    def vehicle(self, name: str) -> LiveVehicle:
        """Find a robot.

        Parameters
        ----------
        name : str
            Its name.

        Returns
        -------
        vehicle : LiveVehicle
            Of that name.

        Raises
        ------
        InputError
            If there is none.
        """
        if name not in self.vehicles:
            raise InputError(f"no robot is called {name!r}; there are {', '.join(self.vehicles)}")
        return self.vehicles[name]

    def closest_m(self, *others: tuple[float, float]) -> float:
        """Least distance of the middles of two vehicles now.

        Parameters
        ----------
        *others : (float, float) [m]
            Where other vehicles are.

        Returns
        -------
        distance : float [m]
            Infinite for a single one.
        """
        places = [*others, *(vehicle.place[:2] for vehicle in self.vehicles.values())]
        pairs = combinations(places, 2)
        return min((hypot(x - x2, y - y2) for (x, y), (x2, y2) in pairs), default=inf)

    def shown(self, name: str) -> PoseOfTime:
        """Where a robot is seen, which false sightings make differ from where it is.

        Parameters
        ----------
        name : str
            Which robot.

        Returns
        -------
        pose : callable
            For the last seconds.
        """

        def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
            state = self._faults.state
            xy, theta = self.vehicles[state.seen_as(name)].pose(t)
            return xy + state.robots[name].seen_off_m, theta

        return pose

    def cloth(self, name: str) -> PoseOfTime:
        """Where the cloth is that may cover a robot's tag.

        Parameters
        ----------
        name : str
            Which robot.

        Returns
        -------
        pose : callable
            On its roof, or out of sight.
        """
        shown = self.shown(name)

        def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
            if self._wrong_with(name).covered:
                return shown(t)
            return np.tile(NOWHERE_M, (len(t), 1)), np.zeros(len(t))

        return pose

    def _wrong_with(self, name: str) -> RobotFaults:
        return self._faults.state.robots[name]
