"""The ground for a camera that moves: strips of the image, each warped from the size of the picture that suits it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.vision.raster.maps import grid_positions

if TYPE_CHECKING:
    from airground.sim.renderer_views import View
    from airground.vision.frame import ImageArray
    from airground.vision.raster.warp import GreyTile

__all__ = ["TexelsOf", "through_corners", "warp_strips"]

TexelsOf = Callable[["View", FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""From columns and rows of the image to places in the tile (rows, columns, 2) and distances [m]."""

STRIP_PX = 48  # a multiple of the second step
STEP = (
    16,
    4,
)  # pixels of a lens's map, along u and v, from one exact place to the next: within 0.02 px between
FARTHEST_M = 40.0  # beyond, haze is to be seen: drawn with more care


def warp_strips(
    tile: GreyTile, view: View, texels: TexelsOf
) -> tuple[ImageArray, list[tuple[int, int]]]:
    """Draw the ground in grey.

    Parameters
    ----------
    tile : GreyTile
        The ground.
    view : View
        The camera.
    texels : callable
        Where the ground that a pixel shows is in the tile.

    Returns
    -------
    grey : (H, W) array
        The image.
    missing : list of (int, int)
        First row and number of rows of strips that were not drawn: they show the horizon, or very much ground.
    """
    width, height = view.image_size_px
    grey = np.empty((height, width), dtype=np.uint8)
    tops = np.arange(0, height, STRIP_PX)
    counts = np.minimum(STRIP_PX, height - tops)
    # Corners of all strips at once, and two neighbours in the middle of each.
    u = np.array([0.0, width / 2, width / 2 + 1, width - 1.0])
    v = np.stack([tops, tops + counts / 2, tops + counts / 2 + 1, tops + counts - 1.0], axis=1)
    places, away = texels(view, u, v.ravel())
    places = places.reshape(len(tops), 4, 4, 2)
    away = away.reshape(len(tops), -1)
    clear = np.isfinite(away).all(axis=1) & (np.nan_to_num(away).max(axis=1) < FARTHEST_M)
    steps = np.stack(
        [
            np.hypot(*np.moveaxis(places[:, 1, 2] - places[:, 1, 1], -1, 0)),
            np.hypot(*np.moveaxis(places[:, 2, 1] - places[:, 1, 1], -1, 0)),
        ]
    )
    density = np.maximum(steps.min(axis=0), steps.max(axis=0) / 2)
    grid = None
    if view.lens is not None:
        grid, _ = texels(view, grid_positions(width, STEP[0]), grid_positions(height, STEP[1]))

    missing = []
    for k, (top, count) in enumerate(zip(tops.tolist(), counts.tolist(), strict=True)):
        out = grey[top : top + count]
        done = False
        if clear[k]:
            level = tile.level_for(float(density[k]))
            if grid is not None:
                first = top // STEP[1]
                part = grid[first : first + -(-count // STEP[1]) + 2]
                done = tile.look_up(part, STEP, level, out)
            else:
                rows = np.array([0.0, max(count - 1.0, 1e-3)])
                H = through_corners(u[[0, 3]], rows, places[k][np.ix_([0, 3], [0, 3])])
                done = tile.warp(H, level, out)
        if not done:
            missing.append((top, count))
    return grey, missing


def through_corners(u: FloatArray, v: FloatArray, places: FloatArray) -> FloatArray:
    """Find the homography that takes the corners of a rectangle to four places.

    Exact under a global shutter; under a rolling one neighbouring strips still meet at their corners. From the unit
    square to a quadrilateral in closed form: Heckbert 1989, Fundamentals of Texture Mapping, section 2.2.3.

    Parameters
    ----------
    u, v : (2,) array [px]
        First and last column and row.
    places : (2, 2, 2) array
        Where the corners go, by row and column.

    Returns
    -------
    homography : (3, 3) array
        From (u, v, 1).
    """
    p00, p10, p01, p11 = places[0, 0], places[0, 1], places[1, 0], places[1, 1]
    twist = p00 - p10 + p11 - p01
    one, two = p10 - p11, p01 - p11
    det = one[0] * two[1] - two[0] * one[1]
    a = (twist[0] * two[1] - two[0] * twist[1]) / det
    b = (one[0] * twist[1] - twist[0] * one[1]) / det
    from_square = np.array(
        [
            [p10[0] - p00[0] + a * p10[0], p01[0] - p00[0] + b * p01[0], p00[0]],
            [p10[1] - p00[1] + a * p10[1], p01[1] - p00[1] + b * p01[1], p00[1]],
            [a, b, 1.0],
        ]
    )
    x, y = 1 / (u[1] - u[0]), 1 / (v[1] - v[0])
    return np.asarray(from_square @ np.array([[x, 0, -x * u[0]], [0, y, -y * v[0]], [0, 0, 1]]))
