"""What the first bytes of a video file tell before any decoder sees it."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["Container", "look_into"]

JPEG = b"\xff\xd8\xff"

# H.264, H.265 and MPEG without a container begin so, and so does an MPEG program stream, which has times in its packs.
START_CODES = (b"\x00\x00\x00\x01", b"\x00\x00\x01")
PACK = b"\x00\x00\x01\xba"

LONG_SIZE = 1  # the size follows as 64 bits
TO_THE_END = 0


@dataclass(frozen=True, slots=True)
class Container:
    """How a video file is built."""

    kind: Literal["mp4", "avi", "raw", "other"]
    """MP4 and MOV are alike; AVI holds a frame rate and no times; raw pictures one after the other hold neither."""

    cut_short: bool = False
    """The file ends inside a part whose length it states. Known for MP4 only."""

    indexed: bool = True
    """It has the index without which an MP4 cannot be read; cameras write that last."""


def look_into(path: Path) -> Container:
    """Read what kind of container a file is, and whether it is whole.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    container : Container
        "other" for everything else.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(12)
        if head[:4] == b"RIFF" and head[8:12] == b"AVI ":
            return Container("avi")
        if head.startswith(JPEG) or (head.startswith(START_CODES) and PACK not in head):
            return Container("raw")
        if head[4:8] != b"ftyp":
            return Container("other")
        # ISO 14496-12, section 4.2: boxes of a size and a name, one after the other.
        position, names = 0, set()
        while position + 8 <= size:
            file.seek(position)
            length, name = struct.unpack(">I4s", file.read(8))
            if length == LONG_SIZE:
                length = int.from_bytes(file.read(8), "big")
            elif length == TO_THE_END:
                length = size - position
            if length < 8:
                break  # not a box
            names.add(name)
            position += length
    return Container("mp4", cut_short=position > size, indexed=b"moov" in names)
