"""Samples as rows of features: what hypotheses cost on them, and the fit to inliers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.cubic_form import (
    FEATURES,
    coefficient_gradient,
    coefficients,
    features,
    horizons,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.calibration.ransac import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["THRESHOLD", "MotionTable", "motion_table"]

THRESHOLD = 9.2103
"""Squared residual, in sigma, above which a sample is an outlier: 99 % of chi-square of 2 degrees of freedom."""

_PLACE = FEATURES + 2
"""Row of u."""

_SIDED = 64
"""Hypotheses up to which it is also asked whether all their inliers are on one side of the horizon."""

_BLOCK = 1000
"""Samples in a block. All matrix products stay so small that BLAS starts no threads: waking them takes longer."""

_WIDER = (4.0,)
"""Thresholds of the rounds of a first fit, over `THRESHOLD`: a start from few samples is off by more than the noise."""

_WIDER_OF_FEW = (9.0, 3.0, 1.0, 1.0)
"""The same for tables of few samples."""

_FEW = 300
"""Samples below which a table is one of few: each inlier that is lost on the way counts."""

_ROUNDS = 10
"""Of the last fit, at most."""

_GAIN = 0.98
"""A round of the last fit that lowers the cost by less than to this share is followed by none."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionTable:
    """Features and image velocities of samples, both over the noise; see `cubic_form`."""

    rows: FloatArray
    """(B, 16, n). Blocks of n samples: twelve features, two components, and u and v as they are; zeros fill up the last
    block."""

    count: int
    """Samples."""

    def take(self, rows: IntArray) -> MotionTable:
        """Some of the samples.

        Parameters
        ----------
        rows : (n,) array of int
            Which; they become one block.

        Returns
        -------
        table : MotionTable
            Those samples.
        """
        blocks, width, _ = self.rows.shape
        flat = self.rows[0] if blocks == 1 else self.rows.transpose(1, 0, 2).reshape(width, -1)
        return MotionTable(flat.take(rows, axis=1)[None], len(rows))

    def squares(self, models: FloatArray) -> FloatArray:
        """Squared residuals of eq. 15, in sigma; chi-square of two degrees of freedom for inliers.

        Parameters
        ----------
        models : (H, 6) array
            Hypotheses, in the table's units.

        Returns
        -------
        squares : (B, H, n) array
            Zero for what fills up; NaN where a hypothesis is NaN.
        """
        return self._squares(coefficients(models))

    def costs(self, models: FloatArray) -> FloatArray:
        """Truncated squares of the residuals over the threshold; see `ransac.Evidence`.

        Parameters
        ----------
        models : (H, 6) array
            Hypotheses.

        Returns
        -------
        costs : (H,) array
            0 is perfect, 1 without any inlier.
        """
        squares = self.squares(models)
        if len(models) <= _SIDED:
            squares = self._sided(models, squares)
        np.fmin(squares, THRESHOLD, out=squares)
        ones = np.full(squares.shape[2], 1 / (THRESHOLD * self.count))
        return np.asarray((squares @ ones).sum(axis=0))  # .sum(axis=2) takes twice as long

    def refine(self, models: FloatArray) -> FloatArray:
        """Bring models nearer to their inliers: steps of Gauss-Newton on the moments of the features.

        Parameters
        ----------
        models : (H, 6) array
            Starts.

        Returns
        -------
        models : (H, 6) array
            NaN where the inliers do not determine a model at all.
        """
        for wider in _WIDER if self.count >= _FEW else _WIDER_OF_FEW:
            D = coefficient_gradient(models)
            squares = self._squares(_coefficients(D, models))
            models = _step(models, D, self._moments(squares <= wider * THRESHOLD))[0]
        return models

    def finish(self, model: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Fit a model that is nearly right to its inliers, to the last digit.

        Parameters
        ----------
        model : (6,) array
            Start.

        Returns
        -------
        model : (6,) array
            Least squares over the inliers; NaN if they do not determine it.
        squares : (N,) array
            Its squared residuals, in sigma; infinite for what would be beyond the horizon.
        information : (6, 6) array
            Inverse covariance of the model, in the table's units.
        """
        fit, cost = model[None], math.inf
        for rounds in range(_ROUNDS + 1):
            D = coefficient_gradient(fit)
            residual = self._residuals(_coefficients(D, fit))
            squares = _sum_of_squares(residual)
            last, cost = cost, float(np.fmin(squares, THRESHOLD).sum())
            if rounds == _ROUNDS or (rounds and not cost < _GAIN * last):
                break
            fit, normal = _step(fit, D, self._moments(squares <= THRESHOLD))
        # Moments lose half the digits of an exact fit, and the inliers change: the last step takes the residuals.
        residual *= (squares <= THRESHOLD)[:, :, None]
        by_feature = (residual[:, 0] @ self.rows[:, :FEATURES].transpose(0, 2, 1)).sum(axis=0)
        fit = fit - _solved(normal, D @ by_feature.reshape(1, -1, 1))[..., 0]
        # For one model this is quicker than `coefficients`.
        K = _coefficients(coefficient_gradient(fit), fit)
        squares = self._sided(fit, self._squares(K))
        return fit[0], squares.ravel()[: self.count], normal[0]

    def _residuals(self, K: FloatArray) -> FloatArray:
        """(B, H, 2, n)."""
        blocks, _, n = self.rows.shape
        residual: FloatArray = (K.reshape(-1, FEATURES) @ self.rows[:, :FEATURES]).reshape(
            blocks, -1, 2, n
        )
        residual -= self.rows[:, None, FEATURES:_PLACE]
        return residual

    def _squares(self, K: FloatArray) -> FloatArray:
        """(B, H, n). One component after the other, as fresh memory costs more than calls."""
        features = self.rows[:, :FEATURES]
        squares: FloatArray = K[:, :FEATURES] @ features
        squares -= self.rows[:, FEATURES, None]
        squares *= squares
        v = K[:, FEATURES:] @ features
        v -= self.rows[:, FEATURES + 1, None]
        v *= v
        squares += v
        return squares

    def _sided(self, models: FloatArray, squares: FloatArray) -> FloatArray:
        """Squares (B, H, n), but infinite where n.c has not the sign that it has for most inliers."""
        n = horizons(models)
        nc = n[:, :2] @ self.rows[:, _PLACE:]
        nc += n[:, 2:]
        if (nc.min(axis=(0, 2)) * nc.max(axis=(0, 2)) > 0).all():
            return squares  # all samples are on one side
        sense = (np.sign(nc) * (squares <= THRESHOLD)).sum(axis=(0, 2))
        nc *= np.sign(sense)[:, None]
        squares[nc < 0] = np.inf
        return squares

    def _moments(self, inlier: NDArray[np.bool_]) -> FloatArray:
        """(H, 14, 14): products of all rows, summed over inliers, which come as (B, H, n)."""
        total: FloatArray | float = 0.0
        for block, rows in enumerate(self.rows[:, :_PLACE]):  # block by block it stays in the cache
            # Numbers by booleans take twice as long. A matrix by its own transpose takes half as long as by another.
            chosen = rows * inlier[block, :, None].astype(np.float64)
            total = total + chosen @ chosen.transpose(0, 2, 1)
        return np.asarray(total)


def motion_table(columns: FloatArray, weight: FloatArray | float) -> MotionTable:
    """Fill a table.

    Parameters
    ----------
    columns : (6, n) array
        Image points, image velocities and ground velocities, normalised.
    weight : (n,) array or float
        Inverse deviation of the image velocities.

    Returns
    -------
    table : MotionTable
        Of all n samples.
    """
    count = columns.shape[1]
    blocks = max(1, math.ceil(count / _BLOCK))
    size = math.ceil(count / blocks)
    by = np.asarray(weight)
    if blocks * size > count:
        fill = (0, blocks * size - count)
        columns = np.pad(columns, ((0, 0), fill))
        by = np.pad(by, fill) if by.ndim else by
    place, image, ground = columns.reshape(3, 2, blocks, size).swapaxes(1, 2)
    by = by.reshape(blocks, 1, size) if by.ndim else by
    rows = np.empty((blocks, _PLACE + 2, size))
    np.multiply(ground, by, out=rows[:, :2])
    np.multiply(image, by, out=rows[:, FEATURES:_PLACE])
    rows[:, _PLACE:] = place
    features(place[:, 0], place[:, 1], rows)
    return MotionTable(rows, count)


def _sum_of_squares(residual: FloatArray) -> FloatArray:
    """(B, H, n) from (B, H, 2, n)."""
    u, v = residual[:, :, 0], residual[:, :, 1]
    squares: FloatArray = u * u
    squares += v * v
    return squares


def _coefficients(D: FloatArray, models: FloatArray) -> FloatArray:
    """Coefficients from their derivative D, by Euler's theorem for cubic forms."""
    return np.asarray((models[:, None] @ D)[:, 0] / 3)


def _step(models: FloatArray, D: FloatArray, moments: FloatArray) -> tuple[FloatArray, FloatArray]:
    """One Gauss-Newton step, and its normal matrix.

    With coefficients K(g), cubic, and their derivative D, the step is ``(D M D^T)^-1 D (M K - m)`` for moments M and m.
    As D^T g = 3 K, the new g is ``2/3 g + (D M D^T)^-1 D m``.
    """
    H = len(models)
    M = moments[:, :FEATURES, :FEATURES]
    m = moments[:, FEATURES:, :FEATURES].reshape(H, 2 * FEATURES, 1)
    DM = (D.reshape(H, 12, FEATURES) @ M).reshape(H, 6, 2 * FEATURES)
    normal = DM @ D.transpose(0, 2, 1)
    # A trace of damping, or what the inliers do not determine would be singular.
    diagonal = normal.reshape(H, 36)[:, ::7]
    diagonal *= 1 + 1e-13
    diagonal += 1e-300
    return 2 / 3 * models + _solved(normal, D @ m)[..., 0], normal


def _solved(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions (H, 6, 1) of H systems; NaN for singular ones, for which np.linalg.solve raises."""
    try:
        return np.asarray(np.linalg.solve(matrices, right))
    except np.linalg.LinAlgError:
        singular = np.linalg.det(matrices) == 0
        matrices = np.where(singular[:, None, None], np.nan, matrices)
        return np.asarray(np.linalg.solve(matrices, right))
