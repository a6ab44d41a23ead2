"""g from two straight lines, two samples on each: closed form.

On a heading the vanishing point is v = x c + y t, for a sample at c with image velocity t, and eq. 15 is (n.c) y = 1.
Two samples of one heading, d_3 = alpha d_1, give X_1 = x_1 / y_1 in one of two ways. On different lines these lines
cross in the vanishing point, ``l_3 . v_1 = 0``. On one line it is the speed that tells: it falls with the square of the
distance from the vanishing point, so along the line, with rho = y_3 / (alpha y_1), rho^2 = |t_1| / |alpha t_3|::

    X_1 (c_1 - c_3) = rho t_3 - t_1

As many for the other heading, X_2 from samples 2 and 4. The speeds then give both scales, delta = det(d_1, d_2)::

    y_1^2 y_2 (X_2 l_1.c_2 + l_1.t_2) = delta,      y_1 y_2^2 (X_1 l_2.c_1 + l_2.t_1) = -delta

This reaches what the directions of eq. 16 cannot: a robot that drove one straight line, turned, and drove another.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.ransac import ComplexArray
    from airground.geometry.arrays import FloatArray

__all__ = ["TwoLines"]

_ONE_LINE = 0.03
"""Sine of the angle under which the second sample is seen from the first, off its line, below which both are on one."""


class TwoLines:
    """Limited homographies from two headings, two samples each."""

    size: ClassVar[int] = 4
    """Samples in a set."""

    def solve(self, columns: FloatArray) -> FloatArray:
        """Solve many sets at once.

        Parameters
        ----------
        columns : (6, 4, M) array
            Image points (u, v), image velocities and ground velocities, normalised; of the latter,
            the third along the first, the fourth along the second.

        Returns
        -------
        g : (M, 6) array
            One for each set; NaN or far off where a set is degenerate.
        """
        z, t, d = columns[::2] + 1j * columns[1::2]
        alpha = _real(d[2:], d[:2]) / _real(d[:2], d[:2])  # of both headings
        step = z[:2] - z[2:]
        across, along = _cross(t[2:], step), _real(t[2:], step)
        square = _real(t[2:], t[2:])
        # rho t_3 runs with t_1, whichever way the robot drove.
        sense = np.sign(_real(t[2:], t[:2]))
        rho = sense * np.sqrt(np.sqrt(_real(t[:2], t[:2]) / square) / np.abs(alpha))
        same = np.abs(across) < _ONE_LINE * np.sqrt(square) * np.abs(step)
        X = np.where(
            same,
            (rho * square - _real(t[2:], t[:2])) / along,
            -_cross(t[2:], t[:2]) / across,
        )

        delta = _cross(d[0], d[1])
        k12 = _cross(t[0], t[1])  # l_1 . t_2 = -l_2 . t_1
        m12, m21 = _cross(t[0], z[1] - z[0]), _cross(t[1], z[0] - z[1])  # l_1 . c_2, l_2 . c_1
        first, second = delta / (X[1] * m12 + k12), -delta / (X[0] * m21 - k12)
        y1, y2 = np.cbrt(first * first / second), np.cbrt(second * second / first)
        x1, x2 = X[0] * y1, X[1] * y2

        # [v_1 v_2] = g [d_1 d_2]
        v1, v2 = x1 * z[0] + y1 * t[0], x2 * z[1] + y2 * t[1]
        d1, d2 = d[0] / delta, d[1] / delta
        g = np.empty((6, *y1.shape))
        for row, (s1, s2) in enumerate(((v1.real, v2.real), (v1.imag, v2.imag), (x1, x2))):
            g[2 * row] = s1 * d2.imag - s2 * d1.imag
            g[2 * row + 1] = s2 * d1.real - s1 * d2.real
        return g.T


def _cross(a: ComplexArray, b: ComplexArray) -> FloatArray:
    return np.asarray(a.real * b.imag - a.imag * b.real)


def _real(a: ComplexArray, b: ComplexArray) -> FloatArray:
    return np.asarray(a.real * b.real + a.imag * b.imag)
