"""Images as JPEG: small enough for a network or a recording, at the price of a little noise."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from airground.errors import InputError
from airground.vision.frame import ImageArray

__all__ = ["QUALITY", "Jpeg", "decode_jpeg", "encode_jpeg"]

QUALITY = 75
"""Usual quality: 1280x720 of a rendered scene comes to about 100 kB, and no edge is visibly worse."""


@dataclass(frozen=True, slots=True, eq=False)
class Jpeg:
    """A coded image."""

    data: bytes
    """As a file would hold it."""

    size_px: tuple[int, int]
    """Width and height [px]."""


def encode_jpeg(image: ImageArray, *, width_px: int | None = None, quality: int = QUALITY) -> Jpeg:
    """Code an image; OpenCV lets go of Python's lock meanwhile, so that this may run in a thread.

    Parameters
    ----------
    image : (H, W, 3) or (H, W) array of uint8
        Blue, green, red, or grey.
    width_px : int, optional [px]
        Shrink it to this width, as much in height; never enlarges. As it is where not given.
    quality : int
        1 to 100.

    Returns
    -------
    jpeg : Jpeg
        With the size that it came to.

    Raises
    ------
    InputError
        If it is no image, or width or quality are out of range.
    """
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or 0 in image.shape:
        raise InputError(f"an image must be (H, W, 3) of uint8, not {image.shape} of {image.dtype}")
    if not 1 <= quality <= 100:
        raise InputError(f"quality must be from 1 to 100, not {quality}")
    if width_px is not None and width_px < 1:
        raise InputError(f"width_px must be positive, not {width_px}")
    height, width = image.shape[:2]
    if width_px is not None and width_px < width:
        size = (width_px, max(round(height * width_px / width), 1))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    try:
        done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    except cv2.error as error:  # sides beyond 65500 px, four channels of some versions
        raise InputError(f"an image of shape {image.shape} cannot be coded as JPEG") from error
    if not done:
        raise InputError(f"an image of shape {image.shape} cannot be coded as JPEG")
    return Jpeg(data.tobytes(), (image.shape[1], image.shape[0]))


def decode_jpeg(data: bytes) -> ImageArray:
    """Bring back a coded image.

    Parameters
    ----------
    data : bytes
        As `encode_jpeg` gave it.

    Returns
    -------
    image : (H, W, 3) array of uint8
        Blue, green, red; also where it was grey.

    Raises
    ------
    InputError
        If it is no image.
    """
    try:
        image = (
            cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR) if data else None
        )
    except cv2.error:
        image = None
    if image is None:
        raise InputError(f"these {len(data)} bytes are no JPEG image")
    return np.asarray(image, dtype=np.uint8)
