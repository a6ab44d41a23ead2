"""A path on the ground with speeds, kept by arc length, seen in the image.

A path is one run or several. Each run is smooth; between two of them, at a cusp, a robot stands: it turns on the spot
there, or drives on in reverse. Where runs meet there are two samples with the same place, and `theta` and `time` jump.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from math import inf, isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from airground.control.paths.image_path_motion import PathTrajectory
from airground.control.paths.image_path_search import nearest_sample, settle
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, numbers, readonly

if TYPE_CHECKING:
    from airground.control.floor import Floor
    from airground.control.paths.sketch_undrivable import Undrivable

__all__ = ["ImagePath", "PathPoint"]


@dataclass(frozen=True, slots=True, eq=False)
class PathPoint:
    """One point of a path."""

    s: float
    """Arc length [m]; on a closed path within the first lap."""

    uv: FloatArray
    """(2,) [px]. In the image."""

    xy: FloatArray
    """(2,) [m]. On the ground."""

    theta: float
    """Direction of travel in the ground frame [rad]; a robot in reverse heads the other way."""

    curvature: float
    """Of the path on the ground, in the sense of theta [1/m]."""

    speed: float
    """Planned [m/s], along the travel."""

    direction: int
    """1 forwards, -1 in reverse."""


@dataclass(frozen=True, slots=True, eq=False)
class ImagePath:
    """A path to drive, with the speeds planned along it; built by `smooth_sketch` or `path_through`."""

    floor: Floor
    """The ground that it lies on."""

    xy: FloatArray
    """(M, 2) [m]. Ground points, in the coordinates of `floor`."""

    s: FloatArray
    """(M,) [m]. Arc length from the start; the same twice where runs meet."""

    theta: FloatArray
    """(M,) [rad]. Direction of travel, without wraps within a run."""

    curvature: FloatArray
    """(M,) [1/m]. Rate of theta by arc length."""

    speed: FloatArray
    """(M,) [m/s]. Planned, along the travel: never negative."""

    time: FloatArray
    """(M,) [s]. When each sample is passed as planned."""

    wish: FloatArray | None = None
    """(M,) [m/s]. Upper bounds of the speed as asked for, infinite where none is; None for nowhere."""

    breaks: tuple[int, ...] = ()
    """First sample of each run but the first."""

    directions: tuple[int, ...] = (1,)
    """Of each run: 1 forwards, -1 in reverse."""

    closed: bool = False
    """Whether it goes round: the last sample is the first again, passed at speed."""

    max_deviation_px: float = nan
    """Largest distance in the image between drawing and path, either way [px]; NaN where nothing was drawn."""

    rms_deviation_px: float = nan
    """Root mean square of the distances of the drawing from the path [px]."""

    undrivable: tuple[Undrivable, ...] = ()
    """What of the drawing could not become a path."""

    uv: FloatArray = field(init=False)
    """(M, 2) [px]. Image of the points."""

    _rows: tuple[list[float], ...] = field(init=False, repr=False)
    """s, x, y, theta, curvature, speed, cos and sin of theta as plain numbers."""

    def __post_init__(self) -> None:
        s = readonly(self.s, (None,), "s")
        count = len(s)
        if count < 2 or (np.diff(s) < 0).any() or s[0] != 0:
            raise InputError("s must start at 0, have two entries or more and not decrease")
        object.__setattr__(self, "s", s)
        for name in ("theta", "curvature", "speed", "time"):
            object.__setattr__(self, name, readonly(getattr(self, name), (count,), name))
        if self.wish is not None:
            wish = numbers(self.wish, "wish").copy()
            if wish.shape != (count,) or not (wish > 0).all():
                raise InputError(f"wish must hold {count} positive speeds")
            wish.flags.writeable = False
            object.__setattr__(self, "wish", wish)
        object.__setattr__(self, "xy", readonly(self.xy, (count, 2), "xy"))
        if len(self.directions) != len(self.breaks) + 1 or (self.closed and self.breaks):
            raise InputError("directions needs an entry for each run; a closed path is one run")
        object.__setattr__(self, "uv", readonly(self.floor.pixel(self.xy), (count, 2), "uv"))
        arrays = (self.s, *self.xy.T, self.theta, self.curvature, self.speed)
        rows = (*arrays, np.cos(self.theta), np.sin(self.theta))
        object.__setattr__(self, "_rows", tuple(row.tolist() for row in rows))

    def __len__(self) -> int:
        return len(self.s)

    @property
    def length(self) -> float:
        """Of the whole path, or of one lap [m]."""
        return float(self.s[-1])

    @property
    def duration(self) -> float:
        """Of the whole path as planned, turns on the spot too, or of one lap [s]."""
        return float(self.time[-1])

    @property
    def run_ends(self) -> tuple[float, ...]:
        """Arc length at the end of each run [m]."""
        return (*(float(self.s[k]) for k in self.breaks), self.length)

    def at(self, s: float) -> PathPoint:
        """Point at an arc length, on a cusp that of the run that starts there.

        Parameters
        ----------
        s : float [m]
            Arc length; beyond an end it is that end, and on a closed path it goes round.

        Returns
        -------
        point : PathPoint
            The path there.
        """
        s = self.wrapped(s)
        i = self._interval(s)
        x, y, theta, curvature, speed = self._ground(s, i)
        xy = np.array([x, y])
        direction = self.directions[bisect_right(self.breaks, i)]
        return PathPoint(s, self.floor.pixel(xy), xy, theta, curvature, speed, direction)

    def wrapped(self, s: float) -> float:
        """Arc length within the path: modulo a lap on a closed path, else held at the ends.

        Parameters
        ----------
        s : float [m]
            Arc length.

        Returns
        -------
        s : float [m]
            In 0..length.
        """
        length = self._rows[0][-1]
        if self.closed:
            return s % length
        return min(max(s, 0.0), length)

    def _interval(self, s: float) -> int:
        """Index of the sample before s, in the later run where two meet."""
        return min(max(bisect_right(self._rows[0], s) - 1, 0), len(self._rows[0]) - 2)

    def _ground(self, s: float, i: int) -> tuple[float, float, float, float, float]:
        """x, y, theta, curvature and speed at s in the interval after sample i (cubics by Hermite)."""
        rows = self._rows
        s0, h = rows[0][i], rows[0][i + 1] - rows[0][i]
        if h <= 0:
            return rows[1][i], rows[2][i], rows[3][i], rows[4][i], rows[5][i]
        f = (s - s0) / h
        f2 = f * f
        b = f2 * (3 - 2 * f)
        a, c, d = 1 - b, h * f * (1 - f) ** 2, h * f2 * (f - 1)
        x = a * rows[1][i] + b * rows[1][i + 1] + c * rows[6][i] + d * rows[6][i + 1]
        y = a * rows[2][i] + b * rows[2][i + 1] + c * rows[7][i] + d * rows[7][i + 1]
        theta = a * rows[3][i] + b * rows[3][i + 1] + c * rows[4][i] + d * rows[4][i + 1]
        curvature = rows[4][i] + f * (rows[4][i + 1] - rows[4][i])
        square = rows[5][i] ** 2 + f * (rows[5][i + 1] ** 2 - rows[5][i] ** 2)
        return x, y, theta, curvature, float(max(square, 0.0) ** 0.5)

    def nearest(
        self, uv: FloatArray, *, near_s: float | None = None, within_m: float = inf
    ) -> float:
        """Arc length of the point that is nearest on the ground.

        Parameters
        ----------
        uv : (2,) array [px]
            Point of the image.
        near_s : float, optional [m]
            Where on the path it was last: the search follows the path from there, in the same run, as long as that
            comes nearer, so that crossings do not confuse it. Without it the whole path is searched.
        within_m : float [m]
            How far along the path from `near_s` it may be.

        Returns
        -------
        s : float [m]
            Arc length; on a closed path it goes on from `near_s`, past a lap too. NaN where `uv` is not ground.
        """
        x, y = self.floor.position(uv).tolist()
        if isnan(x):
            return nan
        if near_s is None:
            return self._nearest_anywhere(x, y)
        return self._nearest_along(x, y, near_s, within_m)

    def _nearest_anywhere(self, x: float, y: float, slack_m: float = 0.0) -> float:
        """Of all points; of stretches that are nearly as near as the nearest, the earliest."""
        i = nearest_sample(self.xy, x, y, slack_m)
        s = self._rows[0][i]
        return self._nearest_along(x, y, s, inf)

    def _nearest_along(self, x: float, y: float, near_s: float, within_m: float) -> float:
        """Downhill along the run of `near_s`, which is kept where that leads away."""
        start = self.wrapped(near_s)
        lap = near_s - start if self.closed else 0.0
        i = self._interval(start)
        run = bisect_right(self.breaks, i)
        low = self.breaks[run - 1] if run else 0
        high = (self.breaks[run] if run < len(self.breaks) else len(self._rows[0])) - 1
        found = settle(
            self._rows, (x, y), start, i, run=(low, high), within_m=within_m, closed=self.closed
        )
        return lap + found

    def run_of(self, s: float) -> int:
        """Which run an arc length is in; on a cusp, the one that starts there.

        Parameters
        ----------
        s : float [m]
            Arc length.

        Returns
        -------
        run : int
            From 0.
        """
        return bisect_right(self.breaks, self._interval(self.wrapped(s)))

    def planned_speed(self, s: float) -> float:
        """Speed planned at an arc length.

        Parameters
        ----------
        s : float [m]
            Arc length.

        Returns
        -------
        speed : float [m/s]
            Along the travel, never negative.
        """
        s = self.wrapped(s)
        return self._ground(s, self._interval(s))[4]

    def trajectory(self) -> PathTrajectory:
        """The same motion by time, as planned, for what tracks trajectories.

        Returns
        -------
        trajectory : PathTrajectory
            A closed path goes round for ever, at speed from the start.
        """
        return PathTrajectory(self)
