"""What comes in, in the order it comes in: readings integrated, sightings kept until the readings reach them."""

from __future__ import annotations

import math
from bisect import insort
from typing import TYPE_CHECKING, NamedTuple

from airground.calibration.online_path import OdometryNoise, PathPoint, ReadingPath
from airground.calibration.online_state import Counts

if TYPE_CHECKING:
    from collections.abc import Iterator

    from airground.calibration.online_state import OnlineOptions

__all__ = ["Intake", "Seen"]

LONGEST_QUEUE = 200  # sightings of a robot that wait for readings; the oldest go


class Seen(NamedTuple):
    """One sighting."""

    t: float
    """[s]. On the clock of the tracks."""

    robot: int
    """Number."""

    u: float
    """[px]. Undistorted."""

    v: float
    """[px]. Undistorted."""

    sigma: float
    """[px]. Of each coordinate."""


class Intake:
    """Queues of sightings and paths of readings, robot by robot.

    Parameters
    ----------
    options : OnlineOptions
        Noise and waiting time.
    """

    def __init__(self, options: OnlineOptions) -> None:
        self._noise = OdometryNoise(options.speed_noise, options.heading_noise, options.slip_floor)
        self._wait = options.wait_s
        self.names: list[str] = []
        self.paths: list[ReadingPath] = []
        self._number: dict[str, int] = {}
        self._queue: list[list[Seen]] = []
        self._taken: list[float] = []
        self.waiting = 0
        self.now = -math.inf
        self._late = self._duplicates = self._unread = self._late_readings = self._sightings = 0

    def path(self, target: str) -> ReadingPath:
        """Readings of a robot.

        Parameters
        ----------
        target : str
            Its name; a new one is a new robot.

        Returns
        -------
        path : ReadingPath
            To be added to.
        """
        k = self._number.get(target)
        if k is None:
            k = self._number[target] = len(self.names)
            self.names.append(target)
            self.paths.append(ReadingPath(self._noise))
            self._queue.append([])
            self._taken.append(-math.inf)
        return self.paths[k]

    def read(self, *, taken: bool) -> None:
        """Note that a reading came.

        Parameters
        ----------
        taken : bool
            Whether the path could use it.
        """
        if not taken:
            self._late_readings += 1

    def queue(self, t: float, target: str, u: float, v: float, sigma: float) -> bool:
        """Put a sighting in its place.

        Parameters
        ----------
        t : float [s]
            When.
        target : str
            Which robot.
        u : float [px]
            Where.
        v : float [px]
            Where.
        sigma : float [px]
            Of each coordinate.

        Returns
        -------
        again : bool
            Whether the robot has others waiting: time to see what is ready.
        """
        self._sightings += 1
        k = self._number.get(target)
        if k is None:
            self._unread += 1
            return False
        self.now = max(self.now, t)
        queue = self._queue[k]
        if t <= self._taken[k]:
            if t == self._taken[k]:
                self._duplicates += 1
            else:
                self._late += 1
            return False
        seen = Seen(t, k, u, v, sigma)
        if not queue or t > queue[-1].t:
            queue.append(seen)
        elif any(t == other.t for other in queue):
            self._duplicates += 1
            return False
        else:
            insort(queue, seen)
        self.waiting += 1
        if len(queue) > LONGEST_QUEUE:
            del queue[0]
            self.waiting -= 1
            self._unread += 1
        return len(queue) > 1

    def ready(
        self, offset: float, *, flush: bool = False
    ) -> Iterator[list[tuple[Seen, PathPoint]]]:
        """Sightings that the readings have reached, one of each robot at a time.

        Parameters
        ----------
        offset : float [s]
            To be added to their times to get the readings'.
        flush : bool
            Do not wait for those that may come out of order.

        Yields
        ------
        round : list of (Seen, PathPoint)
            Of different robots; never empty.
        """
        until = self.now - (0.0 if flush else self._wait)
        busy = [k for k, queue in enumerate(self._queue) if queue]
        while busy:
            found, still = [], []
            for k in busy:
                queue, path = self._queue[k], self.paths[k]
                while queue and queue[0].t <= until and queue[0].t + offset <= path.last_t:
                    seen = queue.pop(0)
                    self.waiting -= 1
                    self._taken[k] = seen.t
                    point = path.at(seen.t + offset)
                    if point is None:
                        self._unread += 1
                        continue
                    found.append((seen, point))
                    if queue:
                        still.append(k)
                    break
            if found:
                yield found
            busy = still

    def counts(self, used: int, refused: int) -> Counts:
        """Sum up.

        Parameters
        ----------
        used : int
            Sightings that counted.
        refused : int
            Sightings that did not fit.

        Returns
        -------
        counts : Counts
            With what became of the rest.
        """
        return Counts(
            sightings=self._sightings,
            used=used,
            refused=refused,
            late=self._late,
            duplicates=self._duplicates,
            unread=self._unread,
            late_readings=self._late_readings,
        )
