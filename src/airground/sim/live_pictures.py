"""When the embedded camera's pictures are taken, stamped, and in memory."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from airground.sim.live_memory import KEPT_S

if TYPE_CHECKING:
    import numpy as np

    from airground.sim.live_faults import CameraFaults
    from airground.sim.live_options import EmbeddedOptions

__all__ = ["Picture", "Shutter"]

TINY_S = 1e-9


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture before anybody has drawn it."""

    index: int
    """As the camera counts."""

    exposed_s: float
    """When it was taken, in truth [s]."""

    t: float
    """When it was taken, as the camera stamps it [s]."""

    arrives_s: float
    """When it is in memory [s]."""

    segment: int
    """Grows when the camera was away."""

    late_s: float | None
    """How much later than usual it comes, where one can tell [s]."""

    frozen: bool
    """Whether it shows what the one before it showed."""


class Shutter:
    """Takes pictures at a steady rate, as the camera's faults let it.

    Parameters
    ----------
    options : EmbeddedOptions
        Rate and delays.
    rng : Generator
        Of the jitter.
    start_s : float [s]
        When the first picture is taken.
    """

    def __init__(self, options: EmbeddedOptions, rng: np.random.Generator, start_s: float) -> None:
        self._options = options
        self._rng = rng
        self._start_s = start_s
        self._slot = 0
        self._index = 0
        self._segment = 0
        self._away = False
        self._late_s = 0.0
        self._stamp = self._arrival = -1e300
        self._coming: deque[Picture] = deque()

    @property
    def next_s(self) -> float:
        """When the next picture is taken [s]."""
        return self._start_s + self._slot / self._options.camera_hz

    def run(self, t: float, faults: CameraFaults) -> None:
        """Take what is to be taken.

        Parameters
        ----------
        t : float [s]
            Now.
        faults : CameraFaults
            Since the last call.
        """
        if faults.late_s < self._late_s:  # what was held up is let go at once
            held = [replace(one, arrives_s=min(one.arrives_s, t)) for one in self._coming]
            self._coming = deque(held)
            self._arrival = min(self._arrival, t)
        self._late_s = faults.late_s
        if faults.gone:
            self._coming.clear()
            self._away = True
        while (exposed := self.next_s) <= t + TINY_S:
            self._slot += 1
            if not faults.gone:
                self._coming.append(self._take(exposed, faults))
        while self._coming and t - self._coming[0].arrives_s > KEPT_S - 2:  # nobody wants it
            self._coming.popleft()

    def skip(self, t: float) -> None:
        """Lose what was on its way, and go on from here.

        Parameters
        ----------
        t : float [s]
            Now.
        """
        self._coming.clear()
        slot = int((t - self._start_s) * self._options.camera_hz) + 1
        self._slot = max(self._slot, slot)

    def coming(self) -> tuple[Picture, ...]:
        """Give what has been taken and not been asked for yet.

        Returns
        -------
        pictures : tuple of Picture
            In order.
        """
        return tuple(self._coming)

    def arrived(self, t: float) -> list[Picture]:
        """Give what has arrived, once.

        Parameters
        ----------
        t : float [s]
            Now.

        Returns
        -------
        pictures : list of Picture
            In order.
        """
        found = []
        while self._coming and self._coming[0].arrives_s <= t + TINY_S:
            found.append(self._coming.popleft())
        return found

    def _take(self, exposed: float, faults: CameraFaults) -> Picture:
        o = self._options
        jitter = o.jitter_s * float(self._rng.exponential())
        stamp = exposed + o.latency_s
        arrival = max(stamp + jitter + faults.late_s, self._arrival)  # none overtakes another
        late_s: float | None = arrival - stamp
        if faults.stamped_late:
            stamp, late_s = max(arrival, self._stamp + 1e-6), None
        self._stamp = stamp = max(stamp, self._stamp + 1e-6)
        self._arrival = arrival
        self._segment += self._away
        self._away = False
        picture = Picture(
            self._index, exposed, stamp, arrival, self._segment, late_s, faults.frozen
        )
        self._index += 1
        return picture
