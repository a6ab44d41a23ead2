"""How what a session says comes from its thread into ours: stored there, fetched here, and nothing waits for it.

The event loop fetches by its own timer. Were it woken from the session's thread, that thread would hand over
Python's lock with each wake, and get it back only milliseconds later.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.session.handle import SessionHandle
    from airground.session.tick import SessionEvent, SessionTick

__all__ = ["Ear"]

KEPT = 4096  # events and refusals that wait for an event loop that is stuck


class Ear:
    """Keeps the newest tick, and all events and refusals."""

    def __init__(self) -> None:
        # Written by the session's thread and read by ours; each operation on them is atomic.
        self.newest: SessionTick | None = None
        self._events: deque[SessionEvent] = deque(maxlen=KEPT)
        self._refusals: deque[tuple[str, str]] = deque(maxlen=KEPT)
        self._deafen: Callable[[], None] | None = None

    def start(self, handle: SessionHandle) -> None:
        """Begin to listen.

        Parameters
        ----------
        handle : SessionHandle
            The session.
        """
        self._deafen = handle.listen(self.hear)

    def stop(self) -> None:
        """Listen no more."""
        if self._deafen is not None:
            self._deafen()

    def hear(self, tick: SessionTick) -> None:
        """Store what the session says; called in its thread, and takes a microsecond.

        Parameters
        ----------
        tick : SessionTick
            After every step.
        """
        if tick.events:
            self._events.extend(tick.events)
        if tick.refused:
            self._refusals.extend(tick.refused)
        self.newest = tick

    def events(self) -> list[SessionEvent]:
        """Fetch what has happened since one last asked.

        Returns
        -------
        events : list of SessionEvent
            Oldest first.
        """
        return [self._events.popleft() for _ in range(len(self._events))]

    def refusals(self) -> list[tuple[str, str]]:
        """Fetch the orders that were not carried out since one last asked.

        Returns
        -------
        refusals : list of (str, str)
            Client, why.
        """
        return [self._refusals.popleft() for _ in range(len(self._refusals))]
