"""The linear algebra of fitting tags to an image: one step of Gauss and Newton, for several tags at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray32 = NDArray[np.float32]

__all__ = [
    "PARAMETERS",
    "Step",
    "best_step",
    "brightness",
    "correlation",
    "huber_weight",
    "what_is_left",
]

PARAMETERS = 14
"""8 of the homography, 2 of the blur, 4 of the brightness."""

HUBER = 2.0
BLUR_PRIOR = np.where(np.isin(np.arange(PARAMETERS), (8, 9)), 4.0, 0.0)  # weak: one may be unseen
TINY = 1e-9 * np.eye(4)


class Step(NamedTuple):
    """A step of Gauss and Newton."""

    inverse: FloatArray
    """(K, 14, 14). Of the normal equations."""

    change: FloatArray
    """(K, 14). Of the parameters."""

    gradient: FloatArray
    """(K, 14). Right side of the normal equations."""

    square: FloatArray
    """(K,). Mean square of the residuals."""


def best_step(
    design: FloatArray32, residual: FloatArray32, weight: FloatArray32, alive: NDArray[np.bool_]
) -> Step:
    """Solve the normal equations.

    Parameters
    ----------
    design : (K, 14, N) array
        Derivatives of the pixels' brightness.
    residual : (K, N) array
        What it is to change by.
    weight : (K, N) array
        Of the pixels.
    alive : (K,) array of bool
        Which tags count; becomes false for those that have no solution.

    Returns
    -------
    step : Step
        Zero for those that do not count.
    """
    weighted = design * weight[:, None]
    A = (weighted @ design.swapaxes(1, 2)).astype(np.float64)
    total: FloatArray = (weight * residual * residual).sum(axis=1, dtype=np.float64)
    square = total / weight.sum(axis=1)
    diagonal = A.reshape(len(A), -1)[:, :: PARAMETERS + 1]
    diagonal *= 1.0 + 1e-6
    diagonal += 1e-9 + square[:, None] * BLUR_PRIOR
    _leave_out(A, alive)
    inverse: FloatArray = np.asarray(np.linalg.inv(A), dtype=np.float64)
    gradient = (weighted @ residual[..., None]).astype(np.float64)
    change = (inverse @ gradient)[..., 0]
    _leave_out(change, alive)
    return Step(inverse, change, gradient[..., 0], square)


def what_is_left(design: FloatArray32, residual: FloatArray32, step: Step) -> FloatArray32:
    """Residuals after a step, if all is linear along it.

    Parameters
    ----------
    design : (K, 14, N) array
        As of `best_step`.
    residual : (K, N) array
        Before.
    step : Step
        From there.

    Returns
    -------
    left : (K, N) array
        After.
    """
    left: FloatArray32 = residual - (step.change[:, None].astype(np.float32) @ design)[:, 0]
    return left


def _leave_out(A: FloatArray, alive: NDArray[np.bool_]) -> None:
    """Put the unit matrix for those of no use, so that the others can be inverted; zero for a column."""
    if np.isfinite(A.sum()) and alive.all():
        return
    alive &= np.isfinite(A).all(axis=tuple(range(1, A.ndim)))
    A[~alive] = np.eye(A.shape[1]) if A.ndim == 3 else 0.0


def correlation(seen: FloatArray32, residual: FloatArray32, weight: FloatArray32) -> FloatArray32:
    """Between pixels and what explains them.

    Parameters
    ----------
    seen : (K, N) array
        Brightness of the pixels.
    residual : (K, N) array
        What is not explained of it.
    weight : (..., K, N) array
        Of the pixels.

    Returns
    -------
    correlation : (..., K) array
        From 0 to 1.
    """
    share = weight / np.maximum(weight.sum(axis=-1), 1e-9)[..., None]
    mean = (share * seen).sum(axis=-1)
    total = (share * (seen - mean[..., None]) ** 2).sum(axis=-1)
    left = (share * residual**2).sum(axis=-1)
    value: FloatArray32 = np.sqrt(np.clip(1.0 - left / np.maximum(total, 1e-9), 0.0, 1.0))
    return value


def brightness(
    ramp: FloatArray32, seen: FloatArray32, use: FloatArray32
) -> tuple[FloatArray32, FloatArray32]:
    """Fit dark level, contrast and ramp.

    Parameters
    ----------
    ramp : (K, 4, N) array
        1, the pattern, x and y at the pixels.
    seen : (K, N) array
        Brightness of the pixels.
    use : (K, N) array
        1, or 0 for those that do not count.

    Returns
    -------
    residual : (K, N) array
        What is left.
    contrast : (K,) array
        White less black.
    """
    weighted = ramp * use[:, None]
    A = (weighted @ ramp.swapaxes(1, 2)).astype(np.float64)
    A += TINY
    if not np.isfinite(A.sum()):
        _leave_out(A, np.ones(len(A), dtype=bool))
    level = np.linalg.solve(A, (weighted @ seen[..., None]).astype(np.float64)).astype(np.float32)
    return seen - (level.swapaxes(1, 2) @ ramp)[:, 0], level[:, 1, 0]


def huber_weight(residual: FloatArray32, use: FloatArray32) -> FloatArray32:
    """Huber's weights.

    Parameters
    ----------
    residual : (K, N) array
        Of the pixels [grey levels].
    use : (K, N) array
        1, or 0 for those that do not count.

    Returns
    -------
    weight : (K, N) array
        From 0 to 1.
    """
    size = np.abs(residual)
    middle = size.shape[1] // 2
    spread = np.partition(size, middle, axis=1)[:, middle, None]
    spread *= np.float32(1.4826 * HUBER)
    spread += np.float32(0.3 * HUBER)
    size = np.maximum(size, spread)
    weight: FloatArray32 = use * spread / size
    return weight
