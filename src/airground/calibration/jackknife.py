"""Covariance of the linear estimate, from leaving out one stretch of the drive after the other.

The samples' errors are not white: windows overlap, slip comes in stretches, a compass is bent in one
corner. Leaving out whole stretches measures what they do together, without a noise model. It does not
see what is wrong with all of them alike: the speed's scale (a prior) and the bias of an algebraic fit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.clock import parabola_minimum, unexplained
from airground.calibration.linear import denormalized, linear_system, scale_by_speed

if TYPE_CHECKING:
    from airground.calibration.samples import MotionSamples
    from airground.geometry.arrays import FloatArray

__all__ = ["jackknife_covariance"]

BLOCKS = 20


def jackknife_covariance(
    samples: MotionSamples, shifted: tuple[MotionSamples, MotionSamples] | None, step: float
) -> FloatArray:
    """Covariance of g, row by row, and of the clock offset.

    Parameters
    ----------
    samples : MotionSamples
        In the order of the drive.
    shifted : tuple of MotionSamples or None
        The same windows with the clock offset smaller and larger by `step`; None if the offset is given, not estimated.
    step : float [s]
        See `shifted`.

    Returns
    -------
    covariance : (7, 7) array
        Last row and column belong to the clock offset [s].
    """
    count = len(samples)
    blocks = np.array_split(np.arange(count), min(BLOCKS, count))
    variants = (samples,) if shifted is None else (shifted[0], samples, shifted[1])
    systems = [linear_system(s) for s in variants]
    estimates = []
    for block in blocks:
        rest = np.ones(count, dtype=bool)
        rest[block] = False
        gs, costs = [], []
        for variant, (A, T) in zip(variants, systems, strict=True):
            kept = variant.take(rest)
            # Rows are of one size after normalisation, so squaring them into 6x6 costs no digits that matter here.
            _, vectors = np.linalg.eigh(A[rest].T @ A[rest])
            g = scale_by_speed(denormalized(vectors[:, 0].reshape(3, 2), T), kept)
            gs.append(g)
            costs.append(unexplained(g, kept))
        if shifted is None:
            estimates.append(np.append(gs[0], 0.0))
            continue
        x = parabola_minimum(costs, limit=2.0)
        g = gs[1] + x * (gs[2] - gs[0]) / 2 + x**2 * (gs[2] - 2 * gs[1] + gs[0]) / 2
        estimates.append(np.append(g, x * step))
    spread = np.array(estimates) - np.mean(estimates, axis=0)
    return np.asarray((len(blocks) - 1) / len(blocks) * spread.T @ spread)
