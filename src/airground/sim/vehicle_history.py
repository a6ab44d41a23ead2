"""Where a simulated vehicle has been, and noise that changes slowly, whenever one asks."""

from __future__ import annotations

from math import exp, sqrt
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.sim.unicycle import arc

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["History", "SlowNoise"]

COLUMNS = 10  # t x y theta, v omega lateral on the ground, v omega lateral of the wheels
GRID_S = 0.05  # of slow noise


class History:
    """Rows of steady motion, one after the other; between two of them the vehicle drives an arc.

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
        self._rows = np.zeros((1024, COLUMNS))
        self._rows[0, :4] = t, xy[0], xy[1], theta
        self._count = 1

    @property
    def rows(self) -> FloatArray:
        """(N, 10). Time, x, y, heading; from there on speed, turn rate, sideways speed, and the same of the wheels."""
        return self._rows[: self._count]

    def drive(self, t: Sequence[float], motion: Sequence[tuple[float, ...]]) -> None:
        """Go on: the newest row gets its motion, and each further time gets a row.

        Parameters
        ----------
        t : (K,) sequence of float [s]
            Ends of the steps.
        motion : (K, 6) sequence
            Speed, turn rate and sideways speed on the ground, then by the wheels, steady in each step.
        """
        last, count = self._count - 1, len(t)
        while self._count + count > len(self._rows):
            self._rows = np.concatenate([self._rows, np.zeros_like(self._rows)])
        new = self._rows[last : last + count + 1]
        new[1:, 0] = t
        new[:-1, 4:] = motion
        new[1:, 3] = new[0, 3] + np.cumsum(new[:-1, 5] * np.diff(new[:, 0]))
        new[1:, 1:3] = new[0, 1:3] + np.cumsum(_chord(new[:-1], np.diff(new[:, 0])), axis=0)
        self._count += count

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Pose and motion at times within the history; before it, at rest at its start.

        Parameters
        ----------
        t : (N,) array [s]
            Times, none later than the newest row.

        Returns
        -------
        xy : (N, 2) array [m]
            Positions.
        theta : (N,) array [rad]
            Headings; they do not wrap.
        motion : (N, 6) array
            Speed, turn rate and sideways speed on the ground, then by the wheels.
        """
        rows = self.rows
        before = np.searchsorted(rows[:, 0], t, side="right") - 1
        since = np.where(before < 0, 0.0, t - rows[np.maximum(before, 0), 0])
        start = rows[np.maximum(before, 0)]
        # The newest row has no motion of its own yet: that of the step that led to it.
        steady = rows[np.clip(before, 0, max(len(rows) - 2, 0)), 4:] * (before >= 0)[:, None]
        return (
            start[:, 1:3] + _chord(start, since),
            start[:, 3] + start[:, 5] * since,
            steady,
        )


def _chord(rows: FloatArray, dt: FloatArray) -> FloatArray:
    theta, v, omega, lateral = rows[:, 3], rows[:, 4], rows[:, 5], rows[:, 6]
    along = arc(theta, v, omega, dt)
    if not lateral.any():
        return along
    return np.asarray(along + arc(theta + np.pi / 2, lateral, omega, dt))


class SlowNoise:
    """Noise of unit variance that forgets with a time constant; the same whenever and however often one asks.

    Parameters
    ----------
    rng : Generator
        Its own: nothing else may draw from it.
    correlation_s : float [s]
        Time constant.
    start : float [s]
        Times before it read as this one.
    """

    def __init__(self, rng: np.random.Generator, correlation_s: float, start: float) -> None:
        self._rng = rng
        self._keep = exp(-GRID_S / correlation_s)
        self._start = start
        self._values = [float(rng.normal())]

    def at(self, t: float) -> float:
        """Read it.

        Parameters
        ----------
        t : float [s]
            When.

        Returns
        -------
        value : float
            Interpolated on a grid of 50 ms.
        """
        place = max(t - self._start, 0.0) / GRID_S
        k = int(place)
        while len(self._values) < k + 2:
            kick = sqrt(1 - self._keep**2) * float(self._rng.normal())
            self._values.append(self._keep * self._values[-1] + kick)
        share = place - k
        return (1 - share) * self._values[k] + share * self._values[k + 1]
