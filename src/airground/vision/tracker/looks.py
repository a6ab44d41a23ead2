"""What a track looks like: its heading in the image and its size, as evidence of who is who."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np

from airground.vision.tracker.beliefs import NODES, WEIGHTS

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.sightings import Sightings

__all__ = ["Looks", "log_sizes", "wrap"]

TURN_RATE = 2.0  # usual rate of turn [rad/s]
TURN_S = 0.5  # how long a turn lasts [s], as the time constant of its correlation
LEAST_SIGMA = 1e-4  # a heading is never known better than this [rad]
SIZE_SIGMA = 0.3  # of the logarithm of a size, before it is learned
SIZE_DRIFT = 0.1  # of the same, in a second
SIZE_RANGE = 4.0  # range of the logarithms of clutter's sizes
LOG_RANGE, LOG_2PI = float(np.log(SIZE_RANGE)), float(np.log(2 * np.pi))
WORST = -6.0  # a heading may flip and an outline fail: evidence against is worth no more


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """Headings and sizes of R tracks; NaN where never seen."""

    angle: FloatArray
    """(R, 2) [rad, rad/s]. Heading in the image and its rate."""

    spread: FloatArray
    """(R, 3). Variances of heading and rate, and their covariance, in the order hh, hr, rr."""

    size: FloatArray
    """(R, 2). Logarithm of the size [px], and its variance."""

    scatter: FloatArray
    """(R,). Variance of a sighting's logarithm of size."""

    @classmethod
    def begin(cls, sightings: Sightings) -> Self:
        """Looks of things seen once.

        Parameters
        ----------
        sightings : Sightings
            What was seen of each.

        Returns
        -------
        looks : Looks
            One for each.
        """
        n = len(sightings)
        angle, spread, size = np.zeros((n, 2)), np.zeros((n, 3)), np.empty((n, 2))
        variance = _variance(sightings)
        seen = ~np.isnan(sightings.angle + variance)
        angle[:, 0] = np.where(seen, sightings.angle, np.nan)
        spread[:, 0] = np.where(seen, variance, 0.0)
        spread[:, 2] = TURN_RATE**2
        size[:, 0], size[:, 1] = _log_sizes_of(sightings), SIZE_SIGMA**2
        return cls(angle, spread, size, np.full(n, SIZE_SIGMA**2))

    def take(self, rows: IntArray) -> Self:
        """Some of the tracks.

        Parameters
        ----------
        rows : (K,) array of int
            Which.

        Returns
        -------
        looks : Looks
            Theirs.
        """
        return type(self)(self.angle[rows], self.spread[rows], self.size[rows], self.scatter[rows])

    def join(self, other: Looks) -> Self:
        """Append tracks.

        Parameters
        ----------
        other : Looks
            What to append.

        Returns
        -------
        looks : Looks
            These, then those.
        """
        return type(self)(
            np.concatenate([self.angle, other.angle]),
            np.concatenate([self.spread, other.spread]),
            np.concatenate([self.size, other.size]),
            np.concatenate([self.scatter, other.scatter]),
        )

    def predict(self, dt: float) -> Self:
        """Looks some time later.

        Parameters
        ----------
        dt : float [s]
            How much later.

        Returns
        -------
        looks : Looks
            Then; a rate of turn fades.
        """
        if dt == 0 or len(self.angle) == 0:
            return self
        # The rate forgets itself (Ornstein and Uhlenbeck): bounded, and sound, however long the step.
        gone = float(np.expm1(-dt / TURN_S))
        keep, reach = 1 + gone, -TURN_S * gone
        ago = 0.5 * dt * (NODES + 1)
        turned = -TURN_S * np.expm1(-ago / TURN_S)
        kicks = np.array([turned, 1 - turned / TURN_S])
        noise = (kicks * (dt * WEIGHTS / TURN_S * TURN_RATE**2)) @ kicks.T
        step = np.array(
            [[1, 2 * reach, reach**2], [0, keep, keep * reach], [0, 0, keep**2]]  # of hh, hr, rr
        )
        spread = self.spread @ step.T
        spread += noise[[0, 0, 1], [0, 1, 1]]
        angle = np.empty_like(self.angle)
        angle[:, 0] = self.angle[:, 0] + reach * self.angle[:, 1]
        angle[:, 1] = keep * self.angle[:, 1]
        size = self.size.copy()
        size[:, 1] += SIZE_DRIFT**2 * dt
        return type(self)(angle, spread, size, self.scatter)

    def evidence(self, tracks: IntArray, sightings: Sightings, columns: IntArray) -> FloatArray:
        """How much likelier sightings look as tracks do than as clutter does.

        Parameters
        ----------
        tracks : (P,) array of int
            Tracks of pairs.
        sightings : Sightings
            All of a frame.
        columns : (P,) array of int
            Sightings of the pairs.

        Returns
        -------
        log_ratio : (P,) array
            Logarithm of the ratio; zero where nothing is known.
        """
        off = wrap(sightings.angle[columns] - self.angle[tracks, 0])
        variance = self.spread[tracks, 0] + _variance(sightings)[columns]
        heading = _log_normal(off, np.minimum(variance, 3.0)) + LOG_2PI
        off = _log_sizes_of(sightings)[columns] - self.size[tracks, 0]
        size = _log_normal(off, self.size[tracks, 1] + self.scatter[tracks]) + LOG_RANGE
        parts = np.maximum(np.array([heading, size]), WORST)
        parts[np.isnan(parts)] = 0.0
        log_ratio: FloatArray = parts[0] + parts[1]
        return log_ratio

    def update(self, tracks: IntArray, sightings: Sightings, columns: IntArray) -> Self:
        """Looks after sightings.

        Parameters
        ----------
        tracks : (P,) array of int
            Tracks that were seen, each once.
        sightings : Sightings
            All of a frame.
        columns : (P,) array of int
            Theirs.

        Returns
        -------
        looks : Looks
            All of them, with what was seen.
        """
        if len(tracks) == 0:
            return self
        fresh = type(self).begin(sightings).take(columns)
        angle, spread = self.angle.copy(), self.spread.copy()
        size, scatter = self.size.copy(), self.scatter.copy()

        first = np.isnan(angle[tracks, 0])
        if first.any():
            angle[tracks[first]], spread[tracks[first]] = fresh.angle[first], fresh.spread[first]
        more = ~first & ~np.isnan(fresh.angle[:, 0])
        rows, noise = tracks[more], fresh.spread[more, 0]
        hh, hr, rr = spread[rows].T
        off = wrap(fresh.angle[more, 0] - angle[rows, 0])
        gain, slope = hh / (hh + noise), hr / (hh + noise)
        angle[rows, 0] = wrap(angle[rows, 0] + gain * off)
        angle[rows, 1] += slope * off
        spread[rows] = np.array([gain * noise, hr * (1 - gain), rr - slope * hr]).T

        first = np.isnan(size[tracks, 0])
        if first.any():
            size[tracks[first]] = fresh.size[first]
        more = ~first & ~np.isnan(fresh.size[:, 0])
        rows = tracks[more]
        before, loose = size[rows], scatter[rows]
        off = fresh.size[more, 0] - before[:, 0]
        part = before[:, 1] / (before[:, 1] + loose)
        before[:, 0] += part * off
        before[:, 1] *= 1 - part
        size[rows] = before
        scatter[rows] = np.minimum(np.maximum(0.95 * loose + 0.05 * off**2, 0.05**2), 0.5**2)
        return type(self)(angle, spread, size, scatter)


