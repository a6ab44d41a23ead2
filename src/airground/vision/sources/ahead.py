"""Frames made ahead of their use, by a second thread: decoding and rendering leave the interpreter free."""

from __future__ import annotations

from contextlib import contextmanager
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import TYPE_CHECKING

from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from airground.vision.frame import Frame

__all__ = ["ahead"]

LOOK_S = 0.1  # how often a waiting thread looks whether it is still wanted


@contextmanager
def ahead(frames: Iterable[Frame], most: int = 4) -> Iterator[Iterator[Frame]]:
    """Take frames from a source in a thread of its own. The order and the frames are the same as without.

    Not for live cameras, which have a thread already and would give old frames.

    Parameters
    ----------
    frames : iterable of Frame
        The source; nobody else may use it meanwhile.
    most : int
        How many frames may lie ready.

    Yields
    ------
    frames : iterator of Frame
        An error of the source comes out where its frame would have.

    Raises
    ------
    InputError
        If `most` is not positive.
    """
    if most < 1:
        raise InputError(f"most must be 1 or more, not {most}")
    ready: Queue[Frame | BaseException | None] = Queue(most)
    unwanted = Event()

    def put(item: Frame | BaseException | None) -> bool:
        while not unwanted.is_set():
            try:
                ready.put(item, timeout=LOOK_S)
            except Full:
                continue
            return True
        return False

    def work() -> None:
        try:
            for frame in frames:
                if not put(frame):
                    return
            put(None)
        except BaseException as error:  # raised again where the frames are used
            put(error)

    thread = Thread(target=work, name="frames ahead", daemon=True)

    def take() -> Iterator[Frame]:
        while True:
            try:
                item = ready.get(timeout=LOOK_S)
            except Empty:
                continue  # the main thread stays open to Ctrl-C
            if item is None:
                return
            if isinstance(item, BaseException):
                raise item
            yield item

    thread.start()
    try:
        yield take()
    finally:
        unwanted.set()
        thread.join()
