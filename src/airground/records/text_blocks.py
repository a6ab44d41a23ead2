"""A text file as blocks of whole lines, with line numbers that stay right.

Bytes are cut at line ends before they are decoded, so that a block never splits a character and a
bad byte has a line. Memory is one block, however long the file.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, NoReturn

from airground.errors import FileError
from airground.records.access import StrPath, file_error

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["BLOCK_BYTES", "Block", "read_blocks"]

BLOCK_BYTES = 1 << 18
"""Bytes read at a time; also the longest line that is still taken for text."""

_BOM = b"\xef\xbb\xbf"
_NOT_TEXT = {
    b"\xff\xfe": "is in UTF-16; save it as UTF-8",
    b"\xfe\xff": "is in UTF-16; save it as UTF-8",
    b"\x1f\x8b": "is a gzip file; unpack it first",
    b"PK\x03\x04": "is a ZIP archive or a spreadsheet; save it as CSV",
}


@dataclass(frozen=True, slots=True)
class Block:
    """Some lines of a file that follow each other."""

    first: int
    """Number of the first line in the file; the file's first is 1."""

    lines: list[str]
    """The lines without their ends."""

    last: bool
    """Whether the file ends here."""

    ended: bool
    """Whether the last of the lines has a line end."""


def read_blocks(path: StrPath) -> Iterator[Block]:
    r"""Read a text file in UTF-8, with or without a byte order mark.

    Lines end with "\n", "\r\n" or "\r".

    Parameters
    ----------
    path : path-like
        The file.

    Yields
    ------
    block : Block
        Whole lines; none for an empty file.

    Raises
    ------
    FileError
        If the file cannot be read, is not text in UTF-8, or has a line of more than BLOCK_BYTES.
    """
    name = os.fspath(path)
    try:
        with Path(name).open("rb") as stream:
            yield from _cut(name, stream)
    except FileError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise file_error(name, error, "read") from error


def _cut(name: str, stream: BinaryIO) -> Iterator[Block]:
    data = stream.read(BLOCK_BYTES)
    for mark, problem in _NOT_TEXT.items():
        if data.startswith(mark):
            raise FileError(name, problem)
    data = data.removeprefix(_BOM)
    line, rest = 1, b""
    while data:
        following = stream.read(BLOCK_BYTES)
        rest += data
        end = _last_line_end(rest) if following else len(rest)
        if end == 0 and len(rest) > BLOCK_BYTES:
            problem = f"the line is longer than {BLOCK_BYTES} bytes; is this a CSV file?"
            raise FileError(name, problem, line=line)
        if end:
            block = _decode(name, line, rest[:end], last=not following)
            yield block
            line += len(block.lines)
        data, rest = following, rest[end:]


def _last_line_end(data: bytes) -> int:
    """Where the last whole line ends; a final CR may be half of a CR LF."""
    return max(data.rfind(b"\n"), data.rfind(b"\r", 0, -1)) + 1


def _decode(name: str, first: int, data: bytes, *, last: bool) -> Block:
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    zero = data.find(b"\0")
    if zero >= 0:
        problem = "found a zero byte, expected text; save it as CSV in UTF-8"
        raise FileError(name, problem, line=first + data.count(b"\n", 0, zero))
    try:
        lines = data.decode().split("\n")
    except UnicodeDecodeError as error:
        _refuse_byte(name, first, data, error)
    ended = lines[-1] == ""
    if ended:
        del lines[-1]
    return Block(first=first, lines=lines, last=last, ended=ended)


def _refuse_byte(name: str, first: int, data: bytes, error: UnicodeDecodeError) -> NoReturn:
    problem = f"byte 0x{data[error.start]:02x} is not UTF-8; save the file as UTF-8"
    line = first + data.count(b"\n", 0, error.start)
    raise FileError(name, problem, line=line) from error
