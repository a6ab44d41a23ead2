"""An MCAP file that is readable wherever it is cut off.

Messages are gathered for a moment, packed into a chunk and handed to the system in one piece, so that a process that
is killed leaves whole chunks behind, and one that cannot write any more takes the broken piece back. The records are
the mcap package's; its writer is not used, as it holds its index as objects (a kilobyte and a half for each chunk,
for hours) and cannot take anything back.
"""

from __future__ import annotations

import os
import zlib
from collections import Counter
from contextlib import suppress
from typing import TYPE_CHECKING

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    MessageIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from airground._version import __version__

if TYPE_CHECKING:
    from mcap.records import McapRecord

    from airground.records.access import StrPath

__all__ = ["SessionFile"]

MAGIC = b"\x89MCAP0\r\n"
LEVEL = 1
"""Of zstd: on numbers written as text the higher ones take more time and more room."""


class SessionFile:
    """A new MCAP file. For one thread; methods raise OSError where the system does.

    Parameters
    ----------
    path : path-like
        Where to; refused where there is a file already.
    """

    def __init__(self, path: StrPath) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0)
        self._fd = os.open(path, flags | getattr(os, "O_BINARY", 0), 0o666)
        self._end = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._indexes = RecordBuilder()
        self._chunks = 0
        self._counts: Counter[int] = Counter()
        self._first_ns: int | None = None
        self._last_ns = 0
        self._compressor = zstandard.ZstdCompressor(level=LEVEL)
        self._new_chunk()
        library = f"airground {__version__}"
        self._write(MAGIC + _bytes(Header(profile="", library=library)))

    def _new_chunk(self) -> None:
        self._chunk = RecordBuilder()
        self._places: dict[int, list[tuple[int, int]]] = {}

    @property
    def pending(self) -> int:
        """Bytes that are gathered and not yet written."""
        return self._chunk.count

    def add_schema(self, name: str, text: bytes) -> int:
        """Declare the shape of messages.

        Parameters
        ----------
        name : str
            Of the schema.
        text : bytes
            JSON Schema.

        Returns
        -------
        number : int
            For `add_channel`.
        """
        schema = Schema(id=len(self._schemas) + 1, name=name, encoding="jsonschema", data=text)
        self._schemas.append(schema)
        schema.write(self._chunk)
        return schema.id

    def add_channel(self, topic: str, schema: int) -> int:
        """Declare a topic.

        Parameters
        ----------
        topic : str
            Its name.
        schema : int
            Shape of its messages.

        Returns
        -------
        number : int
            For `add`.
        """
        number = len(self._channels) + 1
        channel = Channel(
            id=number, topic=topic, message_encoding="json", metadata={}, schema_id=schema
        )
        self._channels.append(channel)
        channel.write(self._chunk)
        return number

    def add(self, channel: int, ns: int, data: bytes) -> None:
        """Gather a message.

        Parameters
        ----------
        channel : int
            Where it belongs.
        ns : int [ns]
            Wall clock.
        data : bytes
            JSON.
        """
        entries = self._places.setdefault(channel, [])
        sequence = (self._counts[channel] + len(entries)) & 0xFFFFFFFF
        entries.append((ns, self._chunk.count))
        Message(
            channel_id=channel, log_time=ns, publish_time=ns, sequence=sequence, data=data
        ).write(self._chunk)

    def flush(self) -> None:
        """Write what is gathered, all of it or nothing."""
        if not self._places:
            return
        plain, places = _emptied(self._chunk), self._places
        self._new_chunk()
        times = [ns for entries in places.values() for ns, _ in entries]
        first, last = min(times), max(times)
        packed = self._compressor.compress(plain)
        chunk = _bytes(
            Chunk(
                compression="zstd",
                data=packed,
                message_start_time=first,
                message_end_time=last,
                uncompressed_crc=zlib.crc32(plain),
                uncompressed_size=len(plain),
            )
        )
        start, after = self._end, RecordBuilder()
        offsets = {}
        for channel, entries in places.items():
            offsets[channel] = start + len(chunk) + after.count
            MessageIndex(channel, entries).write(after)
        length = after.count
        self._write(chunk + _emptied(after))
        ChunkIndex(
            chunk_length=len(chunk),
            chunk_start_offset=start,
            compression="zstd",
            compressed_size=len(packed),
            message_end_time=last,
            message_index_length=length,
            message_index_offsets=offsets,
            message_start_time=first,
            uncompressed_size=len(plain),
        ).write(self._indexes)
        self._chunks += 1
        self._counts.update({channel: len(entries) for channel, entries in places.items()})
        self._first_ns = first if self._first_ns is None else min(first, self._first_ns)
        self._last_ns = max(last, self._last_ns)

    def sync(self) -> None:
        """Wait until what was written is on the disk."""
        os.fsync(self._fd)

    def finish(self) -> None:
        """Write the index, and close the file. Without it the file can be read, but not searched by time."""
        try:
            self.flush()
            self._write(self._summary())
            self.sync()
        finally:
            self.abandon()

    def abandon(self) -> None:
        """Close the file as it is; again does nothing."""
        fd, self._fd = self._fd, -1
        if fd >= 0:
            os.close(fd)

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._fd, view) :]
        except OSError:
            with suppress(OSError):  # half a chunk is of no use, and its room may do for the index
                os.ftruncate(self._fd, self._end)
                os.lseek(self._fd, self._end, os.SEEK_SET)
            raise
        self._end += len(data)

    def _summary(self) -> bytes:
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=self._chunks,
            message_count=sum(self._counts.values()),
            message_end_time=self._last_ns,
            message_start_time=self._first_ns or 0,
            metadata_count=0,
            schema_count=len(self._schemas),
        )
        groups = {
            Opcode.SCHEMA: b"".join(map(_bytes, self._schemas)),
            Opcode.CHANNEL: b"".join(map(_bytes, self._channels)),
            Opcode.STATISTICS: _bytes(statistics),
            Opcode.CHUNK_INDEX: _emptied(self._indexes),
        }
        data_end = _bytes(DataEnd(0))
        start = self._end + len(data_end)
        summary, offsets = b"", b""
        for opcode, group in groups.items():
            if group:
                place = start + len(summary)
                offsets += _bytes(SummaryOffset(opcode, place, len(group)))
                summary += group
        footer = Footer(
            summary_start=start, summary_offset_start=start + len(summary), summary_crc=0
        )
        summary += offsets
        covered = summary + _bytes(footer)[:-4]  # all but the checksum itself
        footer.summary_crc = zlib.crc32(covered)
        return data_end + summary + _bytes(footer) + MAGIC


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return _emptied(builder)


def _emptied(builder: RecordBuilder) -> bytes:
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
