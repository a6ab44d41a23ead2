"""What the tests of other processes have done there: a fresh interpreter must be able to import it."""

from __future__ import annotations

import gc
import os
import time
from typing import TYPE_CHECKING

from airground.errors import InputError, UndeterminedError
from airground.vision.detectors.tags import TagDetector
from airground.vision.eyes import Eyes
from airground.vision.moving import Stabilizer
from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from airground.vision.frame import Frame


def real_eyes(*, moving: bool = False) -> Eyes:
    return Eyes(TagDetector(rescan_frames=1), Tracker(), Stabilizer() if moving else None)


class Touchy:
    """Sees one thing, if it sees at all; and goes wrong in the frames of some numbers."""

    def detect(self, frame: Frame) -> Sightings:
        if frame.index == 1:
            raise InputError("frame 1 is not well formed")
        if frame.index == 2:
            raise UndeterminedError("nothing can be said of frame 2")
        if frame.index == 3:
            raise KeyError("three")
        if frame.index == 11:
            time.sleep(600.0)
        if frame.index == 10:
            raise InputError(f"{gc.get_freeze_count()} frozen")
        if frame.index == 4:
            os._exit(1)
        return Sightings.round(frame.t, [[10 + frame.index, 40]], 0.5)


class Clumsy(Touchy):
    """Answers well, and goes wrong afterwards."""

    def __init__(self) -> None:
        self._index = 0

    def follow(self, frame: Frame) -> Sightings:
        self._index = frame.index
        return super().detect(frame)

    def look_around(self) -> None:
        if self._index == 7:
            raise KeyError("seven")


def touchy_eyes() -> Eyes:
    return Eyes(Touchy(), Tracker())


def clumsy_eyes() -> Eyes:
    return Eyes(Clumsy(), Tracker())


def no_such_eyes() -> Eyes:
    raise InputError("there are no such eyes")


def undetermined_eyes() -> Eyes:
    raise UndeterminedError("which eyes?")


def broken_eyes() -> Eyes:
    raise KeyError("a bug")


def eyes_that_die() -> Eyes:
    os._exit(1)


def double(pipe: Connection, offset: int) -> None:
    """Double numbers until nobody asks."""
    while True:
        pipe.send(2 * pipe.recv() + offset)


def stubborn(pipe: Connection) -> None:
    """Say that it is there, and never look at the pipe again."""
    pipe.send("here")
    time.sleep(3600)


def dies_when_asked(pipe: Connection) -> None:
    pipe.recv()
    os._exit(3)
