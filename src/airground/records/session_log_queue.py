"""What waits to be written: bounded in bytes, the dispensable dropped first."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from threading import Condition

__all__ = ["LogQueue", "Waiting"]

OVERHEAD = 200  # bytes that an entry takes beside its data, about


@dataclass(frozen=True, slots=True)
class Waiting:
    """A message on its way to the file."""

    topic: str
    """Where it belongs."""

    ns: int
    """Wall clock [ns]."""

    data: bytes
    """JSON; of an image the image itself."""


class LogQueue:
    """A queue that never makes who puts wait.

    Parameters
    ----------
    limit : int
        Bytes that may wait. What is dispensable may take half of it.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._waiting: deque[Waiting] = deque()
        self._bytes = 0
        self._changed = Condition()
        self._closed = False

    def put(self, one: Waiting, *, dispensable: bool) -> bool:
        """Add a message, if there is room.

        Parameters
        ----------
        one : Waiting
            The message.
        dispensable : bool
            Whether the rest makes sense without it.

        Returns
        -------
        taken : bool
            False where there is no room, or the queue is closed.
        """
        size = len(one.data) + OVERHEAD
        with self._changed:
            if self._closed or self._bytes + size > self._limit // (2 if dispensable else 1):
                return False
            self._waiting.append(one)
            self._bytes += size
            self._changed.notify()
            return True

    def take(self, timeout_s: float) -> tuple[list[Waiting], bool]:
        """Take all that waits; wait for something, or for the end.

        Parameters
        ----------
        timeout_s : float [s]
            Longest wait.

        Returns
        -------
        messages : list of Waiting
            In order; none where the time has run out.
        closed : bool
            Whether these were the last.
        """
        with self._changed:
            if not self._waiting and not self._closed:
                self._changed.wait(timeout_s)
            taken = list(self._waiting)
            self._waiting.clear()
            return taken, self._closed

    def written(self, one: Waiting) -> None:
        """Give a message's room back.

        Parameters
        ----------
        one : Waiting
            One that was taken.
        """
        with self._changed:
            self._bytes -= len(one.data) + OVERHEAD

    def close(self) -> None:
        """Take nothing more. What waits stays."""
        with self._changed:
            self._closed = True
            self._changed.notify()
