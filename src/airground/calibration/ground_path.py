"""Motion readings, integrated to a path on the ground.

The path's origin is arbitrary, and it drifts: use it for displacements over short times only. Between two readings it
is a cubic with the readings' headings as tangents; its length there comes from the odometer where there is one, else
from the speeds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray, Motion

__all__ = ["GroundPath", "ground_path", "reading_noise"]

MAX_GAP = 0.5  # s; readings further apart than this, and than GAP_FACTOR intervals, do not say what lies between
GAP_FACTOR = 5.0
MAX_TURN = np.pi / 2  # a turn of more than this between two readings could have gone either way


@dataclass(frozen=True, slots=True, eq=False)
class GroundPath:
    """Where one target went, up to a constant, piece by piece."""

    t: FloatArray
    """(M,) [s]. Times of the readings."""

    xy: FloatArray
    """(M, 2) [m]. Positions at those times."""

    start: FloatArray
    """(M-1, 2) [m/s]. Velocity at the start of each interval."""

    end: FloatArray
    """(M-1, 2) [m/s]. Velocity at the end of each interval."""

    stretch: IntArray
    """(M-1,). Number of the unbroken stretch that an interval belongs to; -1 for one that cannot be integrated."""

    def at(self, t: FloatArray) -> tuple[FloatArray, IntArray]:
        """Positions at given times, by cubic Hermite interpolation.

        Parameters
        ----------
        t : (N,) array [s]
            Times on the readings' clock.

        Returns
        -------
        xy : (N, 2) array [m]
            Positions; displacements between them are good within one stretch only.
        stretch : (N,) array of int
            Stretch of each; -1 outside the readings and in gaps.
        """
        xy, _, stretch = self.state(t)
        return xy, stretch

    def state(self, t: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
        """Positions and velocities at given times.

        Parameters
        ----------
        t : (N,) array [s]
            Times on the readings' clock.

        Returns
        -------
        xy : (N, 2) array [m]
            Positions, as `at` gives them.
        xy_dot : (N, 2) array [m/s]
            Their derivative.
        stretch : (N,) array of int
            Stretch of each; -1 outside the readings and in gaps.
        """
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 2)
        dt = self.t[k + 1] - self.t[k]
        s = ((t - self.t[k]) / dt)[:, None]
        h = dt[:, None]
        first, last, start, end = self.xy[k], self.xy[k + 1], self.start[k], self.end[k]
        # Cubic Hermite, as what it adds to the straight line between the two readings.
        step = last - first
        bend_0, bend_1 = h * start - step, step - h * end
        xy = first + s * step + s * (1 - s) * ((1 - s) * bend_0 + s * bend_1)
        xy_dot = (step + (1 - s) * (1 - 3 * s) * bend_0 + s * (2 - 3 * s) * bend_1) / h
        inside = (t >= self.t[0]) & (t <= self.t[-1])
        return xy, xy_dot, np.where(inside, self.stretch[k], -1)


def ground_path(motion: Motion, target: str) -> GroundPath | None:
    """Integrate a target's readings.

    Parameters
    ----------
    motion : Motion
        Readings.
    target : str
        Which target.

    Returns
    -------
    path : GroundPath or None
        None for a target with fewer than two readings.
    """
    rows = motion.rows(target)
    t = motion.t[rows]
    if len(t) < 2:
        return None
    dt = np.diff(t)
    good = dt <= max(MAX_GAP, GAP_FACTOR * float(np.median(dt)))
    if motion.xy_dot is not None:
        v = motion.xy_dot[rows]
        start, end = v[:-1], v[1:]
        step = dt[:, None] * (start + end) / 2
    else:
        assert motion.heading is not None
        heading = motion.heading[rows]
        turn = (np.diff(heading) + np.pi) % (2 * np.pi) - np.pi  # readings may wrap
        first, last, along = _lengths(motion, rows, dt)
        good &= np.abs(turn) <= MAX_TURN
        good &= np.isfinite(along)
        along, first, last = (np.where(good, a, 0.0) for a in (along, first, last))
        # A chord of a circular arc is shorter than the arc, by sinc of half the turn.
        middle = heading[:-1] + turn / 2
        step = (along * np.sinc(turn / (2 * np.pi)))[:, None] * _unit(middle)
        start, end = first[:, None] * _unit(heading[:-1]), last[:, None] * _unit(heading[1:])
    step = np.where(good[:, None], step, 0.0)
    xy = np.concatenate([np.zeros((1, 2)), np.cumsum(step, axis=0)])
    stretch = np.where(good, np.cumsum(~good), -1).astype(np.intp)
    return GroundPath(t=t, xy=xy, start=np.asarray(start), end=np.asarray(end), stretch=stretch)


def _unit(heading: FloatArray) -> FloatArray:
    return np.stack([np.cos(heading), np.sin(heading)], axis=-1)


def _lengths(
    motion: Motion, rows: slice, dt: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Speed at start and end of each interval, and the way between; NaN where the odometer jumped."""
    speed = None if motion.speed is None else motion.speed[rows]
    if motion.distance is None:
        assert speed is not None
        return speed[:-1], speed[1:], dt * (speed[:-1] + speed[1:]) / 2
    along = np.diff(motion.distance[rows])
    mean = along / dt
    # An odometer that starts again, or skips, makes a step that no vehicle makes.
    usual = float(np.quantile(np.abs(mean), 0.95))
    along = np.where(np.abs(mean) > 10 * usual + 1e-9, np.nan, along)
    if speed is not None and not (along < 0).any():
        # An odometer that only counts up cannot tell reverse; the signed speed can.
        along = np.where(speed[:-1] + speed[1:] < 0, -along, along)
    mean = along / dt
    return mean, mean, along


def reading_noise(path: GroundPath) -> float:
    """Scatter of the velocity from one reading to the next, relative to the usual speed.

    Parameters
    ----------
    path : GroundPath
        Integrated readings.

    Returns
    -------
    noise : float
        Standard deviation of what is not smooth, over the median speed while moving; 0 if it cannot be told.
    """
    speed = np.linalg.norm(path.start, axis=1)
    moving = speed > 0.1 * float(speed.max(initial=0.0))
    if len(speed) < 8 or not moving.any():
        return 0.0
    third = np.diff(path.start, n=3, axis=0)  # of white noise: variance 20 times as large
    keep = moving[3:] & moving[:-3]
    if not keep.any():
        return 0.0
    return float(np.sqrt(np.mean(third[keep] ** 2) / 20) / np.median(speed[moving]))
