"""g from the directions of four image velocities and the speeds of two: a cubic in closed form.

A sample i with ground velocity d_i goes towards the vanishing point v_i = g d_i. On the line through c_i along its
image velocity t_i that is v_i = x_i c_i + y_i t_i, so eq. 15 reads t_i = (n.c_i) y_i t_i, or (n.c_i) y_i = 1.
With n = (v_1 x v_2) / delta, delta = det(d_1, d_2), and lines l_i = c_i x t_i this reads, for the first two samples::

    y_1^2 (l_1 . v_2) = delta,      y_2^2 (l_2 . v_1) = -delta

which gives x_1 and x_2 from y_1 and y_2. Each further sample, d_j = alpha d_1 + beta d_2, gives its direction, eq. 20::

    alpha l_j . v_1 + beta l_j . v_2 = 0,   that is   y_1^3 (p_j + q_j r) = delta (a_j / r^2 - b_j),   r = y_2 / y_1

Two of them leave a cubic in r. Where there are two headings, two samples each, it has one root that counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.ransac import ComplexArray
    from airground.geometry.arrays import FloatArray

__all__ = ["FourSamples"]

_TURN = 0.7
"""[rad]. The pair (y_1, y_2) is turned by this, as the plain cubic loses its ends where headings are shared."""

_NEARLY_DOUBLE = 0.01
"""Share of the discriminant's parts, above it two roots are complex; below, noise has split a double root."""


class FourSamples:
    """Limited homographies from four samples each, not three of them on one heading."""

    size: ClassVar[int] = 4
    """Samples in a set."""

    def solve(self, columns: FloatArray) -> FloatArray:
        """Solve many sets at once.

        Parameters
        ----------
        columns : (6, 4, M) array
            Image points (u, v), image velocities and ground velocities, normalised; of the latter,
            the first two not parallel.

        Returns
        -------
        g : (3 * M, 6) array
            Three for each set, root by root; NaN or far off where a set is degenerate or a root is complex.
        """
        # Points and velocities as complex numbers: conj(a) b has the cross product for its imaginary part.
        points = np.empty((3, *columns.shape[1:]), dtype=np.complex128)
        points.real, points.imag = columns[::2], columns[1::2]
        z, t, d = points
        back = t.conj()
        delta = _cross(d[0], d[1])
        k12 = (back[0] * t[1]).imag  # l_1 . t_2 = -l_2 . t_1
        m = (back[1::-1] * (z[0] - z[1])).imag  # l_2 . c_1, -l_1 . c_2

        # (j, k, M) for the further samples j and the first two, k. Only the ratio of alpha and beta counts.
        weights = (d[2:, None].conj() * d[1::-1]).imag  # alpha, -beta
        ab = weights * (back[2:, None] * (z[:2] - z[2:, None])).imag
        ab /= m
        pq = weights * (back[2:, None] * t[:2]).imag  # p, -q
        pq += k12 * ab
        form = ab[0, :, None] * pq[1]
        form -= ab[1, :, None] * pq[0]

        y = _cubic_roots(form.reshape(4, -1))  # (2, 3, M)
        # (y1, y2) is a direction so far; its length follows from both samples' equations, by least squares.
        square = y * y
        left = pq[:, 0, None] * y[0] - pq[:, 1, None] * y[1]
        left *= square[0] * square[1]
        right = ab[:, 0, None] * square[0] - ab[:, 1, None] * square[1]
        right *= left
        left *= left
        y *= np.cbrt(delta * (right[0] + right[1]) / (left[0] + left[1]))
        np.multiply(y, y, out=square)
        x = (k12 * y - delta / square[::-1]) / m[:, None]

        # [v_1 v_2] = g [d_1 d_2], and v = x c + y t; the two columns of g as real and imaginary part
        v = x * z[:2, None] + y * t[:2, None]
        vanishing = np.empty((3, *x.shape))
        vanishing[0], vanishing[1], vanishing[2] = v.real, v.imag, x
        turned = d[1::-1] / delta * _QUARTERS
        g = vanishing[:, 0] * turned[0] + vanishing[:, 1] * turned[1]  # (3, 3, M)
        return np.ascontiguousarray(g.reshape(3, -1).T).view(np.float64)


def _cross(a: ComplexArray, b: ComplexArray) -> FloatArray:
    cross: FloatArray = (a.conj() * b).imag
    return cross


def _cubic_roots(form: FloatArray) -> FloatArray:
    """Directions (2, 3, M) that are roots; NaN for complex ones, but for the real part of those that noise has split.

    Signs and factors of the form's entries are in `_TURNED`: s^3 + 3 e1 s^2 + 3 e2 s + 2 e3 is what remains. Cardano's
    formula in complex numbers does for one real root as for three. Where two roots are close it loses half of the
    digits; the fit to the inliers, which follows, does not need them.
    """
    turned = _TURNED @ form
    e1, e2, e3 = turned[1:] / turned[0]
    square = e1 * e1
    p = e2 - square
    q = e1 * (square - 1.5 * e2) + e3
    square = q * q
    discriminant = square + p * p * p
    # The larger of the two cubes, so that nothing cancels. The first root is real.
    w = (np.abs(q) + np.sqrt(discriminant + 0j)) ** (1 / 3) * np.copysign(1.0, q)
    w = w * _UNIT_ROOTS
    s = (p / w - w).real - e1
    s[1:, discriminant > _NEARLY_DOUBLE * square] = np.nan
    return np.asarray(_ALONG * s + _ACROSS)


def _turned() -> FloatArray:
    """(4, 4): coefficients of s^3, 3 s^2, 3 s, 2 after (y1, y2) = turn (s, 1)."""
    y1, y2 = np.array([_COS, -_SIN]), np.array([_SIN, _COS])
    columns = []
    for power in range(4):
        form = np.ones(1)
        for factor in [y1] * (3 - power) + [y2] * power:
            form = np.convolve(form, factor)
        columns.append(form)
    # Of y1^3, y1^2 y2, y1 y2^2 and y2^3, as `solve` leaves them.
    signs = np.array([1.0, -1.0, -1.0, 1.0])
    return np.asarray(np.column_stack(columns) * signs / np.array([[1.0], [3.0], [3.0], [2.0]]))


_COS, _SIN = np.cos(_TURN), np.sin(_TURN)
_ALONG, _ACROSS = np.array([_COS, _SIN]).reshape(2, 1, 1), np.array([-_SIN, _COS]).reshape(2, 1, 1)
_TURNED = _turned()
_QUARTERS = np.array([[-1j], [1j]])
_UNIT_ROOTS = np.exp(2j * np.pi * np.arange(3) / 3)[:, None]
