"""One picture looked up in another at fixed places: a lens laid over what a pinhole drew."""

from __future__ import annotations

import cv2
import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.vision.frame import ImageArray

__all__ = ["PixelMap"]


class PixelMap:
    """Where each pixel of a picture is found in another one.

    Parameters
    ----------
    places : (H, W, 2) array [px]
        Column and row in the other picture, of every pixel; kept to a thirty-second of a pixel.

    Raises
    ------
    InputError
        If a place is not finite.
    """

    def __init__(self, places: FloatArray) -> None:
        if not np.isfinite(places).all():
            raise InputError("every pixel must have a place in the other picture")
        columns, rows = (np.asarray(places[..., k], dtype=np.float32) for k in (0, 1))
        self._maps = cv2.convertMaps(columns, rows, cv2.CV_16SC2)

    def apply(self, picture: ImageArray) -> ImageArray:
        """Look a picture up.

        Parameters
        ----------
        picture : (H2, W2, 3) array
            The other one.

        Returns
        -------
        found : (H, W, 3) array
            Bilinear; black outside of it.
        """
        found = cv2.remap(picture, *self._maps, interpolation=cv2.INTER_LINEAR)
        return np.asarray(found, dtype=np.uint8)
