"""How long parts of the way from a frame to a command take."""

from __future__ import annotations

from collections import deque

import numpy as np

__all__ = ["Stages"]

KEPT = 400  # of each part: twenty seconds of a camera
EVERY = 25  # steps between two summaries


class Stages:
    """Keeps the newest durations of each part, and sums them up now and then. Its memory does not grow."""

    def __init__(self) -> None:
        self._kept: dict[str, deque[float]] = {}
        self._summary: dict[str, float] = {}
        self._steps = 0
        self._all: dict[str, list[float]] | None = None

    def keep(self, into: dict[str, list[float]] | None) -> None:
        """Keep every duration from now on [s], which grows without bounds: for measurements.

        Parameters
        ----------
        into : dict of str to list, or None
            Where; None to end that.
        """
        self._all = into

    def add(self, name: str, seconds: float) -> None:
        """Take a duration.

        Parameters
        ----------
        name : str
            Of the part.
        seconds : float [s]
            How long it took.
        """
        self._kept.setdefault(name, deque(maxlen=KEPT)).append(1e3 * seconds)
        if self._all is not None:
            self._all.setdefault(name, []).append(seconds)

    def summary(self) -> dict[str, float]:
        """Median and 99th percentile of each part, a little old.

        Returns
        -------
        summary : dict of str to float [ms]
            ``vision_median``, ``vision_p99``, ...
        """
        self._steps += 1
        if self._steps % EVERY == 1:
            self._summary = self.now()
        return self._summary

    def now(self) -> dict[str, float]:
        """The same, as it is now.

        Returns
        -------
        summary : dict of str to float [ms]
            Of what was kept.
        """
        summary = {}
        for name, kept in self._kept.items():
            median, p99 = np.percentile(np.array(kept), [50, 99]).tolist()
            summary[f"{name}_median"] = round(median, 3)
            summary[f"{name}_p99"] = round(p99, 3)
        return summary
