"""Videos whose every picture and time is known, because the tests make them."""

from __future__ import annotations

import struct
from fractions import Fraction
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from airground.vision.frame import ImageArray


def numbered(k: int, size_px: tuple[int, int] = (64, 48)) -> ImageArray:
    """A picture that tells its number: grey, by twenty levels brighter each time; see `number_of`."""
    return np.full((size_px[1], size_px[0], 3), 20 * k + 10, dtype=np.uint8)


def number_of(image: ImageArray) -> int:
    return round((float(np.mean(image)) - 10) / 20)


def record(
    path: Path,
    pts: Sequence[int],
    *,
    codec: str = "libx264",
    pix_fmt: str = "yuv420p",
    clock_hz: int = 90000,
    options: dict[str, str] | None = None,
    images: Sequence[ImageArray] | None = None,
) -> Path:
    """Write pictures with PyAV at times of our choice: picture k is at ``pts[k] / clock_hz``."""
    av: Any = pytest.importorskip("av", reason="PyAV is not installed")
    images = [numbered(k) for k in range(len(pts))] if images is None else images
    with av.open(str(path), "w", options={"movflags": "faststart"}) as container:
        stream = container.add_stream(codec, rate=25, options=options or {})
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt = pix_fmt
        stream.codec_context.time_base = stream.time_base = Fraction(1, clock_hz)
        for stamp, image in zip(pts, images, strict=True):
            frame = av.VideoFrame.from_ndarray(image, format="bgr24")
            frame.pts, frame.time_base = stamp, Fraction(1, clock_hz)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def turn(path: Path, quarters_clockwise: int) -> None:
    """Write into an MP4 how it is to be turned when shown (ISO 14496-12, section 8.3.2: matrix of the track)."""
    a, b = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarters_clockwise % 4]
    matrix = struct.pack(">9i", a << 16, b << 16, 0, -b << 16, a << 16, 0, 0, 0, 1 << 30)
    data = bytearray(path.read_bytes())
    start = data.index(b"tkhd") + 4 + 40
    data[start : start + 36] = matrix
    path.write_bytes(bytes(data))


def until(condition: Callable[[], bool], *, within_s: float = 30.0) -> None:
    """Wait for something that another thread or program does."""
    end = monotonic() + within_s
    while not condition():
        assert monotonic() < end, "it did not happen"
        sleep(0.005)
