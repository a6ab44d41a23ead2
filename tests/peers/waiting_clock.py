"""A session's clock that waits for the session where the computer has other things to do.

A simulated world has no need to run on while nobody looks: where it does, its robots would only stop for safety all
the time. What happens then is tested elsewhere.
"""

from __future__ import annotations

import time
from threading import Lock
from typing import TYPE_CHECKING

from airground.session.clock import SessionClock

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["WaitingClock"]


class WaitingClock(SessionClock):
    """Runs like any other, but not beyond a limit; time that is waited for is lost.

    Parameters
    ----------
    limit : callable
        Gives the latest time that it may show now [s].
    """

    def __init__(self, limit: Callable[[], float]) -> None:
        super().__init__()
        self._limit = limit
        self._lock = Lock()
        self._t = 0.0
        self._told = time.monotonic()
        self.waited_s = 0.0
        """For how long it has waited so far [s]."""

    def __call__(self) -> float:
        """Now [s]."""
        limit = self._limit()
        with self._lock:
            now = time.monotonic()
            wished = self._t + now - self._told
            self._told = now
            self._t = max(self._t, min(wished, limit))
            self.waited_s += wished - self._t
            return self._t
