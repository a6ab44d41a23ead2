"""A path as a motion by time: what is planned, at any moment."""

from __future__ import annotations

from bisect import bisect_right
from math import cos, inf, sin
from typing import TYPE_CHECKING

import numpy as np

from airground.control.image_law import ImageLaw

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

    __slots__ = ("_image", "_path", "_s", "_speed", "_time")

    def __init__(self, path: ImagePath) -> None:
        self._path = path
        self._s: list[float] = path.s.tolist()
        self._speed: list[float] = path.speed.tolist()
        self._time: list[float] = path.time.tolist()
        self._image = ImageLaw(path.floor)

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
        u, w = point.uv.tolist()
        c, d = cos(point.theta), sin(point.theta)
        turn = v * v * point.curvature
        uv_dot = self._image.to_image(u, w, v * c, v * d)
        pull = self._image.to_image(u, w, a * c - turn * d, a * d + turn * c)
        bend = self._image.bend((u, w), uv_dot, (v * c, v * d))
        return point.uv, np.array(uv_dot), np.array([pull[0] + bend[0], pull[1] + bend[1]])

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
