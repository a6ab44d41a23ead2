"""A robot's or a camera's own stamps, brought onto the session's clock by the least delay of their way."""

from __future__ import annotations

from collections import deque
from math import isfinite

from airground.errors import InputError

__all__ = ["StampClock"]

# Clocks of 100 ppm are apart by 2 ms after that time, and an early stamp that was wrong is forgotten.
WINDOW_S = 20.0

BACK_S = 0.5  # a stamp so far before the newest one is no message overtaken on its way: the clock was set


class StampClock:
    """Gives stamps on another clock their times on ours.

    Where nobody knows the delay of a link, the quickest message of the last seconds is taken to have had none: times
    are late by the link's least delay, which is constant, and none lies after its message's arrival. A clock that
    is set forwards is followed at once; one that goes back by more than half a second makes it begin anew.

    Parameters
    ----------
    window_s : float [s]
        For how long a delay is remembered.

    Raises
    ------
    InputError
        If it is not positive.
    """

    def __init__(self, window_s: float = WINDOW_S) -> None:
        if not 0 < window_s < float("inf"):
            raise InputError(f"window_s must be positive, not {window_s}")
        self.window_s = window_s
        self.restarts = 0
        """How often the other clock went back."""
        self._least: deque[tuple[float, float]] = deque()  # (arrival, delay), delays ascending
        self._newest = -float("inf")

    def take(self, stamp_s: float, arrival_s: float) -> float:
        """Give a stamp's time.

        Parameters
        ----------
        stamp_s : float [s]
            On the other clock, from any zero.
        arrival_s : float [s]
            When it came, on ours; never goes back.

        Returns
        -------
        t : float [s]
            On ours; not after the arrival. Ascends with the stamps, except where a quicker message shows that
            those before it were late.

        Raises
        ------
        InputError
            If one of them is not finite.
        """
        if not (isfinite(stamp_s) and isfinite(arrival_s)):
            raise InputError(f"a stamp must be a number of seconds, not {stamp_s} at {arrival_s}")
        if stamp_s < self._newest - BACK_S:
            self.restarts += 1
            self._least.clear()
            self._newest = stamp_s
        self._newest = max(self._newest, stamp_s)
        delay = arrival_s - stamp_s
        while self._least and self._least[-1][1] >= delay:
            self._least.pop()
        self._least.append((arrival_s, delay))
        while arrival_s - self._least[0][0] > self.window_s:
            self._least.popleft()
        return min(stamp_s + self._least[0][1], arrival_s)
