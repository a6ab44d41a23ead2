"""What all commands print, and how."""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import stat
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from airground.errors import FileError, InputError
from airground.records.access import file_error
from airground.records.cells import shown

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

__all__ = [
    "Notes",
    "image_size",
    "note",
    "print_json",
    "printable",
    "refuse_overwriting",
    "sha256",
    "two_numbers",
    "whole_number",
]


class Notes:
    """Remarks, held back until the work is done: a command that fails prints its one line and nothing else."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def __call__(self, line: str) -> None:
        """Keep a remark.

        Parameters
        ----------
        line : str
            One line.
        """
        self.lines.append(line)

    def flush(self) -> None:
        """Print the remarks on stderr."""
        for line in self.lines:
            print(f"note: {printable(line)}", file=sys.stderr)
        self.lines.clear()


def note(line: str) -> None:
    """Print a remark on stderr now, while something runs.

    Parameters
    ----------
    line : str
        One line.
    """
    print(f"note: {printable(line)}", file=sys.stderr, flush=True)


def print_json(document: object) -> None:
    """Print one JSON object on stdout.

    Parameters
    ----------
    document : object
        Without NaN or infinity.
    """
    print(json.dumps(document, allow_nan=False))


def printable(text: str) -> str:
    """Escape what would move a terminal's cursor or change its colours.

    Parameters
    ----------
    text : str
        One line, perhaps with names out of a file.

    Returns
    -------
    text : str
        Without control characters.
    """
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def refuse_overwriting(option: str, out: Path, inputs: Iterable[Path]) -> None:
    """Raise if the file to write is one of those to read, by whatever name.

    Parameters
    ----------
    option : str
        What names the file to write.
    out : Path
        The file to write.
    inputs : iterable of Path
        The files to read.

    Raises
    ------
    InputError
        If it is.
    """
    for path in inputs:
        with suppress(OSError):  # one of them is not there, or cannot be reached: told later
            if out.samefile(path):
                raise InputError(f"{option} names an input file; choose another")


def sha256(path: Path) -> str:
    """SHA-256 of a file, in hex.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    digest : str
        64 hex digits.

    Raises
    ------
    FileError
        If it cannot be read, or not twice.
    """
    try:
        with path.open("rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise FileError(str(path), "is a pipe or a device; save it to a file first")
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise file_error(path, error, "read") from error


def image_size(text: str) -> tuple[int, int]:
    """Parse ``1280x720``.

    Parameters
    ----------
    text : str
        Width and height in pixels.

    Returns
    -------
    size : (int, int)
        Both positive.

    Raises
    ------
    argparse.ArgumentTypeError
        If it is something else.
    """
    match = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text.strip(), flags=re.ASCII)
    size = (int(match[1]), int(match[2])) if match else (0, 0)
    if min(size) < 1:
        raise argparse.ArgumentTypeError(
            f"expected WIDTHxHEIGHT in pixels such as 1280x720, not {shown(text)}"
        )
    return size


def two_numbers(text: str) -> tuple[float, float]:
    """Parse ``U,V``.

    Parameters
    ----------
    text : str
        Two numbers.

    Returns
    -------
    numbers : (float, float)
        Both finite.

    Raises
    ------
    argparse.ArgumentTypeError
        If it is something else.
    """
    try:
        u, v = (float(part) for part in text.split(","))
    except ValueError:
        u = v = float("nan")
    if not (abs(u) < 1e9 and abs(v) < 1e9):
        raise argparse.ArgumentTypeError(
            f"expected U,V in pixels such as 640,360, not {shown(text)}"
        )
    return u, v


def whole_number(text: str, *, least: int = 0) -> int:
    """Parse a whole number.

    Parameters
    ----------
    text : str
        Decimal digits.
    least : int
        The smallest to accept.

    Returns
    -------
    number : int
        As large as wanted.

    Raises
    ------
    argparse.ArgumentTypeError
        If it is something else.
    """
    if re.fullmatch(r"[0-9]{1,1000}", text) is None or int(text) < least:
        raise argparse.ArgumentTypeError(
            f"expected a whole number from {least} on, not {shown(text)}"
        )
    return int(text)
