"""Fast views of a grey tile that repeats, for a camera that moves: strips of the image, one warp each."""

from __future__ import annotations

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray
from airground.vision.frame import ImageArray
from airground.vision.raster.maps import spread
from airground.vision.raster.pyramid import Pyramid

__all__ = ["GreyTile"]

LONGEST = 3000  # texels of a level that one strip may reach over
INVERSE = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP


class GreyTile:
    """A tile of ground in grey, with the mean colour of each grey; grey warps three times as fast as colour.

    Parameters
    ----------
    picture : (H, W, 3) array
        The tile; half as large copies are made while its sides are even.
    """

    def __init__(self, picture: ImageArray) -> None:
        grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        self._palette = _palette(grey, picture)
        self._levels = Pyramid.of(grey, repeats=True).levels
        self._repeated: dict[int, ImageArray] = {}

    def level_for(self, texels_per_pixel: float) -> int:
        """Level whose texels are hardly finer than the pixels.

        Parameters
        ----------
        texels_per_pixel : float
            In texels of level 0.

        Returns
        -------
        level : int
            At least 0.
        """
        wanted = np.floor(np.log2(max(texels_per_pixel, 1e-6)) + 0.6)
        return int(np.clip(wanted, 0, len(self._levels) - 1))

    def warp(self, tile_from_strip: FloatArray, level: int, out: ImageArray) -> bool:
        """Fill a strip through a homography.

        Parameters
        ----------
        tile_from_strip : (3, 3) array
            From pixels of the strip to texels of level 0.
        level : int
            What to read.
        out : (H, W) array of uint8
            Written to.

        Returns
        -------
        done : bool
            False where the strip reaches too far for this level, and nothing was drawn.
        """
        height, width = out.shape
        half = 0.5**level
        H = (
            np.array([[half, 0, half / 2 - 0.5], [0, half, half / 2 - 0.5], [0, 0, 1]])
            @ tile_from_strip
        )
        corners = H @ np.array([[0, width, 0, width], [0, 0, height, height], [1, 1, 1, 1.0]])
        shift = self._shift(corners[:2] / corners[2], level)
        if shift is None:
            return False
        H[0] += shift[0] * H[2]
        H[1] += shift[1] * H[2]
        cv2.warpPerspective(self._wide(level), H, (width, height), dst=out, flags=INVERSE)
        return True

    def look_up(self, grid: FloatArray, step: tuple[int, int], level: int, out: ImageArray) -> bool:
        """Fill a strip through a smooth map.

        Parameters
        ----------
        grid : (M, N, 2) array
            Texels of level 0, column and row, at `grid_positions` of the rows and of the columns.
        step : (int, int)
            Pixels to a cell of the grid, along u and v.
        level : int
            What to read.
        out : (H, W) array of uint8
            Written to.

        Returns
        -------
        done : bool
            False where the strip reaches too far for this level, and nothing was drawn.
        """
        half = 0.5**level
        places = grid * half + (half / 2 - 0.5)
        ends = np.concatenate([places[0], places[-1], places[:, 0], places[:, -1]])
        shift = self._shift(ends.T, level)
        if shift is None:
            return False
        full = spread(places + shift, step, (out.shape[1], out.shape[0]))
        cv2.remap(self._wide(level), full, None, cv2.INTER_LINEAR, dst=out)  # type: ignore[call-overload]
        return True

    def colour(self, grey: ImageArray) -> ImageArray:
        """Colours of greys.

        Parameters
        ----------
        grey : (H, W) array
            Made by `warp`.

        Returns
        -------
        image : (H, W, 3) array
            Blue, green, red.
        """
        return np.asarray(cv2.applyColorMap(grey, self._palette), dtype=np.uint8)

    def blur(self, grey: ImageArray, way_px: FloatArray) -> ImageArray:
        """Blur as a short motion along a straight line would, to second order and without its slant.

        Parameters
        ----------
        grey : (H, W) array
            To blur.
        way_px : (2,) array [px]
            Along u and v; up to about 2.5 px.

        Returns
        -------
        grey : (H, W) array
            Blurred.
        """
        side = np.minimum(way_px**2 / 24, 0.3)  # a line of length L has the variance L^2 / 12
        kernels = [np.array([s, 1 - 2 * s, s], dtype=np.float32) for s in side]
        return np.asarray(cv2.sepFilter2D(grey, -1, kernels[0], kernels[1]), dtype=np.uint8)

    def _shift(self, places: FloatArray, level: int) -> FloatArray | None:
        """Whole tiles to move by, so that all places are in the repeated tile."""
        side = np.array(self._levels[level].shape[::-1])
        low, high = places.min(axis=1), places.max(axis=1)
        if not np.isfinite(low).all() or (high - low > LONGEST).any():
            return None
        return np.asarray(-np.floor((low - 2) / side) * side)

    def _wide(self, level: int) -> ImageArray:
        if level not in self._repeated:
            tile = self._levels[level]
            times = [-(-(LONGEST + side + 4) // side) for side in tile.shape]
            self._repeated[level] = np.tile(tile, times)
        return self._repeated[level]


def _palette(grey: ImageArray, picture: ImageArray) -> ImageArray:
    """(256, 1, 3). Mean colour of each grey, smoothed over a few."""
    count = np.bincount(grey.ravel(), minlength=256).astype(np.float64)
    near = np.exp(-(np.subtract.outer(np.arange(256), np.arange(256)) ** 2) / (2 * 3.0**2))
    far = np.exp(-(np.subtract.outer(np.arange(256), np.arange(256)) ** 2) / (2 * 40.0**2))
    weight = near + 1e-6 * far  # greys that do not occur take after the nearest that do
    colour = np.empty((256, 1, 3))
    for k in range(3):
        ratio = np.bincount(grey.ravel(), picture[..., k].ravel(), minlength=256)
        tint = (weight @ ratio) / np.maximum(weight @ (count * np.arange(256)), 1e-9)
        colour[:, 0, k] = tint * np.arange(256)
    return np.clip(np.rint(colour), 0, 255).astype(np.uint8)
