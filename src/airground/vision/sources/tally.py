"""Counts of a source, from which snapshots of its health are made."""

from __future__ import annotations

from threading import Lock

from airground.vision.sources.protocol import SourceHealth, SourceState

__all__ = ["Tally"]

MOST_NOTES = 20


class Tally:
    """Counts that one thread adds to and another reads."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._counts: dict[str, int] = {}
        self._notes: list[str] = []

    def add(self, what: str, count: int = 1) -> None:
        """Count something.

        Parameters
        ----------
        what : str
            A field of `SourceHealth`.
        count : int
            How many more.
        """
        with self._lock:
            self._counts[what] = self._counts.get(what, 0) + count

    def note(self, line: str) -> None:
        """Keep a line for the user, once; of very many the newest.

        Parameters
        ----------
        line : str
            One line.
        """
        with self._lock:
            if line not in self._notes:
                self._notes = [*self._notes, line][-MOST_NOTES:]

    def health(
        self, state: SourceState, *, corrupt: int = 0, frozen_s: float = 0.0
    ) -> SourceHealth:
        """Take a snapshot.

        Parameters
        ----------
        state : SourceState
            Where the source stands.
        corrupt : int
            Broken pictures that the open decoder has counted itself, beside those counted here.
        frozen_s : float [s]
            For how long the picture has not changed.

        Returns
        -------
        health : SourceHealth
            As of now.
        """
        with self._lock:
            counts = {**self._counts, "corrupt": self._counts.get("corrupt", 0) + corrupt}
            return SourceHealth(state, frozen_s=frozen_s, notes=tuple(self._notes), **counts)
