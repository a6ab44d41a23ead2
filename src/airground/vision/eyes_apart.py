"""Detector and tracker in a process of their own: the loop that drives shares no interpreter with them."""

from __future__ import annotations

import gc
import traceback
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, Self

from airground.errors import AirgroundError, InputError, UnreachableError
from airground.vision.child import Child
from airground.vision.eyes import Look
from airground.vision.frame import Frame
from airground.vision.shared_images import SharedImages
from airground.vision.threads import use_threads

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection
    from types import TracebackType

    from airground.vision.eyes import Eyes
    from airground.vision.frame import ImageArray

__all__ = ["EyesApart"]

PATIENCE_S = 20.0  # a network's first picture takes its time; robots stand long before


class EyesApart:
    """`Eyes` elsewhere. A context manager; one thread at a time may look.

    Where the other process dies, or hangs, looking raises once, and begins with fresh eyes the next time.

    Parameters
    ----------
    make : callable
        Makes the eyes, there; can be pickled.
    patience_s : float [s]
        For how long an answer is waited for.

    Raises
    ------
    AirgroundError
        What making them raised.
    UnreachableError
        If the other process does not come up.
    """

    def __init__(self, make: Callable[[], Eyes], *, patience_s: float = PATIENCE_S) -> None:
        self._make = make
        self._patience_s = patience_s
        self._images: SharedImages | None = None
        self._count = 0
        self._child: Child | None = None
        self._open()

    def look(self, frame: Frame) -> Look:
        """Take in the next frame, and wait for what is made of it.

        Parameters
        ----------
        frame : Frame
            As for `Eyes.look`.

        Returns
        -------
        look : Look
            What was made of it.

        Raises
        ------
        AirgroundError
            What looking raised.
        UnreachableError
            If the other process has died, or hangs.
        """
        child = self._child or self._open()
        image = frame.image
        if self._images is None or self._images.shape != image.shape:
            if self._images is not None:
                self._images.close()
            self._images = SharedImages(image.shape)
        self._count += 1
        self._images.write(self._count, image)
        about = (frame.t, frame.clock, frame.index, frame.segment, frame.late_s)
        try:
            answer = child.ask(
                (self._images.name, image.shape, self._count, about), self._patience_s
            )
        except UnreachableError:
            self._end()
            raise
        _raise(answer)
        return Look(frame, *answer)

    def close(self) -> None:
        """Let go of the other process; calling it again does nothing."""
        self._end()
        if self._images is not None:
            self._images.close()
            self._images = None

    def _open(self) -> Child:
        child = Child("detector and tracker", _look, self._make)
        try:
            made = child.pipe.recv()
        except (EOFError, OSError) as error:
            child.close()
            raise child.died() from error
        self._child = child
        try:
            _raise(made)
        except BaseException:
            self._end()
            raise
        return child

    def _end(self) -> None:
        if self._child is not None:
            self._child.close()
            self._child = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


@dataclass(frozen=True, slots=True)
class _Failure:
    """An error on its way: not all errors can be pickled."""

    kind: Literal["input", "airground", "bug"]
    """What to raise."""

    line: str
    """What it said."""


def _raise(answer: object) -> None:
    if isinstance(answer, _Failure):
        if answer.kind == "bug":
            raise RuntimeError(answer.line)
        raise InputError(answer.line) if answer.kind == "input" else AirgroundError(answer.line)


def _look(pipe: Connection, make: Callable[[], Eyes]) -> None:
    """Look at what comes until the other side is gone."""
    use_threads(1)  # threads of one image would wait for each other where cores are busy
    made = _tried(make)
    gc.collect()
    gc.freeze()  # what there is now stays: nobody waits for the collector to look through it
    pipe.send(made if isinstance(made, _Failure) else None)
    images: SharedImages | None = None
    trouble: Any = None
    while True:
        name, shape, mark, about = pipe.recv()
        if images is None or images.name != name:
            if images is not None:
                images.close()
            images = SharedImages(shape, name=name)
        image = images.read(mark)
        assert image is not None  # who asks waits for the answer before it writes the next
        assert image is not None, "who wrote it waits for the answer"
        answer = trouble or _tried(partial(_answer, made, image, about))
        pipe.send(answer)
        # Nobody waits now. What goes wrong is told the next time.
        trouble = None if isinstance(answer, _Failure) else _tried(made.look_around)


def _answer(eyes: Eyes, image: ImageArray, about: tuple[Any, ...]) -> tuple[Any, ...]:
    look = eyes.look(Frame(image, *about), at_once=True)
    return look.seen, look.stabilization, look.sightings, look.state


def _tried(work: Callable[[], Any]) -> Any:
    try:
        return work()
    except InputError as error:
        return _Failure("input", str(error))
    except AirgroundError as error:
        return _Failure("airground", str(error))
    except Exception as error:
        return _Failure("bug", f"{error!r}\n{traceback.format_exc()}")
