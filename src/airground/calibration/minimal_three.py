"""g from three samples, both components of eq. 15: six equations for six unknowns.

A sample i with ground velocity d_i goes towards the vanishing point v_i = g d_i. On the line through c_i along its
image velocity t_i that is v_i = x_i c_i + y_i t_i, so eq. 15 reads t_i = (n.c_i) y_i t_i, or (n.c_i) y_i = 1.
With n = (v_1 x v_2) / delta, delta = det(d_1, d_2), lines l_i = c_i x t_i and d_3 = alpha d_1 + beta d_2::

    y_1^2 (l_1 . v_2) = delta,   y_2^2 (l_2 . v_1) = -delta,   y_3^2 (l_3 . v_2) = alpha delta        speeds
    alpha l_3 . v_1 + beta l_3 . v_2 = 0                                                direction, eq. 20

The first two give x_1 and x_2 from y_1 and y_2; the direction gives y_1^3 as a rational function of r = y_2 / y_1; what
is left of the third speed is a polynomial of degree eight in r, with six solutions at most among its roots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.ransac import ComplexArray
    from airground.geometry.arrays import FloatArray

__all__ = ["ThreeSamples"]

_TURN = 0.7
"""[rad]. The pair (y_1, y_2) is turned by this, as the polynomial loses its ends where two headings are shared."""

_DEGREE = 8

_NEARLY_REAL = 1e-2
"""Imaginary part of a double root that noise, or rounding, has split."""


class ThreeSamples:
    """Limited homographies from three samples each, on two or three headings."""

    size: ClassVar[int] = 3
    """Samples in a set."""

    def solve(self, columns: FloatArray) -> FloatArray:
        """Solve many sets at once.

        Parameters
        ----------
        columns : (6, 3, M) array
            Image points (u, v), image velocities and ground velocities, normalised; of the latter,
            the first two not parallel.

        Returns
        -------
        g : (H, 6) array
            At most eight for each set, two or three as a rule; some are no solutions.
        """
        z, t, d = columns[::2] + 1j * columns[1::2]
        # The third speed divides by alpha: the first two change places where the third runs along the second.
        swap = np.abs(_cross(d[2], d[1])) < np.abs(_cross(d[0], d[2]))
        order = np.where(swap, [[1], [0], [2]], [[0], [1], [2]])
        z, t, d = (np.take_along_axis(x, order, axis=0) for x in (z, t, d))

        delta = _cross(d[0], d[1])
        alpha, beta = _cross(d[2], d[1]) / delta, _cross(d[0], d[2]) / delta
        k12 = _cross(t[0], t[1])  # l_1 . t_2 = -l_2 . t_1
        m12, m21 = _cross(t[0], z[1] - z[0]), _cross(t[1], z[0] - z[1])  # l_1 . c_2, l_2 . c_1
        a = alpha * _cross(t[2], z[0] - z[2]) / m21
        b = beta * _cross(t[2], z[1] - z[2]) / m12
        p = alpha * _cross(t[2], t[0]) + k12 * a
        q = beta * _cross(t[2], t[1]) - k12 * b

        # Polynomials in r, up to the common factor delta / (r^2 (p + q r) y_1^2); lowest power first.
        nil = np.zeros_like(delta)
        one = np.stack([p, q])  # p + q r
        y1 = np.stack([a, nil, -b])
        x1 = (k12 * y1 - np.stack([p, q, nil])) / m21
        x2_r = (np.stack([nil, p, q]) - k12 * y1) / m12  # x2 / r
        reach = t[2] / np.abs(t[2]) ** 2  # y_3 is a part along t_3
        y3 = alpha * _shift(x1 * _real(reach, z[0] - z[2]) + y1 * _real(reach, t[0]), 0)
        y3 += beta * _shift(x2_r * _real(reach, z[1] - z[2]) + y1 * _real(reach, t[1]), 1)
        l3_v2_r = x2_r * _cross(t[2], z[1] - z[2]) + y1 * _cross(t[2], t[1])  # (l_3 . v_2) / r
        form = _product(_product(y3, y3), l3_v2_r)
        form[1:7] -= alpha * _product(_product(y1, y1), one)

        w1, w2 = _directions(form)
        left = (p * w1 + q * w2) * (w1 * w2) ** 2
        length = np.cbrt(delta * (a * w1**2 - b * w2**2) / left)
        w1, w2 = length * w1, length * w2
        x1, x2 = (k12 * w1 - delta / w2**2) / m21, (delta / w1**2 - k12 * w2) / m12

        # [v_1 v_2] = g [d_1 d_2]
        v1, v2 = x1 * z[0] + w1 * t[0], x2 * z[1] + w2 * t[1]
        d1, d2 = d[0] / delta, d[1] / delta
        g = np.empty((6, *w1.shape))
        for row, (s1, s2) in enumerate(((v1.real, v2.real), (v1.imag, v2.imag), (x1, x2))):
            g[2 * row] = s1 * d2.imag - s2 * d1.imag
            g[2 * row + 1] = s2 * d1.real - s1 * d2.real
        g = g.reshape(6, -1).T
        return np.asarray(g[np.isfinite(g[:, 0])])


def _cross(a: ComplexArray, b: ComplexArray) -> FloatArray:
    return np.asarray(a.real * b.imag - a.imag * b.real)


def _real(a: ComplexArray, b: ComplexArray) -> FloatArray:
    return np.asarray(a.real * b.real + a.imag * b.imag)


def _shift(quadratic: FloatArray, by: int) -> FloatArray:
    """A quadratic times r to the power `by`, as a cubic."""
    cubic = np.zeros((4, quadratic.shape[1]))
    cubic[by : by + 3] = quadratic
    return cubic


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of polynomials, (m, M) and (n, M)."""
    result = np.zeros((len(a) + len(b) - 1, a.shape[1]))
    for power, factor in enumerate(b):
        result[power : power + len(a)] += factor * a
    return result


