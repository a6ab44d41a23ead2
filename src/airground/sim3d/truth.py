"""Where a vehicle really was; for tests and studies, never for what calibrates or drives."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray

__all__ = ["Truth3d", "TruthLog"]

KEPT_S = 60.0


@dataclass(frozen=True, slots=True, eq=False)
class Truth3d:
    """A vehicle at one time."""

    t: float
    """When [s]."""

    xy: FloatArray
    """(2,) [m]. Of the tag's middle, in the world's frame."""

    theta: float
    """Heading [rad], counter-clockwise from x; does not wrap."""

    v: float
    """Speed of the axle's middle along the heading, over the floor [m/s]."""

    omega: float
    """Rate of the heading [rad/s]."""


class TruthLog:
    """The last minute of a vehicle.

    Parameters
    ----------
    rate_hz : float
        How often it is noted.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rows: deque[tuple[float, ...]] = deque(maxlen=round(KEPT_S * rate_hz))
        self._table: FloatArray | None = None

    @property
    def pose(self) -> tuple[float, float, float]:
        """Of the axle, lately: x [m], y [m], heading [rad]."""
        _, _, _, x, y, theta = self._rows[-1]
        return x, y, theta

    def note(self, t: float, tag: FloatArray, axle: FloatArray, theta: float) -> None:
        """Take the next pose.

        Parameters
        ----------
        t : float [s]
            When.
        tag : (2,) array [m]
            The tag's middle.
        axle : (2,) array [m]
            The axle's middle.
        theta : float [rad]
            Heading, of any number of turns.
        """
        if self._rows:
            last = self._rows[-1][-1]
            theta = last + float(np.angle(np.exp(1j * (theta - last))))
        self._rows.append((t, *tag.tolist(), *axle.tolist(), theta))
        self._table = None

    def at(self, t: float) -> Truth3d:
        """Tell where it was.

        Parameters
        ----------
        t : float [s]
            When.

        Returns
        -------
        truth : Truth3d
            Between two notes on a straight line.

        Raises
        ------
        InputError
            If that is forgotten or to come.
        """
        if self._table is None:
            self._table = np.array(self._rows)
        table = self._table
        if not table[0, 0] - 1e-9 <= t <= table[-1, 0] + 1e-9:
            raise InputError(
                f"the truth is known from {table[0, 0]:.2f} s to {table[-1, 0]:.2f} s, not at {t} s"
            )
        row = [float(np.interp(t, table[:, 0], column)) for column in table.T]
        k = int(np.clip(np.searchsorted(table[:, 0], t), 1, max(len(table) - 1, 1)))
        v = omega = 0.0
        if len(table) > 1:
            dt, _, _, dx, dy, turn = (table[k] - table[k - 1]).tolist()
            v = (dx * np.cos(row[5]) + dy * np.sin(row[5])) / dt
            omega = turn / dt
        return Truth3d(float(t), np.array(row[1:3]), row[5], float(v), float(omega))
