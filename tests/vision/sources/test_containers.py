from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import pytest

from airground.vision.sources.containers import Container, look_into

if TYPE_CHECKING:
    from pathlib import Path


def box(name: bytes, length: int, *, long: bool = False, stated: int | None = None) -> bytes:
    if long:
        return struct.pack(">I4sQ", 1, name, length) + bytes(length - 16)
    return struct.pack(">I4s", length if stated is None else stated, name) + bytes(length - 8)


WHOLE = box(b"ftyp", 24) + box(b"moov", 100) + box(b"mdat", 500)


@pytest.mark.parametrize(
    ("data", "container"),
    [
        (WHOLE, Container("mp4")),
        (WHOLE[:-1], Container("mp4", cut_short=True)),
        (box(b"ftyp", 24) + box(b"mdat", 500), Container("mp4", indexed=False)),
        (box(b"ftyp", 24) + box(b"mdat", 90, long=True) + box(b"moov", 9), Container("mp4")),
        (box(b"ftyp", 24) + box(b"moov", 9) + box(b"mdat", 90, stated=0), Container("mp4")),
        (box(b"ftyp", 24) + box(b"moov", 9) + box(b"junk", 90, stated=3), Container("mp4")),
        (b"RIFF\x00\x00\x00\x00AVI LIST", Container("avi")),
        (b"RIFF\x00\x00\x00\x00WAVEfmt ", Container("other")),
        (b"\x1aE\xdf\xa3", Container("other")),
        (b"\xff\xd8\xff\xe0\x00\x10JFIF", Container("raw")),
        (b"\x00\x00\x00\x01\x67\x42\x00", Container("raw")),
        (b"\x00\x00\x01\xb3", Container("raw")),
        (b"\x00\x00\x01\xba\x44", Container("other")),
        (b"", Container("other")),
    ],
)
def test_kinds(tmp_path: Path, data: bytes, container: Container) -> None:
    path = tmp_path / "a"
    path.write_bytes(data)
    assert look_into(path) == container
