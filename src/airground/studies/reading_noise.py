"""How the noise of readings adds up along a path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse  # type: ignore[import-untyped,unused-ignore]

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["hat_weights", "slow_precision"]


def hat_weights(t: FloatArray, read_t: FloatArray) -> Any:
    """Integral of what is read, interpolated between readings, from each sighting to the next.

    Parameters
    ----------
    t : (N,) array [s]
        Times of the sightings, ascending, within the readings'.
    read_t : (M,) array [s]
        Times of the readings, ascending.

    Returns
    -------
    weights : sparse (N-1, M) array [s]
        Weight of each reading in each integral; rows sum up to the durations.
    """
    cuts = np.unique(np.concatenate([t, read_t[(read_t > t[0]) & (read_t < t[-1])]]))
    start, end = cuts[:-1], cuts[1:]
    middle = (start + end) / 2
    step = np.searchsorted(t, middle) - 1
    k = np.searchsorted(read_t, middle) - 1
    duration = end - start
    later = (middle - read_t[k]) / (read_t[k + 1] - read_t[k])  # the mean of a linear function
    weights = np.concatenate([duration * (1 - later), duration * later])
    return sparse.coo_array(
        (weights, (np.tile(step, 2), np.concatenate([k, k + 1]))),
        shape=(len(t) - 1, len(read_t)),
    ).tocsr()


def slow_precision(t: FloatArray, size: float, memory_s: float) -> Any:
    """Inverse covariance of noise that changes slowly, at given times.

    Parameters
    ----------
    t : (M,) array [s]
        Times.
    size : float
        Standard deviation; for a random walk, that after one second.
    memory_s : float [s]
        Correlation time (Ornstein-Uhlenbeck); infinite for a random walk that starts at 0.

    Returns
    -------
    precision : sparse (M, M) array, or (M-1, M-1) for a random walk, which is 0 at the first time
        Tridiagonal.
    """
    dt = np.diff(t)
    if np.isinf(memory_s):
        kicks = sparse.diags_array(
            [np.ones(len(dt)), -np.ones(len(dt) - 1)], offsets=[0, -1], format="csr"
        )
        return kicks.T @ (kicks / (size**2 * dt)[:, None])
    keep = np.exp(-dt / memory_s)
    kicks = sparse.diags_array([np.ones(len(t)), -keep], offsets=[0, -1], format="csr")
    variance = size**2 * np.concatenate([[1.0], 1 - keep**2])
    return kicks.T @ (kicks / variance[:, None])
