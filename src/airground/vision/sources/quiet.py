"""Keep the libraries' own chatter off the terminal: what matters is said by us, in one line."""

from __future__ import annotations

import os
from contextlib import contextmanager
from threading import Lock
from typing import TYPE_CHECKING

import cv2

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["quiet_opencv"]

SILENT = 0  # cv2.utils.logging.LOG_LEVEL_SILENT, which has no type stub


class _Level:
    """OpenCV's log level, silent while any thread is inside; the level is the whole process's."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.inside = 0
        self.before = SILENT


_level = _Level()


@contextmanager
def quiet_opencv() -> Iterator[None]:
    """OpenCV, and the FFmpeg inside it, print nothing.

    FFmpeg's level is read from the environment once, when OpenCV first opens a video; a value that the user has set
    stays.

    Yields
    ------
    nothing : None
        For the time of the block.
    """
    with _level.lock:
        os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
        if _level.inside == 0:
            _level.before = cv2.utils.logging.getLogLevel()
            cv2.utils.logging.setLogLevel(SILENT)
        _level.inside += 1
    try:
        yield
    finally:
        with _level.lock:
            _level.inside -= 1
            if _level.inside == 0:
                cv2.utils.logging.setLogLevel(_level.before)
