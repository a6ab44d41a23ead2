"""What the operating system says about a file, as one line."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Literal

from airground.errors import FileError

__all__ = ["StrPath", "file_error"]

StrPath = str | os.PathLike[str]


def file_error(path: StrPath, error: Exception, purpose: Literal["read", "write"]) -> FileError:
    """Say in one line why a file cannot be read or written.

    Parameters
    ----------
    path : path-like
        The file, as the caller named it.
    error : Exception
        What the operating system raised.
    purpose : {"read", "write"}
        What was tried.

    Returns
    -------
    error : FileError
        To be raised.
    """
    name = os.fspath(path)
    return FileError(name, _problem(Path(name), error, purpose))


def _problem(path: Path, error: Exception, purpose: str) -> str:
    if isinstance(error, IsADirectoryError) or (
        isinstance(error, PermissionError) and _is_dir(path)
    ):
        return "is a folder, expected a file"  # Windows calls a folder a matter of permission
    if isinstance(error, PermissionError):
        return f"no permission to {purpose} it"
    if isinstance(error, FileNotFoundError):
        missing = f"the folder {path.parent} does not exist; create it first"
        return "there is no such file" if purpose == "read" else missing
    if isinstance(error, NotADirectoryError):
        return f"{path.parent} is not a folder"
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full"
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return f"cannot {purpose} it: {' '.join(reason.split())}"


def _is_dir(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        return False
