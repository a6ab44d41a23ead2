"""Stops all robots when the loop that drives them hangs: a thread of its own, which waits for nobody."""

from __future__ import annotations

from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Self

from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from types import TracebackType

    from airground.robots.protocol import Robot

__all__ = ["Watchdog"]

CLOSING_S = 1.0


class Watchdog:
    """Calls `stop` of every robot once when it is not fed, and again only after it was fed in between.

    Each robot is stopped in a thread of its own: a driver that hangs, because the loop hangs in it, keeps no other
    robot from being stopped. What it cannot see is a computer that stands still: for that robots have watchdogs of
    their own.

    Parameters
    ----------
    robots : iterable of Robot
        All that the loop drives.
    after_s : float [s]
        Longest silence.
    tell : callable, optional
        Is given one line when the robots are stopped and one when the loop is back, in the watchdog's thread.

    Raises
    ------
    InputError
        If `after_s` is not positive.
    """

    def __init__(
        self,
        robots: Iterable[Robot],
        after_s: float,
        *,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        if not 0 < after_s < float("inf"):
            raise InputError(f"after_s must be positive, not {after_s}")
        self.after_s = after_s
        self.stops = 0
        """How often it has stopped the robots."""
        self.line = ""
        """What a user should know; empty while the loop runs."""
        self._robots = list(robots)
        self._tell = tell
        self._closing = Event()
        self._thread = Thread(target=self._watch, name="watchdog", daemon=True)
        self._stoppers: list[Thread | None] = [None] * len(self._robots)
        self._fed_s = monotonic()

    def start(self) -> Self:
        """Begin to watch; counts as feeding.

        Returns
        -------
        self : Watchdog
            The same.
        """
        self._fed_s = monotonic()
        self._thread.start()
        return self

    def feed(self) -> None:
        """Tell that the loop runs. Takes no lock; to be called in every round, after the commands were sent."""
        self._fed_s = monotonic()

    def close(self) -> None:
        """Watch no longer; calling it again does nothing. Robots are left as they are."""
        self._closing.set()
        if self._thread.ident is not None:
            self._thread.join(CLOSING_S)

    def _watch(self) -> None:
        while not self._closing.wait(self.after_s / 8):
            silent_s = monotonic() - self._fed_s
            if silent_s > self.after_s and not self.line:
                self.stops += 1
                self._stop_all()
                self._say(f"the control loop has hung for {silent_s:.2f} s: all robots are stopped")
            elif silent_s <= self.after_s and self.line:
                self._say("")

    def _stop_all(self) -> None:
        for k, robot in enumerate(self._robots):
            before = self._stoppers[k]
            if before is not None and before.is_alive():
                continue  # it still tries, and one that hangs in a driver is enough
            stopper = Thread(target=robot.stop, name=f"stop of {robot.name}", daemon=True)
            self._stoppers[k] = stopper
            stopper.start()

    def _say(self, line: str) -> None:
        self.line = line
        if self._tell is not None:
            self._tell(line or "the control loop runs again")

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
