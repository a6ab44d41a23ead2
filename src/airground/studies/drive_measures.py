"""How well a path was driven: distances by brute force, apart from what steers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["distance_to_line", "rms"]

AT_ONCE = 2000  # points, so that the table of distances stays small


def distance_to_line(points: FloatArray, line: FloatArray) -> FloatArray:
    """Distance of points from a polyline.

    Parameters
    ----------
    points : (M, 2) array
        Asked about.
    line : (N, 2) array
        Corners, two or more.

    Returns
    -------
    distance : (M,) array
        In the unit of both.
    """
    start, step = line[:-1], np.diff(line, axis=0)
    square = np.maximum(np.sum(step**2, axis=1), 1e-300)
    found = []
    for k in range(0, len(points), AT_ONCE):
        off = points[k : k + AT_ONCE, None] - start
        share = np.clip(np.sum(off * step, axis=2) / square, 0.0, 1.0)
        gap = off - share[..., None] * step
        found.append(np.sqrt(np.sum(gap**2, axis=2).min(axis=1)))
    return np.concatenate(found) if found else np.empty(0)


def rms(values: FloatArray) -> float:
    """Root mean square.

    Parameters
    ----------
    values : (N,) array
        One or more.

    Returns
    -------
    rms : float
        In their unit.
    """
    return float(np.sqrt(np.mean(np.square(values))))
