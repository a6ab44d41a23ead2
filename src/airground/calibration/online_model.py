"""Where a robot is seen, given g and where it is on the ground: the sighting model of the recursive estimator.

Everything is in normalised pixels: T is the similarity that takes the reference point c_ref to the image's origin and
the spread of the sightings to one, and ``T g / cbrt(det T)`` has unit determinant again. All positions are free, so the
ground's origin is pure gauge; it is put under c_ref = (0, 0, 1). With ``g = [A; b]``, A 2x2, b 1x2, there n.c_ref is
det A, and a ground point P is seen at (eq. 1, third column ``c_ref / (n.c_ref)``)::

    uv = A P / z,      z = b.P + 1 / det A

z and det A have one sign in front of the camera.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["ImageFrame", "inverse_2x2", "sighting", "sighting_gradients", "unproject"]


@dataclass(frozen=True, slots=True, eq=False)
class ImageFrame:
    """Normalised pixels, and what becomes of g in them."""

    centre: FloatArray
    """(2,) [px]. The reference point c_ref; it shows ground."""

    scale: float
    """Normalised pixels per pixel [1/px]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", readonly(self.centre, (2,), "centre"))

    @classmethod
    def around(cls, uv: FloatArray) -> ImageFrame:
        """Frame in which points have mean zero and unit spread.

        Parameters
        ----------
        uv : (N, 2) array [px]
            Image points, two or more that differ.

        Returns
        -------
        frame : ImageFrame
            Centred on them.
        """
        centre = uv.mean(axis=0)
        return cls(centre, 1.0 / max(float(np.sqrt(np.mean((uv - centre) ** 2))), 1e-9))

    def normalised(self, uv: ArrayLike) -> FloatArray:
        """Take image points into the frame.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.

        Returns
        -------
        c : (..., 2) array
            Normalised.
        """
        return np.asarray((np.asarray(uv, dtype=np.float64) - self.centre) * self.scale)

    def _matrix(self) -> FloatArray:
        """T over the cube root of its determinant, so that ``T g`` keeps unit determinant (eq. 21)."""
        s = self.scale
        T = np.array(
            [[s, 0.0, -s * self.centre[0]], [0.0, s, -s * self.centre[1]], [0.0, 0.0, 1.0]]
        )
        return np.asarray(T / np.cbrt(s * s))

    def from_pixels(self, g: FloatArray) -> FloatArray:
        """Take g into the frame.

        Parameters
        ----------
        g : (3, 2) array
            Limited homography.

        Returns
        -------
        x : (6,) array
            Its entries in the frame, row by row.
        """
        return np.asarray((self._matrix() @ g).ravel())

    def to_pixels(self, x: FloatArray) -> FloatArray:
        """Take g back.

        Parameters
        ----------
        x : (6,) array
            Entries of g in the frame, row by row.

        Returns
        -------
        g : (3, 2) array
            Limited homography, scaled as in eq. 21.
        """
        return np.asarray(np.linalg.solve(self._matrix(), x.reshape(3, 2)), dtype=np.float64)

    def jacobian(self) -> FloatArray:
        """Derivative of `to_pixels`.

        Returns
        -------
        D : (6, 6) array
            ``to_pixels(x).ravel() == D @ x``.
        """
        return np.asarray(np.kron(np.linalg.inv(self._matrix()), np.eye(2)))


def sighting(x: FloatArray, P: FloatArray) -> FloatArray:
    """Where ground points are seen (the module's formula).

    Parameters
    ----------
    x : (6,) array
        g in an `ImageFrame`, row by row.
    P : (N, 2) array [m]
        Ground points, from the one under c_ref.

    Returns
    -------
    c : (N, 2) array
        Normalised image points; NaN behind the camera.
    """
    det = x[0] * x[3] - x[1] * x[2]
    z = P @ x[4:6] + 1.0 / det
    z = np.where(z * det > 0, z, np.nan)
    return np.asarray((P @ x[:4].reshape(2, 2).T) / z[:, None])


def sighting_gradients(
    x: FloatArray, P: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Where ground points are seen, and how that depends on g and on them.

    Parameters
    ----------
    x : (6,) array
        g in an `ImageFrame`, row by row.
    P : (N, 2) array [m]
        Ground points, from the one under c_ref.

    Returns
    -------
    c : (N, 2) array
        Normalised image points; meaningless where `nearer` is not positive.
    by_g : (N, 2, 6) array
        Derivative by `x`.
    by_point : (N, 2, 2) array [1/m]
        Derivative by `P`.
    nearer : (N,) array
        Depth over that of c_ref; positive in front of the camera.
    """
    a, b, c_, d = x[:4]
    det = a * d - b * c_
    z = P @ x[4:6] + 1.0 / det
    over = (1.0 / z)[:, None]
    A = x[:4].reshape(2, 2)
    c = (P @ A.T) * over
    near = P * over
    by_g = np.zeros((len(P), 2, 6))
    # d(1 / det A) = -cof(A) / det^2
    by_g[:, :, :4] = (c * (over / (det * det)))[:, :, None] * np.array([d, -c_, -b, a])
    by_g[:, 0, 0:2] += near
    by_g[:, 1, 2:4] += near
    by_g[:, :, 4:] = c[:, :, None] * -near[:, None, :]
    by_point = (A - c[:, :, None] * x[4:6]) * over[:, :, None]
    return c, by_g, by_point, z * det


def unproject(x: FloatArray, c: FloatArray) -> FloatArray:
    """Ground points under image points: the inverse of `sighting`.

    Parameters
    ----------
    x : (6,) array
        g in an `ImageFrame`, row by row.
    c : (N, 2) array
        Normalised image points.

    Returns
    -------
    P : (N, 2) array [m]
        From the point under c_ref; NaN on and beyond the horizon.
    """
    A = x[:4].reshape(2, 2)
    det = x[0] * x[3] - x[1] * x[2]
    M = A - c[:, :, None] * x[4:6]
    # det(A - c b) = n.c, and it has det A's sign on the visible side.
    nc = M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0]
    nc = np.where(nc * det > 0, nc, np.nan) * det
    u, v = c[:, 0], c[:, 1]
    return np.stack(
        [(M[:, 1, 1] * u - M[:, 0, 1] * v) / nc, (M[:, 0, 0] * v - M[:, 1, 0] * u) / nc], axis=1
    )


def inverse_2x2(M: FloatArray) -> FloatArray:
    """Inverses of 2x2 matrices, without the overhead of a general solver.

    Parameters
    ----------
    M : (N, 2, 2) array
        Regular matrices.

    Returns
    -------
    inverse : (N, 2, 2) array
        Theirs.
    """
    a, b, c, d = M[:, 0, 0], M[:, 0, 1], M[:, 1, 0], M[:, 1, 1]
    inverse = np.empty_like(M)
    over = 1.0 / (a * d - b * c)
    inverse[:, 0, 0] = d * over
    inverse[:, 0, 1] = -b * over
    inverse[:, 1, 0] = -c * over
    inverse[:, 1, 1] = a * over
    return inverse
