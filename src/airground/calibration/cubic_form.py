"""Eq. 15 as a polynomial: features of the sample times coefficients that are cubic forms in g.

Written out, with g_ij row i, column j, and n = G1 x G2::

    u_dot = sum_j (n1 u + n2 v + n3) (g_1j - u g_3j) w_j,    v_dot = sum_j (n1 u + n2 v + n3) (g_2j - v g_3j) w_j

Each is the product of twelve features, {1, u, v, u^2, u v, v^2} x {x_dot, y_dot}, with twelve coefficients. So many
hypotheses meet many samples in one matrix product; and as a least-squares cost is quadratic in the coefficients, the
features' moments hold all that Gauss-Newton asks of the samples.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["FEATURES", "coefficient_gradient", "coefficients", "features", "horizons"]

FEATURES = 12
"""Monomials of degree up to two in (u, v), times the two components of the ground velocity."""

_ONE, _U, _V, _UU, _UV, _VV = range(6)
# Feature of n_k c_k times the first term of (g_ij - c_i g_3j), and of the second, for both components i.
_FIRST = (_U, _V, _ONE)
_SECOND = ((_UU, _UV, _U), (_UV, _VV, _V))


def features(u: FloatArray, v: FloatArray, out: FloatArray) -> None:
    """Features of samples, in normalised coordinates, from those two that are ground velocities.

    Parameters
    ----------
    u, v : (..., n) array
        Image points.
    out : (..., 12, n) array
        Monomial k times component j goes to row ``2 k + j``. Rows 0 and 1, the ground velocities (divided by the
        noise where the residual shall be), are read; the others are written.
    """
    u, v = u[..., None, :], v[..., None, :]
    rows = [out[..., 2 * k : 2 * k + 2, :] for k in range(6)]
    np.multiply(rows[_ONE], u, out=rows[_U])
    np.multiply(rows[_ONE], v, out=rows[_V])
    np.multiply(rows[_U], u, out=rows[_UU])
    np.multiply(rows[_U], v, out=rows[_UV])
    np.multiply(rows[_V], v, out=rows[_VV])


def coefficient_gradient(g: FloatArray) -> FloatArray:
    """Derivative of the coefficients by the entries of g; it is quadratic in g.

    Parameters
    ----------
    g : (H, 6) array
        Limited homographies, row by row, normalised so that eq. 15 holds as it stands.

    Returns
    -------
    D : (H, 6, 24) array
        ``D[:, a, 12 i + f]``: entry a of g, component i of the image velocity, feature f.
    """
    pairs = (g[:, :, None] * g[:, None, :]).reshape(-1, 36)
    return (pairs @ _QUADRATIC).reshape(-1, 6, 2 * FEATURES)


def coefficients(g: FloatArray) -> FloatArray:
    """Coefficients of eq. 15.

    Parameters
    ----------
    g : (H, 6) array
        Limited homographies, row by row.

    Returns
    -------
    K : (H, 24) array
        ``K[:, 12 i + f]``: component i of the image velocity, feature f.
    """
    n = horizons(g)
    return np.asarray((n[:, :, None] * g[:, None, :]).reshape(-1, 18) @ _PRODUCT)


def horizons(g: FloatArray) -> FloatArray:
    """Horizons n = G1 x G2 of many hypotheses.

    Parameters
    ----------
    g : (H, 6) array
        Limited homographies, row by row.

    Returns
    -------
    n : (H, 3) array
        Lines n.c = 0.
    """
    columns = np.ascontiguousarray(g.T).reshape(3, 2, -1)
    before, after = columns.take((1, 2, 0), axis=0), columns.take((2, 0, 1), axis=0)
    return np.asarray((before[:, 0] * after[:, 1] - after[:, 0] * before[:, 1]).T)


def _line() -> FloatArray:
    """(3, 36): takes g (x) g to n = G1 x G2; entry a of g is in row a // 2, column a % 2."""
    line = np.zeros((3, 6, 6))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        line[k, 2 * i, 2 * j + 1] = 1.0
        line[k, 2 * j, 2 * i + 1] = -1.0
    return line.reshape(3, 36)


def _product() -> FloatArray:
    """(18, 24): takes n (x) g to the coefficients."""
    product = np.zeros((3, 6, 2, FEATURES))
    for k in range(3):
        for i in range(2):
            for j in range(2):
                product[k, 2 * i + j, i, 2 * _FIRST[k] + j] += 1.0
                product[k, 4 + j, i, 2 * _SECOND[i][k] + j] -= 1.0
    return product.reshape(18, 2 * FEATURES)


def _quadratic() -> FloatArray:
    """(36, 144): takes g (x) g to the gradient of the coefficients."""
    line, product = _LINE.reshape(3, 6, 6), _PRODUCT.reshape(3, 6, 2 * FEATURES)
    form = np.tensordot(line, product, axes=(0, 0))  # (a, b, c, coefficient)
    by_each = form + form.transpose(1, 0, 2, 3) + form.transpose(2, 0, 1, 3)
    return np.ascontiguousarray(by_each.transpose(1, 2, 0, 3).reshape(36, 6 * 2 * FEATURES))


_LINE = _line()
_PRODUCT = _product()
_QUADRATIC = _quadratic()
