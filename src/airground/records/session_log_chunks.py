"""Messages of an MCAP file in their order, up to where it is whole; one chunk in memory at a time."""

from __future__ import annotations

import os
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from airground.errors import FileError
from airground.records.access import StrPath, file_error

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mcap.records import McapRecord

__all__ = ["ChunkScan", "RawMessage"]

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0F
LAST_OPCODE = 0x0F
PRIVATE = 0x80  # opcodes from here on are for anybody
LARGEST = 1 << 28  # bytes of a chunk, unpacked; ours have half a megabyte and one message


@dataclass(frozen=True, slots=True)
class RawMessage:
    """A message as it lies in the file."""

    topic: str
    """Where it belongs."""

    schema: str
    """Name of its shape; empty where it has none."""

    ns: int
    """Wall clock [ns]."""

    data: bytes
    """As written."""


class ChunkScan:
    """Reads a file from its beginning, whether or not it has an end.

    Parameters
    ----------
    path : path-like
        The file.
    """

    def __init__(self, path: StrPath) -> None:
        self.path = os.fspath(path)
        self.cut = ""
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str]] = {}

    def __iter__(self) -> Iterator[RawMessage]:
        """Go through the messages; where that ends before the file's proper end, `cut` says why."""
        self.cut = ""
        try:
            with Path(self.path).open("rb") as stream:
                size = os.fstat(stream.fileno()).st_size
                self._open(stream, size)
                yield from self._messages(stream, size)
        except (OSError, ValueError) as error:  # ValueError: a NUL in the name
            if isinstance(error, FileError):
                raise
            raise file_error(self.path, error, "read") from error

    def _open(self, stream: BinaryIO, size: int) -> None:
        found = stream.read(len(MAGIC))
        if found != MAGIC:
            cut = MAGIC.startswith(found)
            problem = "is cut off before anything was recorded" if cut else "is not an MCAP file"
            raise FileError(self.path, "is empty" if size == 0 else problem)

    def _messages(self, stream: BinaryIO, size: int) -> Iterator[RawMessage]:
        while True:
            start = stream.tell()
            head = stream.read(9)
            if len(head) < 9:
                self.cut = f"cut off after {start} bytes"
                return
            opcode, length = struct.unpack("<BQ", head)
            known = 0 < opcode <= LAST_OPCODE or opcode >= PRIVATE
            if not known or length > size - stream.tell():
                self.cut = f"damaged or cut off after {start} bytes"
                return
            if opcode == DATA_END:
                self._check_end(stream, size)
                return
            if opcode not in (SCHEMA, CHANNEL, MESSAGE, CHUNK):
                stream.seek(length, os.SEEK_CUR)
                continue
            if length > LARGEST:
                self.cut = f"damaged after {start} bytes: a record of {length} bytes"
                return
            try:
                records = _records(opcode, stream.read(length))
            except (ValueError, struct.error) as error:
                self.cut = f"damaged after {start} bytes: {error}"
                return
            yield from self._taken(records)

    def _taken(self, records: list[McapRecord]) -> Iterator[RawMessage]:
        from mcap.records import Channel, Message, Schema

        for record in records:
            if isinstance(record, Schema):
                self._schemas[record.id] = record.name
            elif isinstance(record, Channel):
                schema = self._schemas.get(record.schema_id, "")
                self._channels[record.id] = (record.topic, schema)
            elif isinstance(record, Message) and record.channel_id in self._channels:
                topic, schema = self._channels[record.channel_id]
                yield RawMessage(topic, schema, record.log_time, record.data)

    def _check_end(self, stream: BinaryIO, size: int) -> None:
        stream.seek(max(size - len(MAGIC), 0))
        if stream.read() != MAGIC:
            self.cut = "cut off within the index at its end"


def _records(opcode: int, data: bytes) -> list[McapRecord]:
    """Records in one that is whole; ValueError where they make no sense."""
    from mcap.exceptions import McapError

    head = struct.pack("<BQ", opcode, len(data))
    try:
        return _split(_unpacked(data) if opcode == CHUNK else head + data)
    except McapError as error:
        raise ValueError("a record ends too early") from error


def _split(data: bytes) -> list[McapRecord]:
    from io import BytesIO

    from mcap.data_stream import ReadDataStream
    from mcap.records import Channel, Message, Schema

    records: list[McapRecord] = []
    at = 0
    while at < len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        at += 9
        if length > len(data) - at:
            raise ValueError("a record ends too early")
        if opcode in (SCHEMA, CHANNEL, MESSAGE):
            stream = ReadDataStream(BytesIO(data[at : at + length]))
            if opcode == SCHEMA:
                records.append(Schema.read(stream))
            elif opcode == CHANNEL:
                records.append(Channel.read(stream))
            else:
                records.append(Message.read(stream, length))
        at += length
    return records


def _unpacked(data: bytes) -> bytes:
    """What a chunk holds, checked by its checksum."""
    _, _, size, crc, name_length = struct.unpack_from("<QQQII", data)
    name = data[32 : 32 + name_length].decode("ascii", "replace")
    packed = memoryview(data)[32 + name_length + 8 :]
    if size > LARGEST:
        raise ValueError(f"a chunk of {size} bytes is too large")
    if name == "zstd":
        plain = _zstd(packed, size)
    elif name == "lz4":
        plain = _lz4(packed, size)
    elif name == "":
        plain = bytes(packed)
    else:
        raise ValueError(f"compression {name!r} is not known")
    if len(plain) != size or (crc and zlib.crc32(plain) != crc):
        raise ValueError("a chunk's checksum is wrong")
    return plain


def _zstd(packed: memoryview, size: int) -> bytes:
    import zstandard

    try:
        stream = zstandard.ZstdDecompressor().stream_reader(packed)
        return stream.read(size + 1)  # bounded, whatever the frame says of itself
    except zstandard.ZstdError as error:
        raise ValueError("a chunk cannot be unpacked") from error


def _lz4(packed: memoryview, size: int) -> bytes:
    import lz4.frame  # type: ignore[import-untyped]

    try:
        plain: bytes = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
    except RuntimeError as error:
        raise ValueError("a chunk cannot be unpacked") from error
    return plain