def _variance(sightings: Sightings) -> FloatArray:
    """Of headings; NaN where there is none."""
    variance: FloatArray = np.maximum(sightings.angle_sigma, LEAST_SIGMA) ** 2
    return variance


@lru_cache(maxsize=2)  # asked for several times of each frame
def _log_sizes_of(sightings: Sightings) -> FloatArray:
    return log_sizes(sightings.outline)


def log_sizes(outline: FloatArray) -> FloatArray:
    """Logarithms of the roots of the areas of what was seen.

    Parameters
    ----------
    outline : (N, 4, 2) array [px]
        Corners; NaN where unknown.

    Returns
    -------
    log_size : (N,) array
        Of pixels; NaN where the outline is unknown or has no area.
    """
    if np.isnan(outline[:, 0, 0]).all():
        return np.full(len(outline), np.nan)
    one, other = (outline[:, :2] - outline[:, 2:]).swapaxes(0, 1)  # the diagonals
    area = 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    root: FloatArray = 0.5 * np.log(np.where(area > 0, area, np.nan))
    return root


def wrap(angle: FloatArray) -> FloatArray:
    """Bring angles into -pi..pi.

    Parameters
    ----------
    angle : (...) array [rad]
        Any.

    Returns
    -------
    angle : (...) array [rad]
        The same directions.
    """
    wrapped: FloatArray = (angle + np.pi) % (2 * np.pi) - np.pi
    return wrapped


def _log_normal(off: FloatArray, variance: FloatArray) -> FloatArray:
    log: FloatArray = -0.5 * (off * off / variance + np.log(variance) + LOG_2PI)
    return log
