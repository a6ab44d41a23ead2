"""Counts of what went wrong: a person should see that somebody knocks."""

from __future__ import annotations

from collections import Counter
from typing import Any

__all__ = ["Tally"]


class Tally:
    """Hostile messages by kind, orders that the session did not carry out, silent operators, faults of ours."""

    def __init__(self) -> None:
        self._hostile: Counter[str] = Counter()
        self._refused = self._faults = self._silences = 0
        self.news = True

    def hostile(self, kind: str) -> None:
        """Count a hostile message.

        Parameters
        ----------
        kind : str
            Which sort.
        """
        self._hostile[kind] += 1
        self.news = True

    def refused(self) -> None:
        """Count an order that the session did not carry out."""
        self._refused += 1
        self.news = True

    def silence(self) -> None:
        """Count an operator who was not heard any more."""
        self._silences += 1
        self.news = True

    def fault(self) -> None:
        """Count a fault of our own."""
        self._faults += 1
        self.news = True

    def document(self) -> dict[str, Any]:
        """Give all counts.

        Returns
        -------
        document : dict
            Data of the message ``counts``.
        """
        return {
            "refused": self._refused,
            "silences": self._silences,
            "faults": self._faults,
            "hostile": self._hostile.total(),
            "by_kind": dict(sorted(self._hostile.items())),
        }
