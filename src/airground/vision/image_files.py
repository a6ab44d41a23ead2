"""Images as files."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2

from airground.errors import FileError

if TYPE_CHECKING:
    from pathlib import Path

    from airground.vision.frame import ImageArray

__all__ = ["write_png"]


def write_png(path: Path, image: ImageArray) -> None:
    """Write an image without loss.

    Parameters
    ----------
    path : Path
        File to write.
    image : (H, W, 3) or (H, W) array of uint8
        Blue, green, red, or grey.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    _, data = cv2.imencode(".png", image)
    try:
        path.write_bytes(data.tobytes())
    except OSError as error:
        raise FileError(str(path), f"cannot be written: {error.strerror or error}") from error
