"""One robot's readings, integrated as they come in.

The path is the one of `airground.calibration.ground_path`: arcs between readings of a heading, trapezia between
readings of a velocity, a cubic inside each interval. Its noise is a random walk beside it, relative to the speed, so
that its covariance only adds up and a displacement's is the difference of two.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import NamedTuple

from airground.calibration.ground_path import GAP_FACTOR, MAX_GAP, MAX_TURN

__all__ = ["OdometryNoise", "PathPoint", "ReadingPath"]

USUAL = 0.05  # weight of the newest interval in what counts as a usual one


class OdometryNoise(NamedTuple):
    """How fast the integrated readings lose their way."""

    along: float
    """Relative noise density of the velocity along the motion [sqrt(s)]."""

    across: float
    """Relative noise density of the velocity across the motion [sqrt(s)]; that of the heading, in radians."""

    floor: float
    """Random walk of the position that does not depend on the speed [m/sqrt(s)]."""


class PathPoint(NamedTuple):
    """Where the readings say that a robot is, up to a constant, and how fast it goes."""

    x: float
    """[m]. Integrated."""

    y: float
    """[m]. Integrated."""

    x_dot: float
    """[m/s]. Ground velocity."""

    y_dot: float
    """[m/s]. Ground velocity."""

    qxx: float
    """[m^2]. Covariance of x, as a random walk's: that of a displacement is a difference."""

    qxy: float
    """[m^2]. Of x and y."""

    qyy: float
    """[m^2]. Of y."""

    stretch: int
    """Displacements are known within one unbroken stretch of readings only."""


class ReadingPath:
    """Integrated readings of one robot; the older ones are forgotten.

    Parameters
    ----------
    noise : OdometryNoise
        How fast they lose their way.
    keep : int
        How many readings to remember, at least.
    """

    def __init__(self, noise: OdometryNoise, keep: int = 2000) -> None:
        self._along = noise.along**2
        self._across = noise.across**2
        self._floor = noise.floor**2
        self._keep = keep
        self._usual = 0.0  # s; between readings
        self._heading = 0.0
        self.t: list[float] = []
        self.points: list[PathPoint] = []
        self.readings: list[tuple[float, float]] = []

    @property
    def last_t(self) -> float:
        """Time of the newest reading [s]; minus infinity before the first."""
        return self.t[-1] if self.t else -math.inf

    def add_velocity(self, t: float, x_dot: float, y_dot: float) -> bool:
        """Take a ground velocity.

        Parameters
        ----------
        t : float [s]
            When.
        x_dot : float [m/s]
            Ground velocity.
        y_dot : float [m/s]
            Ground velocity.

        Returns
        -------
        taken : bool
            False if it came too late: not newer than the newest.
        """
        if t <= self.last_t:
            return False
        whole = self._whole(t)
        step_x = step_y = 0.0
        if whole:
            dt, old = t - self.t[-1], self.points[-1]
            step_x, step_y = dt * (old.x_dot + x_dot) / 2, dt * (old.y_dot + y_dot) / 2
        self._append(t, (x_dot, y_dot), (step_x, step_y), whole=whole)
        self.readings.append((x_dot, y_dot))
        return True

    def add_heading(self, t: float, heading: float, speed: float) -> bool:
        """Take a heading and a speed along it.

        Parameters
        ----------
        t : float [s]
            When.
        heading : float [rad]
            Counter-clockwise from x; may wrap.
        speed : float [m/s]
            Negative in reverse.

        Returns
        -------
        taken : bool
            False if it came too late: not newer than the newest.
        """
        if t <= self.last_t:
            return False
        turn = math.remainder(heading - self._heading, 2 * math.pi)
        whole = self._whole(t) and abs(turn) <= MAX_TURN
        step_x = step_y = 0.0
        if whole:
            # A chord of a circular arc is shorter than the arc, by sinc of half the turn.
            half = turn / 2
            arc = 1.0 if half == 0.0 else math.sin(half) / half
            chord = (t - self.t[-1]) * (self.readings[-1][1] + speed) / 2 * arc
            middle = self._heading + half
            step_x, step_y = chord * math.cos(middle), chord * math.sin(middle)
        self._heading = heading
        velocity = (speed * math.cos(heading), speed * math.sin(heading))
        self._append(t, velocity, (step_x, step_y), whole=whole)
        self.readings.append((heading, speed))
        return True

    def at(self, t: float) -> PathPoint | None:
        """Where the readings put the robot.

        Parameters
        ----------
        t : float [s]
            When, on the readings' clock.

        Returns
        -------
        point : PathPoint or None
            None outside what is remembered, and in gaps.
        """
        times = self.t
        if not times or t < times[0] or t > times[-1]:
            return None
        k = bisect_right(times, t) - 1
        p = self.points[k]
        if t == times[k]:
            return p
        n = self.points[k + 1]
        if n.stretch != p.stretch:
            return None
        h = times[k + 1] - times[k]
        s = (t - times[k]) / h
        r = 1.0 - s
        a, b, c, d = (1 + 2 * s) * r * r, s * r * r * h, s * s * (3 - 2 * s), -s * s * r * h
        return PathPoint(
            a * p.x + b * p.x_dot + c * n.x + d * n.x_dot,
            a * p.y + b * p.y_dot + c * n.y + d * n.y_dot,
            r * p.x_dot + s * n.x_dot,
            r * p.y_dot + s * n.y_dot,
            r * p.qxx + s * n.qxx,
            r * p.qxy + s * n.qxy,
            r * p.qyy + s * n.qyy,
            p.stretch,
        )

    def _whole(self, t: float) -> bool:
        """Tell whether the interval that ends at t says how the robot moved in it."""
        if not self.t:
            return False
        dt = t - self.t[-1]
        whole = dt <= max(MAX_GAP, GAP_FACTOR * self._usual)
        if whole:
            self._usual += (dt - self._usual) * (USUAL if self._usual else 1.0)
        return whole

    def _append(
        self, t: float, velocity: tuple[float, float], step: tuple[float, float], *, whole: bool
    ) -> None:
        (x_dot, y_dot), (step_x, step_y) = velocity, step
        if not self.t:
            self.points.append(PathPoint(0.0, 0.0, x_dot, y_dot, 0.0, 0.0, 0.0, 0))
        elif not whole:
            old = self.points[-1]
            self.points.append(PathPoint(0.0, 0.0, x_dot, y_dot, 0.0, 0.0, 0.0, old.stretch + 1))
        else:
            old = self.points[-1]
            dt = t - self.t[-1]
            before, after = (
                old.x_dot * old.x_dot + old.y_dot * old.y_dot,
                x_dot * x_dot + y_dot * y_dot,
            )
            power = dt * (before + after + math.sqrt(before * after)) / 3  # integral of speed^2
            square = step_x * step_x + step_y * step_y
            ux, uy = (
                (step_x / math.sqrt(square), step_y / math.sqrt(square))
                if square > 0
                else (1.0, 0.0)
            )
            along, across, floor = self._along * power, self._across * power, self._floor * dt
            self.points.append(
                PathPoint(
                    old.x + step_x,
                    old.y + step_y,
                    x_dot,
                    y_dot,
                    old.qxx + along * ux * ux + across * uy * uy + floor,
                    old.qxy + (along - across) * ux * uy,
                    old.qyy + along * uy * uy + across * ux * ux + floor,
                    old.stretch,
                )
            )
        self.t.append(t)
        if len(self.t) > 2 * self._keep:
            for column in (self.t, self.points, self.readings):
                del column[: self._keep]
