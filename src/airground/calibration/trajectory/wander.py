"""Unknowns that wander about zero and forget (Ornstein-Uhlenbeck): headings that drift, wheels that slip."""

from __future__ import annotations

import numpy as np

from airground.calibration.trajectory.normal import Normal
from airground.geometry.arrays import FloatArray

__all__ = ["of_process"]


def of_process(
    value: FloatArray,
    link: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
    dt: FloatArray,
    *,
    sigma: float,
    memory: float,
    place: int,
    width: int,
    size: int,
) -> tuple[Normal, float]:
    """Normal equations of an unknown that wanders about zero and forgets (Ornstein-Uhlenbeck).

    Parameters
    ----------
    value : (N,) array
        Its values now.
    link : (N-1,) array of bool
        Where it goes on; elsewhere it starts anew.
    dt : (N-1,) array [s]
        Times between.
    sigma : float
        Its standard deviation.
    memory : float [s]
        Time over which it forgets.
    place : int
        Which of the local unknowns it is.
    width : int
        How many local unknowns there are.
    size : int
        How many global unknowns.

    Returns
    -------
    normal : Normal
        Tridiagonal.
    log_sigma : float
        Sum of the logarithms of the rows' standard deviations.
    """
    count = len(value)
    keep = np.where(link, np.exp(-dt / memory), 0.0)
    # Where it starts anew it has its full variance; nothing else distinguishes that case.
    variance = np.concatenate([[1.0], np.maximum(1 - keep**2, 1e-12)]) * sigma**2
    residual = value.copy()
    residual[1:] -= keep * value[:-1]
    over = residual / variance
    diagonal = 1 / variance
    diagonal[:-1] += keep**2 / variance[1:]
    right = -over
    right[:-1] += keep * over[1:]
    bands = np.zeros((2 * width, count * width))
    bands[0, place::width] = diagonal
    bands[width, place::width][:-1] = -keep / variance[1:]
    full = np.zeros((count, width))
    full[:, place] = right
    return Normal(
        bands,
        np.zeros((count * width, size)),
        full.reshape(-1),
        np.zeros((size, size)),
        np.zeros(size),
        float(np.sum(residual * over)),
    ), float(np.sum(np.log(variance)) / 2)
