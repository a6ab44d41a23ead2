"""A path as a motion by time: what is planned, at any moment."""

from __future__ import annotations

from bisect import bisect_right
from math import cos, inf, sin
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.control.paths.image_path import ImagePath
    from airground.geometry.arrays import FloatArray

__all__ = ["PathTrajectory"]


class PathTrajectory:
    """The motion that a path plans; an `ImageTrajectory`.

    Its acceleration along the path is constant between samples. It stands while the robot turns on the spot.

    Parameters
    ----------
    path : ImagePath
        What it moves along.
    """

    __slots__ = ("_path", "_s", "_speed", "_time")

    def __init__(self, path: ImagePath) -> None:
        self._path = path
        self._s: list[float] = path.s.tolist()
        self._speed: list[float] = path.speed.tolist()
        self._time: list[float] = path.time.tolist()

    @property
    def duration(self) -> float:
        """Of the motion [s]; infinite on a closed path."""
        return inf if self._path.closed else self._time[-1]

    def at(self, t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Where it is.

        Parameters
        ----------
        t : float [s]
            Since its start; before it and after the end it stands there.

        Returns
        -------
        uv : (2,) array [px]
            Point.
        uv_dot : (2,) array [px/s]
            Its velocity.
        uv_ddot : (2,) array [px/s^2]
            Its acceleration.
        """
        s, v, a = self.along(t)
        point = self._path.at(s)
        J = self._path.floor.jacobian(point.uv)
        c, d = cos(point.theta), sin(point.theta)
        uv_dot = J @ np.array([v * c, v * d])
        turn = v * v * point.curvature
        uv_ddot = J @ np.array([a * c - turn * d, a * d + turn * c])
        if v != 0:
            J_dot = self._path.floor.jacobian_rate(point.uv, uv_dot)
            uv_ddot = uv_ddot + J_dot @ np.array([v * c, v * d])
        return point.uv, uv_dot, uv_ddot

    def along(self, t: float) -> tuple[float, float, float]:
        """Progress along the path.

        Parameters
        ----------
        t : float [s]
            Since the start.

        Returns
        -------
        s : float [m]
            Arc length, within the first lap.
        v : float [m/s]
            Speed.
        a : float [m/s^2]
            Its rate.
        """
        time = self._time
        if self._path.closed:
            t %= time[-1]
        elif not 0 <= t < time[-1]:
            return (0.0 if t < 0 else self._s[-1]), 0.0, 0.0
        i = min(bisect_right(time, t) - 1, len(time) - 2)
        h, into = self._s[i + 1] - self._s[i], t - time[i]
        if h <= 0:  # a turn on the spot
            return self._s[i], 0.0, 0.0
        v0 = self._speed[i]
        a = (self._speed[i + 1] ** 2 - v0**2) / (2 * h)
        return self._s[i] + into * (v0 + a * into / 2), v0 + a * into, a
