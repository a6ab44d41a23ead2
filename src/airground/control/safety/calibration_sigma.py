"""How uncertain a calibration leaves ground velocities at a place of the image, quickly.

With ``J = (n.c) M`` and ``M = A - (u, v) b`` (eq. 15), an error dg of g turns the ground velocity that belongs to an
image velocity by ``-E w`` with ``E = (dn.c / n.c) I + M^-1 [I | -(u, v)] dg``. E is linear in dg, and the mean of
``|E w|^2`` over the headings is half its squared Frobenius norm. As ``det M = n.c``, every entry of ``(n.c) E`` is a
quadratic polynomial in u and v: its squared norm is a quadratic form in their six monomials, found once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, isnan, nan, sqrt
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from airground.control.floor import Floor

__all__ = ["CalibrationSigma"]

SCALE_PX = 500.0  # coordinates of size 1 keep the polynomials well conditioned


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationSigma:
    """Relative standard deviation of ground velocities, as a `Calibration` states it, for single points, quickly."""

    floor: Floor
    """With the estimate of g."""

    covariance: FloatArray
    """(6, 6). Of g, row by row."""

    _form: tuple[tuple[float, ...], ...] = field(init=False, repr=False)
    """(6, 6). Half the expected squared norm of (n.c) E, by the monomials 1, x, y, xx, xy, yy."""

    _horizon: tuple[float, float, float] = field(init=False, repr=False)
    """n, for x and y."""

    _centre: tuple[float, float] = field(init=False, repr=False)
    """Where x and y are 0 [px]."""

    def __post_init__(self) -> None:
        covariance = readonly(self.covariance, (6, 6), "covariance")
        # The same camera with another unit in its image: c' = T c.
        u, v = self.floor.origin_uv.tolist()
        T = np.array([[1.0, 0.0, -u], [0.0, 1.0, -v], [0.0, 0.0, SCALE_PX]]) / SCALE_PX
        g = T @ self.floor.model.g
        root = np.kron(T, np.eye(2)) @ _root(covariance)

        x, y = (a.ravel() for a in np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]))
        monomials = np.column_stack([np.ones(9), x, y, x * x, x * y, y * y])
        rows = np.stack([_error_rows(g, *point) @ root for point in zip(x, y, strict=True)])
        entries = np.linalg.lstsq(monomials, rows.reshape(9, -1), rcond=None)[0]  # exact
        form = entries @ entries.T / 2
        n = np.cross(g[:, 0], g[:, 1])
        object.__setattr__(self, "covariance", covariance)
        object.__setattr__(self, "_form", tuple(map(tuple, form.tolist())))
        object.__setattr__(self, "_horizon", tuple(n.tolist()))
        object.__setattr__(self, "_centre", (u, v))

    def at(self, u: float, v: float) -> float:
        """Relative standard deviation at a point, root mean square over the headings.

        Parameters
        ----------
        u, v : float [px]
            Image point, undistorted.

        Returns
        -------
        sigma : float
            Infinite on the horizon, NaN for NaN.
        """
        x, y = (u - self._centre[0]) / SCALE_PX, (v - self._centre[1]) / SCALE_PX
        n = self._horizon
        nc = n[0] * x + n[1] * y + n[2]
        if nc == 0:
            return inf
        xx, xy, yy = x * x, x * y, y * y
        total = 0.0
        for m, (a, b, c, d, e, f) in zip((1.0, x, y, xx, xy, yy), self._form, strict=True):
            total += m * (a + b * x + c * y + d * xx + e * xy + f * yy)
        if isnan(total):
            return nan
        return sqrt(max(total, 0.0)) / abs(nc)  # rounding may leave a little less than nothing


def _root(covariance: FloatArray) -> FloatArray:
    """A matrix whose square, ``root @ root.T``, is the covariance."""
    # Entries of g differ by many powers of ten: the root is taken of correlations.
    variances = np.diag(covariance)
    scale = np.sqrt(np.where(variances > 0, variances, 1.0))
    correlation = covariance / np.outer(scale, scale)
    if not np.allclose(correlation, correlation.T, rtol=0, atol=1e-6):
        raise InputError("covariance must be symmetric")
    values, vectors = np.linalg.eigh(correlation)
    if values[0] < -1e-6:
        raise InputError("covariance must have no negative eigenvalue")
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _error_rows(g: FloatArray, x: float, y: float) -> FloatArray:
    """(4, 6). Entries of (n.c) E, row by row, as linear functions of dg."""
    c = np.array([x, y, 1.0])
    by_g = np.column_stack([np.cross(g[:, 1], c), np.cross(c, g[:, 0])])  # of n.c = det [G1 G2 c]
    M = g[:2] - np.outer(c[:2], g[2])
    adjugate = np.array([[M[1, 1], -M[0, 1]], [-M[1, 0], M[0, 0]]])
    turned = adjugate @ np.column_stack([np.eye(2), -c[:2]])  # (2, 3)
    rows = np.einsum("ai,bj->abij", turned, np.eye(2)) + np.einsum("ab,ij->abij", np.eye(2), by_g)
    return np.asarray(rows.reshape(4, 6))
