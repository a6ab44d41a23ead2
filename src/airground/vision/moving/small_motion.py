"""Small changes of a homography: eight numbers, their covariance, and what they do to points.

A homography that is not quite H is written as a small motion of the image's points before H::

    H(delta) = H S^-1 (I + D) S,    D = [[d1, d2, d3], [d4, d5, d6], [d7, d8, 0]],    S = diag(1/1000, 1/1000, 1)

so that delta has no unit, and is in thousandths: d3 = 0.001 moves all points by 1 px in u. A covariance of a homography
is, in all of airground, the covariance (8, 8) of this delta. It stays valid whatever scale H is given in.
"""

from __future__ import annotations

import numpy as np

from airground.geometry.arrays import FloatArray, homogeneous

__all__ = [
    "UNIT_PX",
    "apply_homography",
    "change_of_basis",
    "compose_covariance",
    "deviation",
    "difference",
    "homography_jacobian",
    "invert_covariance",
    "move",
    "moved_by",
    "relative",
]

UNIT_PX = 1000.0
"""Length in the image that counts as one [px]."""

_TO_UNIT = np.diag([1 / UNIT_PX, 1 / UNIT_PX, 1.0])
_FROM_UNIT = np.diag([UNIT_PX, UNIT_PX, 1.0])
_BASIS = np.eye(9)[:8].reshape(8, 3, 3)


def move(matrix: FloatArray, delta: FloatArray, unit: FloatArray = _TO_UNIT) -> FloatArray:
    """Apply a small motion to the image before a homography.

    Parameters
    ----------
    matrix : (3, 3) array
        Homography H.
    delta : (8,) array
        Small motion.
    unit : (3, 3) array
        Takes pixels to the coordinates in which delta counts: S above.

    Returns
    -------
    moved : (3, 3) array
        H(delta), at the scale that comes out.
    """
    step = np.eye(3) + np.append(delta, 0.0).reshape(3, 3)
    return np.asarray(matrix @ np.linalg.solve(unit, step @ unit))


def difference(matrix: FloatArray, other: FloatArray) -> FloatArray:
    """Small motion that takes one homography to another: other = matrix(delta).

    Parameters
    ----------
    matrix : (3, 3) array
        Homography, any scale.
    other : (3, 3) array
        One that is nearly the same, any scale.

    Returns
    -------
    delta : (8,) array
        As of `move`.
    """
    step = _TO_UNIT @ np.linalg.solve(matrix, other) @ _FROM_UNIT
    return np.asarray((step / step[2, 2] - np.eye(3)).ravel()[:8])


def moved_by(uv: FloatArray, unit: FloatArray = _TO_UNIT) -> FloatArray:
    """Derivative of the image's points by the small motion, at zero motion.

    Parameters
    ----------
    uv : (..., 2) array [px]
        Points.
    unit : (3, 3) array
        As of `move`; it must not shear or turn.

    Returns
    -------
    B : (..., 2, 8) array [px]
        Row u is ``s [x, y, 1, 0, 0, 0, -x x, -x y]`` and row v alike, with x, y in units of s pixels.
    """
    w = homogeneous(uv) @ unit.T
    x, y, one = w[..., 0], w[..., 1], w[..., 2]
    size = 1.0 / unit[0, 0]
    B = np.zeros((*uv.shape[:-1], 2, 8))
    B[..., 0, 0] = B[..., 1, 3] = size * x
    B[..., 0, 1] = B[..., 1, 4] = size * y
    B[..., 0, 2] = B[..., 1, 5] = size * one
    B[..., 0, 6] = -size * x * x
    B[..., 0, 7] = B[..., 1, 6] = -size * x * y
    B[..., 1, 7] = -size * y * y
    return B


