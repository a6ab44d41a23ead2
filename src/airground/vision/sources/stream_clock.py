"""Times of live pictures: the stream's own where it has any, and how late each one came."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from airground.vision.frame import Clock

__all__ = ["Lateness", "StreamClock", "StreamTime"]

# Longer than any jam on the way, short enough that the drift between two quartzes (50 ppm) stays within 3 ms.
WINDOW_S = 60.0

# Pictures may come in bursts, late and closely packed, but none comes before it was taken.
JUMP_AHEAD_S = 2.0
JUMP_BACK_S = 0.5

# Some streams have no time for their first picture or two.
TRIES = 5

SMALLEST_STEP_S = 1e-6

DECIMALS = 9


class Lateness:
    """How much later than usual something comes, where the usual delay is the least of the last minute.

    Parameters
    ----------
    window_s : float [s]
        For how long a delay is remembered.
    """

    def __init__(self, window_s: float = WINDOW_S) -> None:
        self._window_s = window_s
        self._least: deque[tuple[float, float]] = deque()  # (arrival, delay), delays ascending

    def of(self, delay_s: float, arrival: float) -> float:
        """Take note of a delay.

        Parameters
        ----------
        delay_s : float [s]
            Arrival on one clock minus the time on another; any constant may be added.
        arrival : float [s]
            When that was; ascends.

        Returns
        -------
        late_s : float [s]
            Zero or more.
        """
        while self._least and self._least[-1][1] >= delay_s:
            self._least.pop()
        self._least.append((arrival, delay_s))
        while arrival - self._least[0][0] > self._window_s:
            self._least.popleft()
        return delay_s - self._least[0][1]


class StreamTime(NamedTuple):
    """When a live picture was taken."""

    t: float
    """[s]. On the clock."""

    clock: Clock
    """Which."""

    segment: int
    """Grows where the times before and after need not be comparable."""

    late_s: float | None
    """[s]. How much later than usual it came."""


class StreamClock:
    """Gives pictures their times.

    Streams number their pictures from any zero, and start anew when they come back: the first picture of each segment
    is put where it came after the very first, so that times ascend over segments too. Device times are kept.
    """

    def __init__(self) -> None:
        self._segment = -1
        self._start: float | None = (
            None  # arrival of the very first picture, which has the time zero
        )
        self._last: float | None = None
        self._clock: Clock | None = None  # of the segment
        self._seen = 0  # pictures of the segment, until the clock is known
        self._before: float | None = None  # stamp of the newest picture
        self._arrived = 0.0
        self._zero_s: float | None = None
        self._lateness = Lateness()

    @property
    def settled(self) -> bool:
        """Whether it is known which clock this segment has."""
        return self._clock is not None

    def reconnected(self) -> None:
        """Begin a segment at the next picture."""
        self._clock, self._seen, self._before, self._zero_s = None, 0, None, None
        self._lateness = Lateness()

    def take(self, stamp_s: float | None, arrival: float, stamped: Clock) -> StreamTime | None:
        """Tell when a picture was taken.

        Parameters
        ----------
        stamp_s : float or None [s]
            What the stream says.
        arrival : float [s]
            When it came, on this computer's clock.
        stamped : Clock
            Which clock the stamps are of.

        Returns
        -------
        time : StreamTime or None
            None for the first pictures of a segment, until two tell that the stamps ascend, and for later ones whose
            stamp is missing or does not ascend.
        """
        if self._jumps(stamp_s, arrival):
            self.reconnected()
        before, self._arrived = self._before, arrival
        ascends = stamp_s is not None and before is not None and stamp_s > before
        if self._clock is None:
            self._before = stamp_s
            self._seen += 1
            if self._seen == 1 or (stamp_s is not None and not ascends and self._seen < TRIES):
                return None
            self._clock = stamped if ascends else "arrival"
            self._segment += 1
        if self._clock == "arrival":
            return self._at(arrival, None)
        if stamp_s is None or not ascends:
            return None
        self._before = stamp_s
        if self._zero_s is None:
            self._zero_s = self._zero_of(stamp_s, arrival)
        late_s = self._lateness.of(arrival - stamp_s, arrival)
        return self._at(round(stamp_s - self._zero_s, DECIMALS), late_s)

    def _jumps(self, stamp_s: float | None, arrival: float) -> bool:
        if self._clock in (None, "arrival") or stamp_s is None or self._before is None:
            return False
        step_s = stamp_s - self._before
        return step_s < -JUMP_BACK_S or step_s > arrival - self._arrived + JUMP_AHEAD_S

    def _zero_of(self, stamp_s: float, arrival: float) -> float:
        """What to take off the stamps of this segment."""
        if self._clock == "device":
            return 0.0
        if self._start is None:
            self._start = arrival
        t = arrival - self._start
        if (
            self._last is not None
        ):  # the pictures of the segment before may have run ahead of their arrival
            t = max(t, self._last + SMALLEST_STEP_S)
        return stamp_s - t

    def _at(self, t: float, late_s: float | None) -> StreamTime:
        assert self._clock is not None
        if self._last is not None and t <= self._last:
            t = self._last + SMALLEST_STEP_S  # two arrivals within one tick of the computer's clock
        self._last = t
        return StreamTime(t, self._clock, self._segment, late_s)
