"""Pictures at halved sizes, and sampling them: far things are drawn from small copies, so that they do not shimmer."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, log2
from typing import Self

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray
from airground.vision.frame import ImageArray
from airground.vision.raster.maps import Float32Array

__all__ = ["Pyramid", "shrink"]


def shrink(image: ImageArray, size: tuple[int, int]) -> ImageArray:
    """Mean over the samples of each pixel.

    Parameters
    ----------
    image : (H, W[, C]) array
        Whole multiples of the new size.
    size : (int, int)
        New width and height.

    Returns
    -------
    image : (height, width[, C]) array
        Rounded means.
    """
    width, height = size
    # OpenCV is ten times as fast for halves as for other fractions.
    while image.shape[1] % (2 * width) == 0 and image.shape[0] % (2 * height) == 0:
        half = (image.shape[1] // 2, image.shape[0] // 2)
        image = np.asarray(cv2.resize(image, half, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    if image.shape[:2] == (2 * height, width):
        return np.asarray(cv2.addWeighted(image[0::2], 0.5, image[1::2], 0.5, 0.0), dtype=np.uint8)
    if image.shape[:2] == (height, width):
        return image
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Pyramid:
    """A picture and its smaller copies. Texel (0, 0) of level 0 has its centre at (0, 0)."""

    levels: tuple[ImageArray, ...]
    """Each half as wide and high as the one before it."""

    repeats: bool
    """Does the picture go on at its edges as it began? Otherwise it is zero outside."""

    @classmethod
    def of(cls, picture: ImageArray, *, repeats: bool = False, levels: int = 12) -> Self:
        """Build all levels.

        Parameters
        ----------
        picture : (H, W[, C]) array
            Level 0.
        repeats : bool
            Is it a tile?
        levels : int
            Most there may be.

        Returns
        -------
        pyramid : Pyramid
            A picture that is no tile is padded with zeros until it can be halved.
        """
        height, width = picture.shape[:2]
        count = 0
        while count < levels - 1 and min(height, width) >= 4 << count:
            if repeats and (height >> count & 1 or width >> count & 1):
                break
            count += 1
        if not repeats:
            unit = 1 << count
            pad = [(0, -height % unit), (0, -width % unit)] + [(0, 0)] * (picture.ndim - 2)
            picture = np.pad(picture, pad)
        every = [np.ascontiguousarray(picture)]
        for _ in range(count):
            height, width = every[-1].shape[:2]
            every.append(shrink(every[-1], (width // 2, height // 2)))
        return cls(tuple(every), repeats)

    def level_for(self, texels_per_sample: float) -> int:
        """Level whose texels are about as far apart as the samples.

        Parameters
        ----------
        texels_per_sample : float
            Distance of two samples, in texels of level 0.

        Returns
        -------
        level : int
            The nearest one, in ratio.
        """
        return min(max(round(log2(max(texels_per_sample, 1e-6))), 0), len(self.levels) - 1)

    def sample(self, places: Float32Array, level: int) -> ImageArray:
        """Read a level at places between its texels.

        Parameters
        ----------
        places : (H, W, 2) array of float32
            Column and row, in texels of level 0; must lie within 32,000 texels of the level.
        level : int
            Which level to read.

        Returns
        -------
        image : (H, W[, C]) array
            Bilinear.
        """
        if level:
            places = (places + np.float32(0.5)) * np.float32(0.5**level) - np.float32(0.5)
        border = cv2.BORDER_WRAP if self.repeats else cv2.BORDER_CONSTANT
        read = cv2.remap(  # type: ignore[call-overload]
            self.levels[level], places, None, cv2.INTER_LINEAR, borderMode=border, borderValue=0
        )
        return np.asarray(read, dtype=np.uint8)

    def warp(
        self, texel_from_sample: FloatArray, size: tuple[int, int], scale: float = 1.0
    ) -> ImageArray:
        """Read it through a homography, from the level that suits the middle of the result.

        Parameters
        ----------
        texel_from_sample : (3, 3) array
            From samples (column, row, 1) to texels of level 0.
        size : (int, int)
            Width and height of the result.
        scale : float
            What the distance of two samples is multiplied by when the level is chosen.

        Returns
        -------
        image : (height, width[, C]) array
            Bilinear; zero outside.
        """
        a, b, c, d, e, f, g, h, i = texel_from_sample.ravel().tolist()
        x, y = size[0] / 2, size[1] / 2
        w = g * x + h * y + i
        u, v = (a * x + b * y + c) / w, (d * x + e * y + f) / w
        steps = [hypot((p - r * u) / w, (q - r * v) / w) for p, q, r in ((a, d, g), (b, e, h))]
        level = self.level_for(scale * max(steps))
        half = 0.5**level
        edge = half / 2 - 0.5
        H = np.array([[half, 0, edge], [0, half, edge], [0, 0, 1.0]]) @ texel_from_sample
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return np.asarray(
            cv2.warpPerspective(self.levels[level], H, size, flags=flags), dtype=np.uint8
        )
