"""What all commands print, and how."""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
from pathlib import Path

from airground.errors import FileError

__all__ = ["Notes", "image_size", "print_json", "sha256", "two_numbers"]


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
            print(f"note: {line}", file=sys.stderr)
        self.lines.clear()


def print_json(document: object) -> None:
    """Print one JSON object on stdout.

    Parameters
    ----------
    document : object
        Without NaN or infinity.
    """
    print(json.dumps(document, allow_nan=False))


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
        If it cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise FileError(str(path), f"cannot be read: {error.strerror or error}") from error


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
            f"expected WIDTHxHEIGHT in pixels such as 1280x720, not {text!r}"
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
        raise argparse.ArgumentTypeError(f"expected U,V in pixels such as 640,360, not {text!r}")
    return u, v
