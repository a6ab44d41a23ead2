"""Covariance of the linear estimate, from leaving out one stretch of the drive after the other.

The samples' errors are not white: windows overlap, slip comes in stretches, a compass is bent in one
corner. Leaving out whole stretches measures what they do together, without a noise model. It does not
see what is wrong with all of them alike: the speed's scale (a prior) and the bias of an algebraic fit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.alignment import LinearFit, fit_linear, unexplained
from airground.calibration.clock import parabola_minimum

if TYPE_CHECKING:
    from airground.calibration.correspondences import Correspondences
    from airground.geometry.arrays import FloatArray

__all__ = ["jackknife_covariance"]

BLOCKS = 20


def jackknife_covariance(
    data: Correspondences,
    like: LinearFit,
    shifted: tuple[Correspondences, Correspondences] | None = None,
    step: float = 0.0,
) -> FloatArray:
    """Covariance of g, row by row, and of the clock offset.

    Parameters
    ----------
    data : Correspondences
        In the order of the drive.
    like : LinearFit
        The fit to all of them.
    shifted : tuple of Correspondences, optional
        The same windows with the clock offset smaller and larger by `step`; not given if the offset is not estimated.
    step : float [s]
        See `shifted`.

    Returns
    -------
    covariance : (7, 7) array
        Last row and column belong to the clock offset [s].
    """
    count = len(data.samples)
    blocks = np.array_split(np.arange(count), min(BLOCKS, count))
    variants = (data,) if shifted is None else (shifted[0], data, shifted[1])
    estimates = []
    for block in blocks:
        rest = np.ones(count, dtype=bool)
        rest[block] = False
        fits = [fit_linear(variant.take(rest), like=like) for variant in variants]
        if shifted is None:
            estimates.append(np.append(fits[0].g, 0.0))
            continue
        before, middle, after = (fit.g for fit in fits)
        x = parabola_minimum([unexplained(fit.g, fit.samples) for fit in fits], limit=2.0)
        g = middle + x * (after - before) / 2 + x**2 * (after - 2 * middle + before) / 2
        estimates.append(np.append(g, x * step))
    spread = np.array(estimates) - np.mean(estimates, axis=0)
    return np.asarray((len(blocks) - 1) / len(blocks) * spread.T @ spread)
