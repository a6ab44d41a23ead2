"""The limited homography from motion correspondences, by linear algebra (paper, section 2.1).

Letters are the paper's; docs/notation.md ties each one to its name here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.headings import advise, distinct_headings_deg
from airground.errors import UnobservableMotionError
from airground.geometry.limited import LimitedHomography
from airground.geometry.velocity import image_velocity

if TYPE_CHECKING:
    from airground.calibration.samples import MotionSamples
    from airground.geometry.arrays import FloatArray

__all__ = [
    "denormalized",
    "estimate_linear",
    "linear_system",
    "normalizer",
    "null_vector",
    "require_rank",
    "scale_by_speed",
]

BLOCK = 1024  # rows
RANK_TOL = (
    1e-7  # of the largest singular value: well above rounding, well below any drive worth the name
)
RANK = 5  # g has six entries, and eq. 16 leaves its scale free


def estimate_linear(samples: MotionSamples, *, rank_tol: float = RANK_TOL) -> LimitedHomography:
    """Estimate g from motion correspondences (eqs. 16 and 17).

    The direction of g is the null vector of one linear constraint per sample; its scale and sign then follow from the
    lengths of the image velocities. Every sample counts: there is no test for outliers and no noise model here.

    Parameters
    ----------
    samples : MotionSamples
        Five or more, on several headings, in different places.
    rank_tol : float
        Singular values below `rank_tol` times the largest count as zero. This finds motion that is exactly degenerate;
        what is nearly so shows in the covariance that `calibrate` states.

    Returns
    -------
    model : LimitedHomography
        The estimate, scaled as in eq. 21.

    Raises
    ------
    UnobservableMotionError
        If the samples leave more than one g possible.
    """
    A, T = linear_system(samples)
    g_hat, singular = null_vector(A)
    require_rank(singular, samples, rank_tol=rank_tol)
    return LimitedHomography(scale_by_speed(denormalized(g_hat, T), samples))


def require_rank(
    singular: FloatArray, samples: MotionSamples, *, rank_tol: float = RANK_TOL
) -> None:
    """Raise where more than one g solves eq. 16.

    Parameters
    ----------
    singular : (6,) array
        Singular values of the system, descending.
    samples : MotionSamples
        What the system was filled from.
    rank_tol : float
        Singular values below `rank_tol` times the largest count as zero.

    Raises
    ------
    UnobservableMotionError
        With the rank, the headings seen, and what to drive next.
    """
    floor = rank_tol * singular[0] if singular[0] > 0 else np.inf
    rank = int(np.sum(singular > floor))
    if rank < RANK:
        headings = distinct_headings_deg(samples.xy_dot)
        seen = ", ".join(f"{h:.0f}" for h in headings) or "none"
        raise UnobservableMotionError(
            f"the motion gives {rank} of the {RANK} constraints that the linear method needs "
            f"(headings seen, modulo 180 degrees: {seen})",
            rank=rank,
            headings_deg=headings,
            advice=advise(headings),
        )


def linear_system(samples: MotionSamples) -> tuple[FloatArray, FloatArray]:
    """Fill the homogeneous system of eq. 20, one row per sample, in normalised pixels.

    The line through c along c_dot holds the vanishing point of the heading::

        ((T c) x (T c_dot))^T (T g) xy_dot = 0

    Parameters
    ----------
    samples : MotionSamples
        Motion correspondences.

    Returns
    -------
    A : (N, 6) array
        Its null vector is ``T g``, row by row.
    T : (3, 3) array
        Normalisation of the image.
    """
    T = normalizer(samples.uv)
    u, v = T[:2, :2] @ samples.uv.T + T[:2, 2:]
    u_dot, v_dot = T[:2, :2] @ samples.uv_dot.T
    x_dot, y_dot = samples.xy_dot.T
    A = np.empty((len(u), 6))
    # Eq. 18, written out: (u, v, 1) x (u', v', 0).
    for row, line in enumerate((-v_dot, u_dot, u * v_dot - v * u_dot)):
        np.multiply(line, x_dot, out=A[:, 2 * row])
        np.multiply(line, y_dot, out=A[:, 2 * row + 1])
    return A, T


def null_vector(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Right singular vector of the smallest singular value, and the six singular values.

    Parameters
    ----------
    A : (N, 6) array
        System of `linear_system`.

    Returns
    -------
    g_hat : (3, 2) array
        Unit null vector, as a matrix.
    singular : (6,) array
        Descending; zeros where there are fewer than six rows.
    """
    # A triangular factor has the same singular values and vectors, at the cost of a 6x6 SVD; taken block by block,
    # the work stays in the processor's cache.
    while len(A) > 2 * BLOCK:
        whole = len(A) // BLOCK * BLOCK
        blocks: FloatArray = np.asarray(np.linalg.qr(A[:whole].reshape(-1, BLOCK, 6), mode="r"))
        A = np.concatenate([blocks.reshape(-1, 6), A[whole:]])
    reduced = np.linalg.qr(A, mode="r") if len(A) > 6 else A
    _, singular, Vt = np.linalg.svd(reduced, full_matrices=True)
    return Vt[5].reshape(3, 2), np.pad(singular, (0, 6 - len(singular)))


def scale_by_speed(g_hat: FloatArray, samples: MotionSamples) -> FloatArray:
    """Scale and sign of g from the lengths of the image velocities (eq. 17).

    Eq. 17 is linear in alpha cubed; the real cube root gives the sign too.

    Parameters
    ----------
    g_hat : (3, 2) array
        g up to scale.
    samples : MotionSamples
        Motion correspondences.

    Returns
    -------
    g : (3, 2) array
        Scaled as in eq. 21.

    Raises
    ------
    UnobservableMotionError
        If `g_hat` predicts no image motion at all.
    """
    predicted = image_velocity(g_hat, samples.uv, samples.xy_dot)
    power = float(np.sum(predicted**2))
    alpha_cubed = float(np.sum(predicted * samples.uv_dot)) / power if power > 0 else 0.0
    if alpha_cubed == 0.0:
        headings = distinct_headings_deg(samples.xy_dot)
        raise UnobservableMotionError(
            "the image velocities do not follow the ground velocities at all",
            rank=0,
            headings_deg=headings,
            advice="check that tracks and motion belong together",
        )
    return np.asarray(np.cbrt(alpha_cubed) * g_hat)


def denormalized(g_hat: FloatArray, T: FloatArray) -> FloatArray:
    """Take g back from normalised pixels.

    Parameters
    ----------
    g_hat : (3, 2) array
        ``T g``.
    T : (3, 3) array
        Normalisation of the image.

    Returns
    -------
    g : (3, 2) array
        Up to the scale of `g_hat`.
    """
    return np.asarray(np.linalg.solve(T, g_hat))


def normalizer(uv: FloatArray) -> FloatArray:
    """Similarity that brings `uv` to mean zero and unit spread (lifts s5/s1 from 4e-4 to 0.3).

    Parameters
    ----------
    uv : (N, 2) array [px]
        Image points.

    Returns
    -------
    T : (3, 3) array
        To be applied to homogeneous image points.
    """
    if len(uv) == 0:
        return np.eye(3)
    u0, v0 = uv.mean(axis=0)
    s = 1.0 / max(float(np.sqrt(np.mean((uv - (u0, v0)) ** 2))), 1e-12)
    return np.array([[s, 0.0, -s * u0], [0.0, s, -s * v0], [0.0, 0.0, 1.0]])
