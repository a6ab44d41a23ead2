"""The pinhole picture that a lens is laid over: larger than the camera's, so that its corners are filled."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, tan
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.geometry.lens import DivisionLens

if TYPE_CHECKING:
    from airground.sim3d.options import CameraOptions3d

__all__ = ["Canvas"]

MOST_PX = 6000


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """What a pinhole in the camera's place has to draw."""

    lens: DivisionLens
    """Of the camera, centred on its image."""

    focal_length_px: float
    """Of camera and pinhole [px]."""

    image_size_px: tuple[int, int]
    """Width and height of the camera's image [px]."""

    size_px: tuple[int, int]
    """Width and height of the pinhole's picture [px]."""

    @classmethod
    def of(cls, camera: CameraOptions3d) -> Canvas:
        """Find what a camera needs.

        Parameters
        ----------
        camera : CameraOptions3d
            With its lens.

        Returns
        -------
        canvas : Canvas
            Just large enough.

        Raises
        ------
        InputError
            If the lens bends the corners too far.
        """
        width, height = camera.image_size_px
        middle = np.array([(width - 1) / 2, (height - 1) / 2])
        lens = DivisionLens(4 * camera.k1 / (width**2 + height**2), middle)
        u, v = np.arange(width), np.arange(height)
        border = np.concatenate(
            [_line(u, 0), _line(u, height - 1), _line(0, v), _line(width - 1, v)]
        )
        off = np.abs(lens.undistort(border) - middle).max(axis=0)
        if not np.isfinite(off).all() or off.max() > MOST_PX / 2:
            raise InputError(f"k1 of {camera.k1} bends the image's corners too far")
        half = np.ceil(off).astype(int) + 2
        focal = height / 2 / tan(camera.fovy_rad / 2)
        w, h = (2 * half).tolist()
        return cls(lens, focal, camera.image_size_px, (w, h))

    @property
    def fovy_rad(self) -> float:
        """Angle from the picture's top to its bottom [rad]."""
        return 2 * atan(self.size_px[1] / 2 / self.focal_length_px)

    def places(self) -> FloatArray:
        """Where the image's pixels are in the picture.

        Returns
        -------
        places : (H, W, 2) array [px]
            Column and row.
        """
        width, height = self.image_size_px
        u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        moved = (np.array(self.size_px) - np.array(self.image_size_px)) / 2
        return np.asarray(self.lens.undistort(np.stack([u, v], axis=-1)) + moved)


def _line(u: object, v: object) -> FloatArray:
    a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64))
    return np.column_stack([a, b])
