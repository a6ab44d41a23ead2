"""The ground through a camera: each pixel is the mean of what it sees, also far away; sky above the horizon."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.sim.renderer_strips import warp_strips
from airground.vision.frame import ImageArray
from airground.vision.raster.maps import grid_positions, spread
from airground.vision.raster.pyramid import Pyramid, shrink
from airground.vision.raster.warp import GreyTile

if TYPE_CHECKING:
    from airground.sim.ground_texture import Ground
    from airground.sim.lens import Lens
    from airground.sim.renderer_views import View

__all__ = ["GroundArtist"]

BAND_PX = 24  # rows drawn from one size of the picture
LEAST_BLUR_PX = 0.3
STEP = 8  # samples of a map from one exact place to the next
FINE = 4  # samples to a pixel, along u and along v
FARTHEST = 3.0e4  # texels of a level: beyond, a map's numbers overflow
HAZE_M = 250.0  # at which distance two thirds of the light are haze's
CLEAR_M = 40.0  # haze takes 2.5 % there
SKY = np.array([222.0, 206.0, 190.0])


class GroundArtist:
    """Draws the ground.

    Parameters
    ----------
    ground : Ground
        The tile.
    light : float
        What its colours are multiplied by.
    """

    def __init__(self, ground: Ground, light: float = 1.0) -> None:
        picture = ground.picture
        if light != 1.0:
            picture = np.clip(np.rint(picture * light), 0, 255).astype(np.uint8)
        self._picture = picture
        self._pyramid = Pyramid.of(picture, repeats=True)
        self._grey: GreyTile | None = None
        self._texel_from_ground = ground.texel_from_ground
        self._texel_m = ground.texel_m
        self._sky = np.clip(SKY * light, 0, 255)

    def draw(self, view: View) -> ImageArray:
        """Draw it as well as can be: for a camera that stands still.

        Parameters
        ----------
        view : View
            The camera.

        Returns
        -------
        image : (H, W, 3) array
            Without anything on it.
        """
        height = view.image_size_px[1]
        bands = [
            self._band(view, top, min(BAND_PX, height - top)) for top in range(0, height, BAND_PX)
        ]
        return np.concatenate(bands)

    def draw_quickly(self, view: View, way_px: FloatArray) -> ImageArray:
        """Draw it fast: for a camera that moves. Its colours follow from its greys.

        Parameters
        ----------
        view : View
            The camera in the middle of the exposure.
        way_px : (2,) array [px]
            How far the middle of the image moves meanwhile: its blur.

        Returns
        -------
        image : (H, W, 3) array
            Without anything on it.
        """
        if self._grey is None:
            self._grey = GreyTile(self._picture)
        grey, missing = warp_strips(self._grey, view, self._texels)
        if float(np.hypot(*way_px)) > LEAST_BLUR_PX:
            grey = self._grey.blur(grey, way_px)
        image = self._grey.colour(grey)
        for top, count in missing:
            image[top : top + count] = self._band(view, top, count, fine=1)
        return image

    def _band(self, view: View, top: int, count: int, fine: int = FINE) -> ImageArray:
        width = view.image_size_px[0]
        rows, columns = count * fine, width * fine
        u = (grid_positions(columns, STEP) + 0.5) / fine - 0.5
        v = (grid_positions(rows, STEP) + 0.5) / fine - 0.5 + top
        places, away = self._texels(view, u, v)
        level = self._level(places)
        limit = FARTHEST * 2**level
        places = np.clip(np.nan_to_num(places, nan=limit), -limit, limit)
        full = spread(places, (STEP, STEP), (columns, rows))
        image = shrink(self._pyramid.sample(full, level), (width, count))
        if not np.isfinite(away).all() or np.nanmax(away) > CLEAR_M:
            clear = np.where(np.isfinite(away), np.exp(-((np.nan_to_num(away) / HAZE_M) ** 2)), 0.0)
            share = spread(clear[..., None], (STEP, STEP), (columns, rows))
            share = share.reshape(count, fine, width, fine).mean(axis=(1, 3))[..., None]
            image = np.rint(self._sky + share * (image - self._sky)).astype(np.uint8)
        return image

    def _texels(self, view: View, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Column and row in the tile (rows, columns, 2), and how far it is [m]; NaN on and above the horizon."""
        flat = _through_lens(view.lens, u.tobytes(), v.tobytes())
        planes = view.planes_at(v, 0.0)
        x, y, z = np.moveaxis(planes[:, :, :2] @ flat + planes[:, :, 2:], 1, 0)
        z = np.where(z > 1e-9, z, np.nan)
        x, y = x / z, y / z
        away = np.hypot(x - view.eye[0], y - view.eye[1])
        T = self._texel_from_ground
        return np.stack([x * T[0, 0] + T[0, 2], y * T[0, 0] + T[1, 2]], axis=-1), away

    def _level(self, places: FloatArray) -> int:
        """Texels as far apart as the samples along the denser way, or half as far as along the other."""
        aside = np.hypot(*np.moveaxis(np.diff(places, axis=1), -1, 0)) / STEP
        down = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0)) / STEP
        if not (np.isfinite(aside).any() and np.isfinite(down).any()):
            return len(self._pyramid.levels) - 1
        one, other = float(np.nanmedian(aside)), float(np.nanmedian(down))
        return self._pyramid.level_for(max(min(one, other), max(one, other) / 2))


@lru_cache(maxsize=4)
def _through_lens(lens: Lens | None, columns: bytes, rows: bytes) -> FloatArray:
    """(rows, 2, columns). Pixels of a grid as a pinhole would show them; a camera asks for few grids, often."""
    grid = np.stack(np.meshgrid(np.frombuffer(columns), np.frombuffer(rows)), axis=-1)
    flat = grid if lens is None else lens.undistort(grid)
    flat = np.ascontiguousarray(flat.transpose(0, 2, 1))
    flat.flags.writeable = False
    return flat
