"""What came in of late, in the order in which it happened, and the belief after each: late data are put in their place.

Everything is a pure function of the sorted data and the commands, so the order of arrival does not matter.
"""

from __future__ import annotations

from bisect import bisect_right
from math import ceil, inf
from typing import TYPE_CHECKING

from airground.control.estimation.moment import Moment, absorb, advance

if TYPE_CHECKING:
    from collections.abc import Iterator

    from airground.control.command import VelocityCommand
    from airground.control.estimation.model import Piece
    from airground.control.estimation.moment import Datum
    from airground.control.estimation.options import StateOptions

__all__ = ["CommandLine", "History"]

_MOST_DATA = 2000
_MOST_COMMANDS = 2000


class CommandLine:
    """Commands by the time at which they take effect; each holds until the next."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._commands: list[VelocityCommand] = []

    def __len__(self) -> int:
        return len(self._times)

    def add(self, t: float, command: VelocityCommand) -> None:
        """Put a command in its place; of two at one time, the one added later holds.

        Parameters
        ----------
        t : float [s]
            When it takes effect.
        command : VelocityCommand
            What it says.
        """
        k = bisect_right(self._times, t)
        self._times.insert(k, t)
        self._commands.insert(k, command)

    def forget(self, t: float) -> None:
        """Drop what was over by a time.

        Parameters
        ----------
        t : float [s]
            Nothing earlier will be asked for.
        """
        over = bisect_right(self._times, t) - 1
        if over > 0:
            del self._times[:over], self._commands[:over]

    def steps(self, start: float, end: float, longest: float) -> Iterator[list[Piece]]:
        """What was in effect, in steps.

        Parameters
        ----------
        start, end : float [s]
            From when until when.
        longest : float [s]
            No step is longer.

        Yields
        ------
        pieces : list of (float, VelocityCommand or None)
            Durations [s] and what held in them; None before the first command, and then in all of a step.
        """
        times, commands = self._times, self._commands
        k = bisect_right(times, start)
        count = max(1, ceil((end - start) / longest - 1e-9))
        if k == 0 and times and times[0] < end:
            yield from self.steps(start, times[0], longest)
            yield from self.steps(times[0], end, longest)
            return
        for i in range(1, count + 1):
            until = end if i == count else start + (end - start) / (count + 1 - i)
            pieces: list[Piece] = []
            while k < len(times) and times[k] < until:
                pieces.append((times[k] - start, commands[k - 1]))
                start, k = times[k], k + 1
            pieces.append((until - start, commands[k - 1] if k > 0 else None))
            yield pieces
            start = until


class History:
    """Data of the last second or so, and beliefs after each of them.

    Parameters
    ----------
    options : StateOptions
        Of the vehicle.
    """

    def __init__(self, options: StateOptions) -> None:
        self.options = options
        self.commands = CommandLine()
        self._base: Moment | None = None
        self._data: list[Datum] = []
        self._moments: list[Moment] = []  # after each of the first data; the rest is to be done
        self._newest = -inf

    @property
    def newest_t(self) -> float:
        """Time of the newest datum [s]."""
        return self._newest

    def add(self, datum: Datum) -> bool:
        """Put a datum in its place.

        Parameters
        ----------
        datum : Datum
            A sighting or a reading.

        Returns
        -------
        added : bool
            False if it is too late for that.
        """
        if datum.t < self._newest - self.options.window_s:
            return False
        if self._base is not None and datum.t < self._base.t:
            return False
        k = bisect_right(self._data, datum)
        self._data.insert(k, datum)
        del self._moments[k:]
        self._newest = max(self._newest, datum.t)
        if len(self._data) - len(self._moments) > _MOST_DATA:
            self.settle()  # nobody asks; do not let it pile up
        return True

    def command(self, t: float, command: VelocityCommand) -> None:
        """Put a command in its place.

        Parameters
        ----------
        t : float [s]
            When it takes effect.
        command : VelocityCommand
            What it says.
        """
        self.commands.add(t, command)
        if t < self._newest:
            del self._moments[bisect_right(self._data, t, key=lambda datum: datum.t) :]
        if len(self.commands) > _MOST_COMMANDS:  # nothing was seen or read for long
            self.commands.forget(t - self.options.longest_gap_s)

    def settle(self) -> Moment | None:
        """Belief after the newest datum.

        Returns
        -------
        moment : Moment or None
            None before any datum.
        """
        data, moments = self._data, self._moments
        if len(moments) < len(data):
            before = moments[-1] if moments else self._base
            for datum in data[len(moments) :]:
                if before is None:
                    before = Moment.first(datum.t, self.options)
                before = absorb(before, datum, self.commands, self.options)
                moments.append(before)
            self._forget()
        return moments[-1] if moments else self._base

    def _forget(self) -> None:
        """Let go of data that nothing can come before any more."""
        old = self._newest - self.options.window_s
        oldest = max(0, len(self._data) - _MOST_DATA)
        while self._data[oldest].t < old:  # seldom more than one; the newest is never old
            oldest += 1
        if oldest > 0:
            self._base = self._moments[oldest - 1]
            del self._data[:oldest], self._moments[:oldest]
            self.commands.forget(self._base.t)

    def at(self, t: float) -> Moment | None:
        """Belief at a time, from all data up to it.

        Parameters
        ----------
        t : float [s]
            Any time.

        Returns
        -------
        moment : Moment or None
            None where nothing is known, or not any more.
        """
        newest = self.settle()
        if newest is None:
            return None
        if t < newest.t:
            k = bisect_right(self._data, t, key=lambda datum: datum.t)
            before = self._moments[k - 1] if k > 0 else self._base
            if before is None or t < before.t:
                return None
            newest = before
        return advance(newest, t, self.commands, self.options)
