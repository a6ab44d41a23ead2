"""Somebody else's driver: goes from corner to corner, and turns on the spot at each."""

from __future__ import annotations

from math import atan2, cos, hypot, remainder, sin, tau
from typing import TYPE_CHECKING

from airground.control.command import VelocityCommand

if TYPE_CHECKING:
    from airground.sim3d.options import Other3d

__all__ = ["RouteDriver"]

TURN_RADPS = 0.8
SURE_RAD = 0.06  # of the direction, before it drives off
LOST_RAD = 0.5  # beyond which it stops to turn again
AHEAD_M = 0.35  # that it looks along the line


class RouteDriver:
    """Sees its vehicle's true pose, as a person who walks along does.

    Parameters
    ----------
    other : Other3d
        Route and speed.
    """

    def __init__(self, other: Other3d) -> None:
        self._route = other.route_m
        self._speed = other.speed_mps
        self._next = 1
        self._turning = True

    def command(self, x: float, y: float, theta: float) -> VelocityCommand:
        """Decide.

        Parameters
        ----------
        x, y : float [m]
            Where the axle is.
        theta : float [rad]
            Where it points.

        Returns
        -------
        command : VelocityCommand
            Until it is asked again.
        """
        (x0, y0), (x1, y1) = self._leg()
        length = hypot(x1 - x0, y1 - y0)
        east, north = (x1 - x0) / length, (y1 - y0) / length
        gone = (x - x0) * east + (y - y0) * north
        if gone >= length - 0.02:
            self._next = (self._next + 1) % len(self._route)
            self._turning = True
            return self.command(x, y, theta)
        aside = (y - y0) * east - (x - x0) * north
        wanted = atan2(north, east) - atan2(aside, AHEAD_M)
        off = remainder(wanted - theta, tau)
        if abs(off) > LOST_RAD:
            self._turning = True
        if self._turning and abs(off) > SURE_RAD:
            rate = max(min(2.0 * off, TURN_RADPS), -TURN_RADPS)
            return VelocityCommand(0.0, rate)
        self._turning = False
        return VelocityCommand(self._speed * max(cos(off), 0.0), 1.5 * sin(off))

    def _leg(self) -> tuple[tuple[float, float], tuple[float, float]]:
        return self._route[self._next - 1], self._route[self._next]
