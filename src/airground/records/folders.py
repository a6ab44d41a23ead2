"""Folders to write results to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from airground.errors import FileError

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["make_folder"]


def make_folder(folder: Path) -> None:
    """Make a folder where it is missing.

    Parameters
    ----------
    folder : Path
        To write to later: better told before the long work than after.

    Raises
    ------
    FileError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(str(folder), f"cannot be made: {error.strerror or error}") from error
