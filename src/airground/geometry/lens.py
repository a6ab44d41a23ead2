"""Lens distortion by the division model with one parameter (Fitzgibbon, CVPR 2001).

With d the offset of a raw point from the lens's centre, w that of the undistorted point, s = d.d and q = 1 + k1 s::

    w = d / q                                          undistort
    d = 2 w / (1 + sqrt(1 - 4 k1 w.w))                 distort: the root that is d = w for k1 = 0

Negative k1 is a barrel: straight lines bow away from the centre. Let x = k1 s. For x = -1 the undistorted point is at
infinity; at x = +1 the map folds back. The model is used up to |x| = `LIMIT`; beyond it, everything is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray, points, readonly, refuse_huge

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["LIMIT", "DivisionLens"]

LIMIT = 0.95
"""Largest |k1| r^2 at which the model is used: there it moves a point 20 times further out, or half as far in."""

SLACK = 1e-9  # `distort` takes back what `undistort` gives at the very limit, despite rounding


@dataclass(frozen=True, slots=True, eq=False)
class DivisionLens:
    """Relation between raw pixels, as a camera gives them, and undistorted ones, as a pinhole would.

    Points that the model does not reach give NaN, in all methods: raw points with ``|k1| r^2 > LIMIT``, and
    undistorted points that come from no nearer raw point.
    """

    k1: float
    """[1/px^2]. Negative for a barrel, positive for a pincushion, 0 for no distortion."""

    center: FloatArray
    """(2,) [px]. The point that distortion leaves in place, often the image's middle."""

    def __post_init__(self) -> None:
        k1 = float(readonly(self.k1, (), "k1"))
        refuse_huge(k1, "k1")
        center = readonly(self.center, (2,), "center")
        refuse_huge(center, "center")
        object.__setattr__(self, "k1", k1)
        object.__setattr__(self, "center", center)

    # Points

    def undistort(self, uv: ArrayLike) -> FloatArray:
        """Where a pinhole would see what the camera sees at raw points.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.

        Returns
        -------
        uv_undistorted : (..., 2) array [px]
            NaN for points beyond the model's limit.
        """
        d, _, q = self._raw(uv)
        return _stack(self.center[0] + d[0] / q, self.center[1] + d[1] / q)

    def distort(self, uv_undistorted: ArrayLike) -> FloatArray:
        """Where the camera sees what a pinhole would see at undistorted points: the inverse of `undistort`.

        Parameters
        ----------
        uv_undistorted : (..., 2) array_like [px]
            Undistorted image points.

        Returns
        -------
        uv : (..., 2) array [px]
            Raw image points; NaN where there is none within the model's limit.
        """
        d, _, _ = self._from_undistorted(uv_undistorted)
        return _stack(self.center[0] + d[0], self.center[1] + d[1])

    # Velocities

    def undistort_velocity(self, uv: ArrayLike, uv_dot: ArrayLike) -> FloatArray:
        """Velocity of the undistorted point of what moves at `uv_dot` in the raw image.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.
        uv_dot : (..., 2) array_like [px/s]
            Raw image velocities.

        Returns
        -------
        uv_dot_undistorted : (..., 2) array [px/s]
            ``undistort_jacobian(uv) @ uv_dot``, without forming the matrices.
        """
        d, _, q = self._raw(uv)
        d_dot = _vector(points(uv_dot, "uv_dot"))
        out = 2 * self.k1 * _dot(d, d_dot) / (q * q)
        return _stack(d_dot[0] / q - out * d[0], d_dot[1] / q - out * d[1])

    def undistort_jacobian(self, uv: ArrayLike) -> FloatArray:
        """Derivative of `undistort` by the raw point: ``I / q - 2 k1 d d' / q^2``.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.

        Returns
        -------
        J : (..., 2, 2) array
            Symmetric; 1 / q across the radius, (1 - x) / q^2 along it.
        """
        d, _, q = self._raw(uv)
        return _identity_and_radial(d, 1 / q, -2 * self.k1 / (q * q))

    def distort_jacobian(self, uv_undistorted: ArrayLike) -> FloatArray:
        """Derivative of `distort` by the undistorted point: ``q I + 2 k1 q d d' / (1 - x)``.

        Parameters
        ----------
        uv_undistorted : (..., 2) array_like [px]
            Undistorted image points.

        Returns
        -------
        J : (..., 2, 2) array
            The inverse of `undistort_jacobian` at the raw point.
        """
        d, x, q = self._from_undistorted(uv_undistorted)
        return _identity_and_radial(d, q, 2 * self.k1 * q / (1 - x))

    # Derivatives by the lens's own numbers

    def undistort_by_k1(self, uv: ArrayLike) -> FloatArray:
        """Derivative of `undistort` by k1, at fixed raw points: ``-s d / q^2``.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.

        Returns
        -------
        derivative : (..., 2) array [px^3]
            Cubic in the radius.
        """
        d, _, q = self._raw(uv)
        rate = -_dot(d, d) / (q * q)
        return _stack(rate * d[0], rate * d[1])

    def undistort_by_center(self, uv: ArrayLike) -> FloatArray:
        """Derivative of `undistort` by the lens's centre, at fixed raw points.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.

        Returns
        -------
        derivative : (..., 2, 2) array
            ``[..., i, j]`` is that of coordinate i by coordinate j of the centre.
        """
        return np.asarray(np.eye(2) - self.undistort_jacobian(uv))  # u = c + f(uv - c)

    def undistort_velocity_by_k1(self, uv: ArrayLike, uv_dot: ArrayLike) -> FloatArray:
        """Derivative of `undistort_velocity` by k1, at fixed raw points and velocities.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Raw image points.
        uv_dot : (..., 2) array_like [px/s]
            Raw image velocities.

        Returns
        -------
        derivative : (..., 2) array [px^3/s]
            ``-s uv_dot / q^2 - 2 d (d.uv_dot) (1 - x) / q^3``.
        """
        d, x, q = self._raw(uv)
        d_dot = _vector(points(uv_dot, "uv_dot"))
        along = -_dot(d, d) / (q * q)
        out = -2 * _dot(d, d_dot) * (1 - x) / (q * q * q)
        return _stack(along * d_dot[0] + out * d[0], along * d_dot[1] + out * d[1])

    def distort_by_k1(self, uv_undistorted: ArrayLike) -> FloatArray:
        """Derivative of `distort` by k1, at fixed undistorted points: ``s d / (1 - x)``.

        Parameters
        ----------
        uv_undistorted : (..., 2) array_like [px]
            Undistorted image points.

        Returns
        -------
        derivative : (..., 2) array [px^3]
            Cubic in the radius.
        """
        d, x, _ = self._from_undistorted(uv_undistorted)
        rate = _dot(d, d) / (1 - x)
        return _stack(rate * d[0], rate * d[1])

    def distort_by_center(self, uv_undistorted: ArrayLike) -> FloatArray:
        """Derivative of `distort` by the lens's centre, at fixed undistorted points.

        Parameters
        ----------
        uv_undistorted : (..., 2) array_like [px]
            Undistorted image points.

        Returns
        -------
        derivative : (..., 2, 2) array
            ``[..., i, j]`` is that of coordinate i by coordinate j of the centre.
        """
        return np.asarray(np.eye(2) - self.distort_jacobian(uv_undistorted))

    # d, x and q of the module's formulas; NaN in x and q is what makes a result NaN

    def _raw(self, uv: ArrayLike) -> tuple[_Vector, FloatArray, FloatArray]:
        d = self._offset(points(uv, "uv"))
        with np.errstate(invalid="ignore", over="ignore"):  # infinite points give NaN
            x = _dot(d, d)
            x *= self.k1
        x = _within(x, LIMIT)
        return d, x, 1 + x

    def _from_undistorted(
        self, uv_undistorted: ArrayLike
    ) -> tuple[_Vector, FloatArray, FloatArray]:
        w = self._offset(points(uv_undistorted, "uv_undistorted"))
        with np.errstate(invalid="ignore", over="ignore"):
            x = _dot(w, w)
            x *= 4 * self.k1
            root = np.sqrt(1 - x)  # NaN where no raw point exists
            root += 1
            x /= root * root  # nothing cancels, whatever the sign of k1
            x = _within(x, LIMIT * (1 + SLACK))
            q = 1 + x
            return (w[0] * q, w[1] * q), x, q

    def _offset(self, uv: FloatArray) -> _Vector:
        return uv[..., 0] - self.center[0], uv[..., 1] - self.center[1]


# A vector's coordinates are kept apart within: NumPy is several times slower on a last axis of two.
_Vector = tuple[FloatArray, FloatArray]


def _dot(a: _Vector, b: _Vector) -> FloatArray:
    product = np.asarray(a[0] * b[0])
    product += a[1] * b[1]
    return product


def _within(x: FloatArray, limit: float) -> FloatArray:
    within = np.abs(x) <= limit
    return x if within.all() else np.where(within, x, np.nan)


def _vector(value: FloatArray) -> _Vector:
    return value[..., 0], value[..., 1]


def _stack(u: FloatArray, v: FloatArray) -> FloatArray:
    result = np.empty((*np.shape(u), 2))
    result[..., 0], result[..., 1] = u, v
    return result


def _identity_and_radial(d: _Vector, identity: FloatArray, radial: FloatArray) -> FloatArray:
    """``identity * I + radial * d d'``, entry by entry: it is symmetric."""
    u, v = d
    J = np.empty((*np.shape(u), 2, 2))
    J[..., 0, 0] = identity + radial * u * u
    J[..., 1, 1] = identity + radial * v * v
    J[..., 0, 1] = J[..., 1, 0] = radial * u * v
    return J
