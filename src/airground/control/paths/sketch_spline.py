"""Cubic splines through points at even parameters, by their slopes: of continuous curvature, quick to solve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["evaluate", "slopes"]

_WRAP = 40
"""Points beyond a seam, as the influence of an end fades by 2 - sqrt(3) with each."""


def slopes(points: FloatArray, *, closed: bool = False) -> FloatArray:
    """Derivatives of the spline at its points: ``m[i-1] + 4 m[i] + m[i+1] = 3 (p[i+1] - p[i-1])``.

    Parameters
    ----------
    points : (M, 2) array
        Four or more, at parameters 0, 1, 2, ...; of a closed line with the first again at the end.
    closed : bool
        Whether it goes round.

    Returns
    -------
    slopes : (M, 2) array
        By the parameter. At the ends of an open line those of a polynomial through the four or five points there.
    """
    from scipy.linalg.lapack import dptsv  # type: ignore[import-untyped,unused-ignore]

    count = len(points)
    if closed:
        points = points[np.arange(-_WRAP, count + _WRAP) % (count - 1)]
    weights = np.array([-25.0, 48, -36, 16, -3]) / 12
    if len(points) < 5:
        weights = np.array([-11.0, 18, -9, 2]) / 6
    k = len(weights)
    first, last = weights @ points[:k], -weights @ points[: -k - 1 : -1]
    right = 3 * (points[2:] - points[:-2])
    right[0] -= first
    right[-1] -= last
    inner = len(right)
    solved = dptsv(np.full(inner, 4.0), np.ones(inner - 1), right)[2]
    found = np.concatenate([first[None], solved, last[None]])
    return np.asarray(found[_WRAP:-_WRAP] if closed else found)


def evaluate(
    points: FloatArray, slope: FloatArray, places: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value, first and second derivative.

    Parameters
    ----------
    points, slope : (M, 2) array
        Of the spline.
    places : (K,) array
        Parameters in 0..M - 1.

    Returns
    -------
    value, one, two : (K, 2) array
        By the parameter.
    """
    i = np.minimum(places.astype(np.intp), len(points) - 2)
    f = (places - i)[:, None]
    p, m0, m1 = points[i], slope[i], slope[i + 1]
    step = points[i + 1] - p
    b, a = 3 * step - 2 * m0 - m1, m0 + m1 - 2 * step
    return p + f * (m0 + f * (b + f * a)), m0 + f * (2 * b + 3 * f * a), 2 * b + 6 * f * a
