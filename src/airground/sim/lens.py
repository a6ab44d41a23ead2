"""The lens of the simulated camera: the division model, both ways in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Self

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.recordings import distort

__all__ = ["Lens"]


@dataclass(frozen=True, slots=True)
class Lens:
    """Radial distortion by the division model ``r_u = r_d / (1 + k1 r_d^2)``; k1 of 0 is no distortion."""

    k1_per_px2: float
    """Coefficient, for radii in pixels [1/px^2]; negative for barrel distortion."""

    centre_px: tuple[float, float]
    """Where the lens does not distort [px]."""

    def __post_init__(self) -> None:
        if not (isfinite(self.k1_per_px2) and all(map(isfinite, self.centre_px))):
            raise InputError("k1_per_px2 and centre_px must be finite")

    @classmethod
    def of_image(cls, k1: float, image_size_px: tuple[int, int]) -> Self:
        """Lens centred on an image, its coefficient for radii over half the image's diagonal.

        Parameters
        ----------
        k1 : float
            Coefficient; -0.1 bends the corners inwards by about 10 %.
        image_size_px : (int, int) [px]
            Width and height.

        Returns
        -------
        lens : Lens
            With the coefficient in pixels.
        """
        width, height = image_size_px
        return cls(4 * k1 / (width**2 + height**2), ((width - 1) / 2, (height - 1) / 2))

    def distort(self, uv: FloatArray) -> FloatArray:
        """Where the lens shows points.

        Parameters
        ----------
        uv : (..., 2) array [px]
            Points as a pinhole shows them.

        Returns
        -------
        uv : (..., 2) array [px]
            As they are in the image; NaN where the lens shows no such point.
        """
        if self.k1_per_px2 == 0.0:
            return uv
        return distort(uv, self.k1_per_px2, np.array(self.centre_px))

    def undistort(self, uv: FloatArray) -> FloatArray:
        """Where a pinhole would show points of the image.

        Parameters
        ----------
        uv : (..., 2) array [px]
            Points of the image.

        Returns
        -------
        uv : (..., 2) array [px]
            Without distortion; NaN beyond the lens's rim, if it has one.
        """
        if self.k1_per_px2 == 0.0:
            return uv
        off = uv - np.array(self.centre_px)
        rim = 1 + self.k1_per_px2 * np.sum(off**2, axis=-1, keepdims=True)
        return np.asarray(np.array(self.centre_px) + off / np.where(rim > 0, rim, np.nan))
