"""What waits to be taken by the loop: old frames are dropped, old stops never."""

from __future__ import annotations

from collections import deque
from threading import Condition
from typing import TYPE_CHECKING

from airground.session.inputs import Ordered, Seen
from airground.session.orders import Stop

if TYPE_CHECKING:
    from airground.session.inputs import Input

__all__ = ["Inbox"]

MOST_SEEN = 2
MOST_OTHERS = 5000


class Inbox:
    """Holds inputs in the order in which they came, within bounds; safe to use from any thread."""

    def __init__(self) -> None:
        self._waiting: deque[Input] = deque()
        self._urgent = False
        self._changed = Condition()
        self.stop_waits = False
        """Whether there is a stop in it."""
        self.dropped_frames = 0
        """Frames that newer ones overtook."""
        self.dropped_others = 0
        """Everything else that did not fit; never a stop."""

    def put(self, one: Input) -> None:
        """Hand something in; never waits.

        Parameters
        ----------
        one : Input
            Frames and stops wake the loop at once.
        """
        stop = isinstance(one, Ordered) and isinstance(one.order, Stop)
        with self._changed:
            if isinstance(one, Seen):
                seen = [k for k in self._waiting if isinstance(k, Seen)]
                if len(seen) >= MOST_SEEN:
                    self._waiting.remove(seen[0])
                    self.dropped_frames += 1
            elif not stop and len(self._waiting) >= MOST_OTHERS:
                self.dropped_others += 1
                return
            self._waiting.append(one)
            self.stop_waits = self.stop_waits or stop
            if stop or isinstance(one, Seen):
                self._urgent = True
                self._changed.notify_all()

    def wait(self, timeout_s: float) -> bool:
        """Wait for a frame or a stop.

        Parameters
        ----------
        timeout_s : float [s]
            At most so long.

        Returns
        -------
        urgent : bool
            Whether there is one.
        """
        with self._changed:
            if not self._urgent and timeout_s > 0:
                self._changed.wait(timeout_s)
            return self._urgent

    def take(self) -> list[Input]:
        """Give all that waits.

        Returns
        -------
        inputs : list of Input
            In the order in which they came.
        """
        with self._changed:
            inputs = list(self._waiting)
            self._waiting.clear()
            self._urgent = self.stop_waits = False
        return inputs
