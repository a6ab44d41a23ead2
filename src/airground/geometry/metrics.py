"""How far an estimate of g is from the truth (section 3.1, eq. 22), and what that does to velocities."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray, points
from airground.geometry.limited import LimitedHomography
from airground.geometry.velocity import velocity_jacobian

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["align_rotation", "n_error", "velocity_map_error"]


def _matrix(g: ArrayLike | LimitedHomography) -> FloatArray:
    return g.g if isinstance(g, LimitedHomography) else np.asarray(g, dtype=np.float64)


def n_error(g: ArrayLike | LimitedHomography, g_hat: ArrayLike | LimitedHomography) -> FloatArray:
    """Relative error of an estimate in the Frobenius norm (eqs. 22 and 23).

    In pixels the third row of g, the perspective, hardly counts: see `velocity_map_error` too.

    Parameters
    ----------
    g : (..., 3, 2) array_like or LimitedHomography
        Truth.
    g_hat : (..., 3, 2) array_like or LimitedHomography
        Estimate.

    Returns
    -------
    n : (...) array
        ||g - g_hat|| / ||g||; a plain number for one pair.
    """
    truth, estimate = _matrix(g), _matrix(g_hat)
    axes = (-2, -1)
    n: FloatArray = np.linalg.norm(truth - estimate, axis=axes) / np.linalg.norm(
        truth, axis=axes
    )  # eq. 22
    return n


def align_rotation(
    g: ArrayLike | LimitedHomography, g_hat: ArrayLike | LimitedHomography
) -> tuple[FloatArray, float]:
    """Turn the estimate's ground frame so that it comes nearest to the truth.

    Where the zero of a heading is arbitrary, a rotation of the ground is no error. Mirror images are not
    considered: handedness is part of the answer.

    Parameters
    ----------
    g : (3, 2) array_like or LimitedHomography
        Truth.
    g_hat : (3, 2) array_like or LimitedHomography
        Estimate.

    Returns
    -------
    aligned : (3, 2) array
        ``g_hat`` in the turned frame.
    angle : float [rad]
        How far it was turned, as in `LimitedHomography.rotated`.
    """
    truth, estimate = _matrix(g), _matrix(g_hat)
    M = estimate.T @ truth  # maximise trace(R.T M) over plane rotations R
    angle = float(np.arctan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1]))
    cos, sin = np.cos(angle), np.sin(angle)
    return estimate @ np.array([[cos, -sin], [sin, cos]]), angle


def velocity_map_error(
    g: ArrayLike | LimitedHomography, g_hat: ArrayLike | LimitedHomography, uv: ArrayLike
) -> float:
    """Relative error of ground velocities that the estimate gives, over all headings.

    A ground velocity goes to the image by the truth and comes back by the estimate.

    Parameters
    ----------
    g : (3, 2) array_like or LimitedHomography
        Truth.
    g_hat : (3, 2) array_like or LimitedHomography
        Estimate.
    uv : (..., 2) array_like [px]
        Where to ask: the driven region.

    Returns
    -------
    error : float
        Root mean square of |error| / |velocity| over the points and all headings.
    """
    uv = points(uv, "uv")
    truth = velocity_jacobian(_matrix(g), uv)
    estimate = velocity_jacobian(_matrix(g_hat), uv)
    try:
        back = np.linalg.solve(estimate, truth) - np.eye(2)
    except (
        np.linalg.LinAlgError
    ):  # the estimate's horizon runs through a point: no velocity there at all
        return float("inf")
    # The mean of |M w|^2 over unit vectors w is |M|_F^2 / 2.
    return float(np.sqrt(np.mean(np.sum(back**2, axis=(-2, -1))) / 2))
