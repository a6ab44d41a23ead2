"""The session's clock: seconds since it began. The only clock of the live system."""

from __future__ import annotations

import time

__all__ = ["SessionClock"]


class SessionClock:
    """Counts from when it was made; does not jump when somebody sets the computer's time."""

    def __init__(self) -> None:
        self.began_s = time.monotonic()
        """On this computer's monotonic clock [s]."""
        self.began_wall_s = time.time()
        """UTC, since 1970 [s]; for the log only."""

    def __call__(self) -> float:
        """Now [s]."""
        return time.monotonic() - self.began_s
