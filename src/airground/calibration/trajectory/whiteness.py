"""Whether the sightings' errors hang together: a detector's box that is off in one place is off there for seconds.

Errors that stay count less than white ones as often measured. Their integrated autocorrelation time, in sightings,
is the factor by which they widen the variance of all that is slower than they are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.trajectory.problem import Problem
    from airground.calibration.trajectory.solver import Solution
    from airground.geometry.arrays import FloatArray

__all__ = ["HANGING", "correlation_factor"]

FLOOR = 0.05  # autocorrelation below which it is taken as gone
SIGNIFICANT = 3.0  # deviations of a white series' autocorrelation
MOST_LAGS = 2000
HANGING = 1.5  # factor from which on the model must lack something
CROSSING = 4.0  # independent errors in one crossing of the picture, where it lacks something


def correlation_factor(problem: Problem, solution: Solution) -> float:
    """Factor on the variance of sightings that makes up for errors that hang together.

    Parameters
    ----------
    problem : Problem
        Chains.
    solution : Solution
        With residuals.

    Returns
    -------
    factor : float
        1 for white errors.
    """
    total = np.zeros(MOST_LAGS)
    pairs = np.zeros(MOST_LAGS)
    for z, (w, _) in zip(solution.sightings, solution.weights, strict=True):
        r = z * np.sqrt(w)[:, None]
        count = len(r)
        lags = min(MOST_LAGS, count)
        total[:lags] += _autocovariance(r)[:lags]
        pairs[:lags] += 2 * (count - np.arange(lags))
    if total[0] <= 0:
        return 1.0
    rho = total / total[0]
    noise = np.sqrt(np.maximum(pairs, 1.0)) / pairs[0]
    if len(rho) < 2 or rho[1] < SIGNIFICANT * noise[1]:
        return 1.0
    gone = np.flatnonzero((rho < FLOOR) | (rho < 2 * noise))
    last = int(gone[0]) if len(gone) else len(rho)
    factor = 1 + 2 * float(np.sum(rho[1:last]))
    if factor < HANGING:
        return factor
    # What hangs together in time does so by place and aspect, and the fit took the slowest part of it away: one
    # crossing of the picture holds a few independent errors only.
    worth = CROSSING * sum(_crossings(chain.uv) for chain in problem.chains)
    return max(factor, float(pairs[0]) / 2 / worth)


def _crossings(uv: FloatArray) -> float:
    """How often a path goes through the box that holds it."""
    way = float(np.sum(np.linalg.norm(np.diff(uv, axis=0), axis=1)))
    across = float(np.linalg.norm(np.ptp(uv, axis=0)))
    return max(1.0, way / max(across, 1e-9))


def _autocovariance(r: FloatArray) -> FloatArray:
    """Sum of products at each lag, over both coordinates."""
    count = len(r)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.fft.rfft(r, size, axis=0)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, size, axis=0)[:count].sum(axis=1))