def _directions(form: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Directions (8, M) with sum_k form_k y1^(8-k) y2^k = 0; NaN for complex roots and sets without a polynomial."""
    turned = (_TURNED @ form).T  # s^8 first
    usable = np.isfinite(turned).all(axis=1) & (turned[:, 0] != 0)
    roots = np.full((len(turned), _DEGREE), np.nan, dtype=np.complex128)
    companion = np.zeros((int(usable.sum()), _DEGREE, _DEGREE))
    companion[:, 0, :] = -turned[usable, 1:] / turned[usable, :1]
    companion[:, np.arange(1, _DEGREE), np.arange(_DEGREE - 1)] = 1.0
    usable[usable] = sound = np.isfinite(companion).all(axis=(1, 2))
    roots[usable] = np.linalg.eigvals(companion[sound])
    s = np.where(np.abs(roots.imag) <= _NEARLY_REAL * (1 + np.abs(roots.real)), roots.real, np.nan)
    for _ in range(2):  # Newton, as the companion matrix is not balanced
        value, slope = np.zeros_like(s), np.zeros_like(s)
        for k in range(_DEGREE + 1):
            slope, value = slope * s + value, value * s + turned[:, k, None]
        s = s - np.where(np.abs(value) < np.abs(slope), value / slope, 0.0)
    cos, sin = np.cos(_TURN), np.sin(_TURN)
    return (cos * s - sin).T, (sin * s + cos).T


def _turned() -> FloatArray:
    """(9, 9): coefficients of s^8, ..., 1 after (y1, y2) = turn (s, 1)."""
    cos, sin = np.cos(_TURN), np.sin(_TURN)
    y1, y2 = np.array([cos, -sin]), np.array([sin, cos])
    columns = []
    for power in range(_DEGREE + 1):
        form = np.ones(1)
        for factor in [y1] * (_DEGREE - power) + [y2] * power:
            form = np.convolve(form, factor)
        columns.append(form)
    return np.column_stack(columns)


_TURNED = _turned()
