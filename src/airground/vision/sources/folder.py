"""Folders of images."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.errors import FileError
from airground.vision.frame import Frame
from airground.vision.sources.base import PulledSource
from airground.vision.sources.image_times import (
    TABLE,
    TIME_LISTS,
    natural_key,
    time_in_name,
    times_beside,
)
from airground.vision.sources.quiet import quiet_opencv

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from airground.vision.frame import Clock, ImageArray

__all__ = ["ImageFolder", "read_image"]

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")

JPEG, PNG = b"\xff\xd8", b"\x89PNG"
JPEG_END, PNG_END = b"\xff\xd9", b"IEND"


class ImageFolder(PulledSource):
    """Frames from the images in a folder: PNG, JPEG, BMP, TIFF; subfolders are not looked into.

    Times come, in this order, from `rate_hz`, from ``times.csv``, ``timestamps.txt`` or ``times.txt`` in the folder, or
    from the images' names (see `times_beside` and `time_in_name`). They are kept as they are: their zero may be 1970.

    Parameters
    ----------
    path : Path
        The folder.
    rate_hz : float, optional
        Frame rate of the images, in the natural order of their names; the first is at zero.

    Raises
    ------
    FileError
        If there are no images, or no times for them.
    """

    def __init__(self, path: Path, *, rate_hz: float | None = None) -> None:
        names = _images(path)
        times, clock = _times(path, names, rate_hz)
        self._path = path
        self._times = sorted((t, name) for name, t in times.items())
        self._refuse_repeated_times()
        super().__init__(str(path), clock, len(self._times))
        if left_out := len(names) - len(times):
            self._tally.note(f"{left_out} images are not named in {TABLE} and were left out")

    def _refuse_repeated_times(self) -> None:
        for (t, name), (after, other) in zip(self._times, self._times[1:], strict=False):
            if t == after:
                raise FileError(str(self._path), f"{name} and {other} have one time, {t} s")

    def _frames(self) -> Iterator[Frame]:
        size = None
        for index, (t, name) in enumerate(self._times):
            image = read_image(self._path / name)
            if image is None:
                self._tally.add("corrupt")
                self._tally.note(f"{name} is not an image that can be read, and was left out")
                continue
            size = size or image.shape
            if image.shape != size:
                raise FileError(
                    str(self._path / name),
                    f"has {image.shape[1]}x{image.shape[0]} pixels where those before have {size[1]}x{size[0]}",
                )
            yield Frame(image, t, self.clock, index)
        if size is None:
            raise FileError(str(self._path), "none of its images can be read")


def read_image(path: Path) -> ImageArray | None:
    """Read an image as it is meant to be seen: turned as its EXIF data say, and 8 bits deep.

    Parameters
    ----------
    path : Path
        PNG, JPEG, BMP, TIFF or what else OpenCV reads.

    Returns
    -------
    image : (H, W, 3) array or None
        Blue, green, red; None where the file is missing, broken, or cut short.
    """
    try:
        data = path.read_bytes()
    except OSError:
        return None
    if not data or _cut_short(data):
        return None
    with quiet_opencv():
        try:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        except cv2.error:
            return None
    return None if image is None else np.asarray(image, dtype=np.uint8)


def _cut_short(data: bytes) -> bool:
    """OpenCV fills the missing half of a picture with grey, without a word."""
    tail = data[len(data) // 2 :]  # the thumbnail before it has an end too
    if data.startswith(JPEG):
        return JPEG_END not in tail
    return data.startswith(PNG) and PNG_END not in tail


def _images(path: Path) -> list[str]:
    try:
        names = [
            entry.name
            for entry in path.iterdir()
            if entry.suffix.lower() in SUFFIXES and entry.is_file()
        ]
    except PermissionError:
        raise FileError(str(path), "no permission to read it") from None
    except OSError as error:
        raise FileError(str(path), f"cannot read it: {error.strerror or error}") from None
    visible = sorted((name for name in names if not name.startswith(".")), key=natural_key)
    if not visible:
        raise FileError(str(path), f"has no images ({', '.join(SUFFIXES)})")
    return visible


def _times(
    path: Path, names: Sequence[str], rate_hz: float | None
) -> tuple[dict[str, float], Clock]:
    if rate_hz is not None:
        return {name: k / rate_hz for k, name in enumerate(names)}, "rate"
    beside = times_beside(path, names)
    if beside is not None:
        return beside, "name"
    times = {name: time_in_name(name.rpartition(".")[0]) for name in names}
    untimed = next((name for name, t in times.items() if t is None), None)
    if untimed is not None:
        raise FileError(
            str(path),
            f"the name {untimed} holds no time; give the frame rate, or the times in {TABLE} (columns file, t_s) "
            f"or {TIME_LISTS[0]} (one line each) in the folder",
        )
    return {name: t for name, t in times.items() if t is not None}, "name"
