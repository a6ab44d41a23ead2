"""Plane collineations: 3x3 matrices that map points of one plane to another (eqs. 1 to 5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, homogeneous, numbers, points, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["Collineation", "unit_determinant"]


def unit_determinant(matrix: ArrayLike) -> FloatArray:
    """Scale a homography to determinant one, by the signed cube root (eq. 21).

    A 3x3 matrix has one real scale with determinant +1, whatever the sign of its own.

    Parameters
    ----------
    matrix : (..., 3, 3) array_like
        Homographies, each up to scale.

    Returns
    -------
    scaled : (..., 3, 3) array
        Multiples with determinant one.

    Raises
    ------
    InputError
        If a matrix is singular or not finite, or the shape is wrong.
    """
    matrix = numbers(matrix, "a homography")
    if matrix.shape[-2:] != (3, 3):
        raise InputError(f"a homography has shape (..., 3, 3), not {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise InputError("a homography has NaN or infinite entries")
    # Pixels and metres put entries of very different size into one matrix: compare each row with itself.
    rows = np.linalg.norm(matrix, axis=-1, keepdims=True)
    ok = (rows > 0).all(axis=(-2, -1))
    balanced = matrix / np.where(rows > 0, rows, 1.0)
    if not (ok & (np.abs(np.linalg.det(balanced)) > 1e-14)).all():
        raise InputError("a homography is singular: the camera's centre lies in the ground plane")
    scale = np.cbrt(np.linalg.det(balanced) * np.prod(rows[..., 0], axis=-1))
    return np.asarray(matrix / scale[..., None, None])


@dataclass(frozen=True, slots=True, eq=False)
class Collineation:
    """A projective map of the plane; name it ``<to>_from_<from>``."""

    matrix: FloatArray
    """(3, 3). Determinant one, whatever scale it was given in."""

    def __post_init__(self) -> None:
        matrix = unit_determinant(readonly(self.matrix, (3, 3), "matrix"))
        object.__setattr__(self, "matrix", readonly(matrix, (3, 3), "matrix"))

    def __matmul__(self, other: Collineation) -> Collineation:
        return Collineation(self.matrix @ other.matrix)

    def inverse(self) -> Collineation:
        """Map the other way.

        Returns
        -------
        inverse : Collineation
            ``<from>_from_<to>``.
        """
        return Collineation(np.asarray(np.linalg.inv(self.matrix), dtype=np.float64))

    def apply(self, xy: ArrayLike) -> FloatArray:
        """Map points (eqs. 4 and 5).

        Parameters
        ----------
        xy : (..., 2) array_like
            Points.

        Returns
        -------
        mapped : (..., 2) array
            Their images; NaN for points that go to infinity.
        """
        w = homogeneous(points(xy, "xy")) @ self.matrix.T
        return np.asarray(w[..., :2] / np.where(w[..., 2:] == 0.0, np.nan, w[..., 2:]))

    def jacobian(self, xy: ArrayLike) -> FloatArray:
        """Derivative of `apply`.

        Parameters
        ----------
        xy : (..., 2) array_like
            Points.

        Returns
        -------
        J : (..., 2, 2) array
            NaN for points that go to infinity.
        """
        w = homogeneous(points(xy, "xy")) @ self.matrix.T
        z = np.where(w[..., 2] == 0.0, np.nan, w[..., 2])[..., None, None]
        mapped = w[..., :2, None] / z
        return np.asarray((self.matrix[:2, :2] - mapped * self.matrix[2:, :2]) / z)
