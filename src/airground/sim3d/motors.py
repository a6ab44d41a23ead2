"""What becomes of commands: they arrive late, are turned into rates of two wheels, and run out."""

from __future__ import annotations

from collections import deque
from math import inf
from typing import TYPE_CHECKING, Any

from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.sim3d.options import RobotOptions3d

__all__ = ["Motors"]


class Motors:
    """The two wheels of one vehicle.

    Parameters
    ----------
    name : str
        Of the vehicle.
    options : RobotOptions3d
        Delay, watchdog and top speed.
    wheel_radii_m : (float, float) [m]
        What its software takes its wheels' for, left and right.
    track_m : float [m]
        What it takes the way between them for.
    """

    def __init__(
        self,
        name: str,
        options: RobotOptions3d,
        wheel_radii_m: tuple[float, float],
        track_m: float,
    ) -> None:
        self._name = name
        self._options = options
        self._radii = wheel_radii_m
        self._track = track_m
        self._coming: deque[tuple[float, VelocityCommand]] = deque()
        self._until = inf
        self._last = -inf

    @property
    def next_s(self) -> float:
        """When something changes by itself [s]; infinite for never."""
        return min(self._coming[0][0] if self._coming else inf, self._until)

    def tell(self, t: float, command: VelocityCommand) -> None:
        """Send a command.

        Parameters
        ----------
        t : float [s]
            When; not before the last one.
        command : VelocityCommand
            What to do.

        Raises
        ------
        InputError
            If it is not finite, or for a robot that drives sideways, or too late.
        """
        if not command.finite or command.lateral != 0:
            raise InputError(f"{self._name} takes a finite v and omega and no lateral: {command}")
        if not t >= self._last - 1e-9:
            raise InputError(f"{self._name} had a command at {self._last} s, after {t} s")
        self._last = t
        self._coming.append((t + self._options.command_latency_s, command))

    def act(self, data: Any, t: float) -> None:
        """Do what has come up.

        Parameters
        ----------
        data : MjData
            Whose motors are told.
        t : float [s]
            Now.
        """
        while self._coming and self._coming[0][0] <= t + 1e-9:
            since, command = self._coming.popleft()
            self._until = since + self._options.watchdog_s
            self._turn(data, command.v, command.omega)
        if self._until <= t + 1e-9:
            self._until = inf
            self._turn(data, 0.0, 0.0)

    def _turn(self, data: Any, v: float, omega: float) -> None:
        left, right = v - omega * self._track / 2, v + omega * self._track / 2
        share = min(1.0, self._options.most_speed_mps / max(abs(left), abs(right), 1e-9))
        data.actuator(f"{self._name}_left").ctrl[0] = share * left / self._radii[0]
        data.actuator(f"{self._name}_right").ctrl[0] = share * right / self._radii[1]