def change_of_basis(motion: FloatArray) -> FloatArray:
    """How the eight numbers change when the same small change is made behind another map: D' = M D M^-1.

    Parameters
    ----------
    motion : (3, 3) array
        M, in the units of delta.

    Returns
    -------
    T : (8, 8) array
        delta' = T delta; what is a multiple of the unit matrix in D' is only a scale and is taken out.
    """
    turned = motion @ _BASIS @ np.linalg.inv(motion)
    turned = turned - turned[:, 2:, 2:] * np.eye(3)
    return np.asarray(turned.reshape(8, 9)[:, :8].T)


def invert_covariance(matrix: FloatArray, covariance: FloatArray) -> FloatArray:
    """Covariance of the inverse of a homography.

    Parameters
    ----------
    matrix : (3, 3) array
        Homography.
    covariance : (8, 8) array
        Its covariance.

    Returns
    -------
    covariance : (8, 8) array
        Of the inverse.
    """
    T = change_of_basis(
        _TO_UNIT @ matrix @ _FROM_UNIT
    )  # (H(I+D))^-1 = (I-D) H^-1 = H^-1 (I - H D H^-1)
    return np.asarray(T @ covariance @ T.T)


def compose_covariance(
    outer: FloatArray, inner: FloatArray, inner_matrix: FloatArray
) -> FloatArray:
    """Covariance of a product of two homographies whose errors are independent.

    Parameters
    ----------
    outer : (8, 8) array
        Covariance of the one that acts last.
    inner : (8, 8) array
        Covariance of the one that acts first.
    inner_matrix : (3, 3) array
        The one that acts first.

    Returns
    -------
    covariance : (8, 8) array
        Of ``outer_matrix @ inner_matrix``.
    """
    T = change_of_basis(_TO_UNIT @ np.linalg.inv(inner_matrix) @ _FROM_UNIT)
    return np.asarray(T @ outer @ T.T + inner)


def apply_homography(matrix: FloatArray, uv: FloatArray) -> FloatArray:
    """Map points, at speed: no checks, and infinite where a point goes to infinity.

    Parameters
    ----------
    matrix : (3, 3) array
        Homography, any scale.
    uv : (..., 2) array [px]
        Points.

    Returns
    -------
    mapped : (..., 2) array [px]
        Their images.
    """
    w = uv @ matrix[:, :2].T + matrix[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(w[..., :2] / w[..., 2:])


def relative(one: FloatArray, other: FloatArray) -> FloatArray:
    """Homography from the image of one to that of another, both being known to a third.

    Parameters
    ----------
    one : (3, 3) array
        c_from_a.
    other : (3, 3) array
        c_from_b.

    Returns
    -------
    a_from_b : (3, 3) array
        Any scale.
    """
    return np.asarray(np.linalg.solve(one, other), dtype=np.float64)


def homography_jacobian(matrix: FloatArray, uv: FloatArray) -> FloatArray:
    """Derivative of `apply_homography` by the point.

    Parameters
    ----------
    matrix : (3, 3) array
        Homography, any scale.
    uv : (..., 2) array [px]
        Points.

    Returns
    -------
    J : (..., 2, 2) array
        Infinite or NaN where a point goes to infinity.
    """
    w = uv @ matrix[:, :2].T + matrix[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        mapped = w[..., :2, None] / w[..., 2:, None]
        return np.asarray((matrix[:2, :2] - mapped * matrix[2:, :2]) / w[..., 2:, None])


def deviation(matrix: FloatArray, covariance: FloatArray, uv: FloatArray) -> FloatArray:
    """Covariance that a homography's own error gives to points that it maps.

    Parameters
    ----------
    matrix : (3, 3) array
        Homography.
    covariance : (8, 8) array
        Its covariance.
    uv : (..., 2) array [px]
        Points before the homography.

    Returns
    -------
    covariance : (..., 2, 2) array [px2]
        Of the mapped points.
    """
    A = homography_jacobian(matrix, uv) @ moved_by(uv)
    return np.asarray(A @ covariance @ np.swapaxes(A, -1, -2))
