"""Files that are there whole or not at all: written beside, then renamed."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from airground.errors import FileError
from airground.records.access import StrPath, file_error

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["replacing", "write_bytes", "write_text"]

_DISK_TROUBLE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}


@contextmanager
def replacing(path: StrPath) -> Iterator[Path]:
    """Lend a temporary file that takes the place of `path` when the block ends well.

    The file lies in the same folder and has the same suffix, so that a library that looks at the
    suffix writes the right format. If the block raises, Ctrl-C included, it is removed and `path`
    stays as it was. A link is followed: the file behind it is replaced, not the link. A new file
    gets the permissions that the umask leaves; one that was there keeps its own.

    Parameters
    ----------
    path : path-like
        The file to write or to replace.

    Yields
    ------
    temporary : Path
        An empty file to write to. Close it before the block ends.

    Raises
    ------
    FileError
        If the folder is missing, the target is a folder or not a plain file, there is no
        permission, or the disk is full.
    """
    try:
        target = Path(path).resolve()
        mode = _mode_of_existing(target, path)
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links; a NUL in the name
        if isinstance(error, FileError):
            raise
        raise file_error(path, error, "write") from error
    # A short name of its own: a long target's plus something may be longer than a name can be.
    temporary = target.with_name(f".airground-{secrets.token_hex(8)}{target.suffix}")
    try:
        _create(temporary, mode, path)
        try:
            yield temporary
        except OSError as error:
            if error.errno in _DISK_TROUBLE or error.filename == str(temporary):
                raise file_error(path, error, "write") from error
            raise  # about some other file
        _put_in_place(temporary, target, path)
    except BaseException:
        with suppress(OSError):  # may not exist; the first error is the one to tell
            temporary.unlink()
        raise


def write_bytes(path: StrPath, data: bytes) -> None:
    """Write a whole file, or leave what was there.

    Parameters
    ----------
    path : path-like
        The file to write or to replace.
    data : bytes
        All of its content.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: StrPath, text: str) -> None:
    r"""Write a whole text file in UTF-8, or leave what was there.

    Parameters
    ----------
    path : path-like
        The file to write or to replace.
    text : str
        All of its content. Lines end as they do here, "\n" on every system.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    try:
        data = text.encode()
    except UnicodeEncodeError as error:
        problem = f"UTF-8 cannot hold the character {text[error.start]!a}"
        raise FileError(os.fspath(path), problem) from error
    write_bytes(path, data)


def _mode_of_existing(target: Path, path: StrPath) -> int | None:
    """Permissions of the file that is there, which must be one that we may write to."""
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise FileError(os.fspath(path), "is a folder, expected a file")
    if not stat.S_ISREG(mode):  # renaming onto /dev/null would take it from the whole system
        raise FileError(os.fspath(path), "is not a plain file; give the name of a file to write")
    # Renaming asks only for the folder's permission, and would overwrite a write-protected file.
    os.close(os.open(target, os.O_WRONLY))
    return stat.S_IMODE(mode)


def _create(temporary: Path, mode: int | None, path: StrPath) -> None:
    try:
        os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        if mode is not None:
            temporary.chmod(mode)
    except OSError as error:
        raise file_error(path, error, "write") from error


def _put_in_place(temporary: Path, target: Path, path: StrPath) -> None:
    try:
        with temporary.open("r+b") as stream:  # on the disk before its name is
            os.fsync(stream.fileno())
        temporary.replace(target)
    except OSError as error:
        raise file_error(path, error, "write") from error
