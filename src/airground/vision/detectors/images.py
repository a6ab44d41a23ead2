"""Views of a frame that detectors share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from airground.vision.frame import Frame, ImageArray

__all__ = ["colour_of", "grey_of"]


def grey_of(frame: Frame) -> ImageArray:
    """Brightness of a frame.

    Parameters
    ----------
    frame : Frame
        Grey or colour.

    Returns
    -------
    grey : (H, W) array
        The image itself where it is grey.
    """
    image = frame.image
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def colour_of(frame: Frame) -> ImageArray:
    """A frame in three channels.

    Parameters
    ----------
    frame : Frame
        Grey or colour.

    Returns
    -------
    image : (H, W, 3) array
        Blue, green, red; the image itself where it has them.
    """
    image = frame.image
    if image.ndim == 3:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
