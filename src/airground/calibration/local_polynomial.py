"""Position and velocity from noisy points, by polynomials over a sliding window.

In a window of `count` consecutive rows with times s about their mean, a parabola is fitted by least squares, in the
basis that is orthogonal there::

    p0 = 1,   p1 = s,   p2 = s^2 - (S3/S2) s - S2/S0,      S_k = sum of s^k

(a straight line for fewer than MIN_PARABOLA rows). Image and ground go through the same filter with the
same weights, so that what it smooths away is smoothed away on both sides of eq. 15, which is linear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.calibration.recordings import IntArray
from airground.geometry.arrays import FloatArray

__all__ = ["MIN_PARABOLA", "Windows", "noise_level", "windows"]

MIN_PARABOLA = 5


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Sliding windows over the rows of one target."""

    first: IntArray
    """(W,). First row of each window."""

    count: int
    """Rows in a window."""

    centre: FloatArray
    """(W,) [s]. Mean of the times in a window."""

    span: FloatArray
    """(W,) [s]. Time from its first row to its last."""

    moments: FloatArray
    """(3, W). S2, S3 / S2, and the sum of p2 squared (0 for straight lines)."""

    def fit(
        self, t: FloatArray, y: FloatArray, at: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Position and velocity in each window.

        Parameters
        ----------
        t : (N,) array [s]
            Times of the rows.
        y : (N, 2) array
            Points.
        at : (W,) array, optional [s]
            Where to evaluate; the windows' centres where not given.

        Returns
        -------
        position : (W, 2) array
            Value of the polynomial.
        velocity : (W, 2) array
            Its derivative by time.
        """
        S2, skew, _ = self.moments
        base, b0, b1, b2 = self._coefficients(t, y)
        tau = (np.zeros_like(self.centre) if at is None else at - self.centre)[:, None]
        bent = tau**2 - skew[:, None] * tau - (S2 / self.count)[:, None]
        return base + b0 + b1 * tau + b2 * bent, b1 + b2 * (2 * tau - skew[:, None])

    def velocity_gain(self, at: FloatArray | None = None) -> FloatArray:
        """Standard deviation of the velocity for points that scatter by one.

        Parameters
        ----------
        at : (W,) array, optional [s]
            Where to evaluate; the windows' centres where not given.

        Returns
        -------
        gain : (W,) array [1/s]
            To be multiplied by the noise of a coordinate.
        """
        S2, skew, norm2 = self.moments
        tau = np.zeros_like(self.centre) if at is None else at - self.centre
        return np.asarray(
            np.sqrt(1 / S2 + (2 * tau - skew) ** 2 / np.where(norm2 > 0, norm2, np.inf))
        )

    def scatter(self, t: FloatArray, y: FloatArray) -> FloatArray:
        """How far points lie from the polynomial of their window.

        Parameters
        ----------
        t : (N,) array [s]
            Times of the rows.
        y : (N, 2) array
            Points.

        Returns
        -------
        scatter : (W,) array
            Root of the mean square of a coordinate, with the degrees of freedom that the fit took counted; 0 where
            it took all.
        """
        free = self.count - (3 if self.count >= MIN_PARABOLA else 2)
        squared = np.zeros(len(self.first))
        if free < 1:
            return squared
        S2, skew, _ = self.moments
        base, b0, b1, b2 = self._coefficients(t, y)
        for k in range(self.count):
            s = t[self.first + k] - self.centre
            bent = s**2 - skew * s - S2 / self.count
            off = y[self.first + k] - base - b0 - b1 * s[:, None] - b2 * bent[:, None]
            squared += np.einsum("wi,wi->w", off, off)
        return np.asarray(np.sqrt(squared / (2 * free)))

    def _coefficients(
        self, t: FloatArray, y: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Of 1, p1 and p2, with the first row that they are counted from before them; (W, 2) each."""
        S2, skew, norm2 = self.moments
        S0 = float(self.count)
        base = y[self.first]  # differences from the first row: large coordinates cost no digits
        b0, b1, b2 = np.zeros_like(base), np.zeros_like(base), np.zeros_like(base)
        for k in range(self.count):
            s = t[self.first + k] - self.centre
            dy = y[self.first + k] - base
            b0 += dy
            b1 += s[:, None] * dy
            if self.count >= MIN_PARABOLA:
                b2 += (s**2 - skew * s - S2 / S0)[:, None] * dy
        return base, b0 / S0, b1 / S2[:, None], b2 / np.where(norm2 > 0, norm2, np.inf)[:, None]

    def rows_covered(self, rows: int) -> int:
        """Count the rows that stand in any of the windows.

        Parameters
        ----------
        rows : int
            How many rows there are.

        Returns
        -------
        covered : int
            How many of them are used.
        """
        depth = np.zeros(rows + 1, dtype=np.intp)
        np.add.at(depth, self.first, 1)
        np.add.at(depth, self.first + self.count, -1)
        return int(np.sum(np.cumsum(depth) > 0))

    def take(self, keep: object) -> Windows:
        """Some of the windows.

        Parameters
        ----------
        keep : index
            Slice, integer or boolean array, as NumPy takes it.

        Returns
        -------
        windows : Windows
            Those.
        """
        index = np.arange(len(self.first))[keep]  # type: ignore[call-overload]
        return Windows(
            self.first[index],
            self.count,
            self.centre[index],
            self.span[index],
            self.moments[:, index],
        )


def windows(t: FloatArray, first: IntArray, count: int) -> Windows:
    """Set up windows of `count` rows.

    Parameters
    ----------
    t : (N,) array [s]
        Times, strictly ascending within a window.
    first : (W,) array of int
        First row of each window.
    count : int
        Rows in a window, at least 2.

    Returns
    -------
    windows : Windows
        With their moments.
    """
    offset = np.zeros(len(first))
    for k in range(count):
        offset += t[first + k] - t[first]
    centre = t[first] + offset / count
    S2, S3, S4 = np.zeros((3, len(first)))
    for k in range(count):
        s = t[first + k] - centre
        S2 += s**2
        S3 += s**3
        S4 += s**4
    skew = S3 / S2
    norm2 = S4 - skew * S3 - S2**2 / count if count >= MIN_PARABOLA else np.zeros_like(S2)
    return Windows(
        first, count, centre, t[first + count - 1] - t[first], np.stack([S2, skew, norm2])
    )


def noise_level(uv: FloatArray) -> float:
    """Scatter of a coordinate from row to row, from what three differences leave over.

    Parameters
    ----------
    uv : (N, 2) array [px]
        Consecutive points of one target.

    Returns
    -------
    sigma : float [px]
        Robust standard deviation; NaN for fewer than 8 points. Jerks count as noise, so it errs on the large side.
    """
    if len(uv) < 8:
        return float("nan")
    third = np.diff(uv, n=3, axis=0)
    moved = (
        np.abs(np.diff(uv, axis=0)).sum(axis=1) > 0
    )  # a target that stands tells nothing of whole-pixel noise
    keep = moved[2:] | moved[:-2]
    if not keep.any():
        return 0.0
    squared = np.sort(np.sum(third[keep] ** 2, axis=1))
    # The median of an exponential (two coordinates) is ln 2 times its mean; the mean is 2 * 20 variances.
    return float(np.sqrt(np.median(squared) / np.log(2) / 40))
