"""Smooth maps for `remap`: computed on a coarse grid, spread to every sample by bilinear interpolation."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray

__all__ = ["Float32Array", "grid_positions", "spread"]

Float32Array = NDArray[np.float32]


def grid_positions(count: int, step: int) -> FloatArray:
    """Where a coarse grid lies along one axis, so that `spread` can fill what is between.

    Parameters
    ----------
    count : int
        Number of samples to fill.
    step : int
        Samples to a cell.

    Returns
    -------
    positions : (M,) array
        Middles of the cells, in samples; one before the first and one behind the last.
    """
    return np.asarray((np.arange(-1, -(-count // step) + 1) + 0.5) * step - 0.5)


def spread(grid: FloatArray, step: tuple[int, int], size: tuple[int, int]) -> Float32Array:
    """Bilinear interpolation of a coarse grid.

    Parameters
    ----------
    grid : (M, N, C) array
        Values at `grid_positions` of the rows and of the columns.
    step : (int, int)
        Samples to a cell, along the columns (u) and the rows (v).
    size : (int, int)
        Width and height of the result.

    Returns
    -------
    full : (height, width, C) array of float32
        A view: its rows are longer than it is wide.
    """
    rows, columns = grid.shape[:2]
    full = cv2.resize(
        np.asarray(grid, dtype=np.float32),
        (columns * step[0], rows * step[1]),
        interpolation=cv2.INTER_LINEAR,
    )
    return np.asarray(full[step[1] : step[1] + size[1], step[0] : step[0] + size[0]])
