"""The past of what runs for days: only its last seconds are kept."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from math import cos, sin
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.vehicle_history import GRID_S, History, SlowNoise

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["KEPT_S", "REST", "ShortHistory", "ShortNoise"]

Motion = tuple[float, ...]

KEPT_S = 12.0
"""Longer than any picture or reading of the embedded world may be on its way [s]."""

REST: Motion = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Neither the vehicle nor its wheels move."""

TINY_RAD = 1e-9
FAR = 1200  # grid points of slow noise, 60 s, after which nothing is left of a value


class ShortHistory(History):
    """A history that forgets, and that one thread may ask while another drives on.

    It asks and drives a few rows at a time, for which plain numbers are ten times quicker than arrays.

    Parameters
    ----------
    t : float [s]
        Of the first row.
    xy : (2,) array [m]
        Where it starts.
    theta : float [rad]
        Heading there.
    """

    def __init__(self, t: float, xy: FloatArray, theta: float) -> None:
        self._lock = Lock()
        self._times = [float(t)]
        self._places = [(float(xy[0]), float(xy[1]), float(theta))]
        self._motions: list[Motion] = []  # one less: the newest row has none of its own yet
        self._forgotten = False

    @property
    def rows(self) -> FloatArray:
        """(N, 10). The newest row, and the one before it where there is one; as of `History.rows`."""
        with self._lock:
            motions = [*self._motions[-1:], REST]
            places = list(zip(self._times[-2:], self._places[-2:], strict=True))
        return np.array([(t, *at, *go) for (t, at), go in zip(places, motions, strict=True)])

    @property
    def newest(self) -> tuple[float, float, float]:
        """Position [m] and heading [rad] now."""
        return self._places[-1]

    def drive(self, t: Sequence[float], motion: Sequence[tuple[float, ...]]) -> None:
        """Go on, and forget what is older than twice `KEPT_S`.

        Parameters
        ----------
        t : (K,) sequence of float [s]
            Ends of the steps.
        motion : (K, 6) sequence
            As for `History.drive`.
        """
        with self._lock:
            for end, moved in zip(t, motion, strict=True):
                self._places.append(_after(self._places[-1], moved, end - self._times[-1]))
                self._times.append(end)
                self._motions.append(moved)
            if self._times[-1] - self._times[0] > 2 * KEPT_S:
                first = max(bisect_left(self._times, self._times[-1] - KEPT_S) - 1, 0)
                for rows in (self._times, self._places, self._motions):
                    del rows[:first]
                self._forgotten = True

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Pose and motion at times within what is kept; before the start, at rest.

        Parameters
        ----------
        t : (N,) array [s]
            Times.

        Returns
        -------
        xy : (N, 2) array [m]
            Positions.
        theta : (N,) array [rad]
            Headings; they do not wrap.
        motion : (N, 6) array
            As of `History.at`.

        Raises
        ------
        InputError
            If a time has been forgotten.
        """
        with self._lock:
            found = [self._at(when) for when in t.tolist()]
        places = np.array([place for place, _ in found]).reshape(-1, 3)
        motions = np.array([motion for _, motion in found]).reshape(-1, 6)
        return places[:, :2], places[:, 2], motions

    def _at(self, t: float) -> tuple[tuple[float, float, float], Motion]:
        k = bisect_right(self._times, t) - 1
        if k < 0:
            if self._forgotten:
                raise InputError(
                    f"what was at {t:.3f} s is forgotten; ask from {self._times[0]:.3f} s on"
                )
            return self._places[0], REST
        if not self._motions:
            return self._places[0], REST
        motion = self._motions[min(k, len(self._motions) - 1)]
        if k == len(self._motions):
            return self._places[k], motion
        return _after(self._places[k], motion, t - self._times[k]), motion


def _after(
    place: tuple[float, float, float], motion: Motion, dt: float
) -> tuple[float, float, float]:
    """Drive an arc: along its chord, which is as long as the arc but for a sine."""
    x, y, theta = place
    v, omega, lateral = motion[:3]
    half = omega * dt / 2
    way = dt * (sin(half) / half if abs(half) > TINY_RAD else 1.0)
    c, s = cos(theta + half), sin(theta + half)
    return x + way * (v * c - lateral * s), y + way * (v * s + lateral * c), theta + 2 * half


class ShortNoise(SlowNoise):
    """Slow noise that forgets: times may be asked for again for some seconds only."""

    def at(self, t: float) -> float:
        """Read it.

        Parameters
        ----------
        t : float [s]
            When; not long before the newest time asked for.

        Returns
        -------
        value : float
            Interpolated on a grid of 50 ms.
        """
        if (t - self._start) / GRID_S > len(self._values) + FAR:
            self._start, self._values = t, [float(self._rng.normal())]
        value = super().at(t)
        if len(self._values) > 2 * FAR:
            gone = len(self._values) - FAR
            self._values = self._values[gone:]
            self._start += gone * GRID_S
        return value
