"""What all clients are told, and what is kept for those that come later."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from airground.console.messages import plain, state_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from airground.console.member import Member
    from airground.session.tick import SessionEvent

__all__ = ["Board"]

FLEETING = "state"  # not kept: who comes later is told a fresh one


class Board:
    """Numbers state messages, fans them out and keeps the newest of each key. Belongs to the event loop's thread.

    Parameters
    ----------
    members : mapping of str to Member
        Who is told.
    events : int
        How many events are kept.
    """

    def __init__(self, members: Mapping[str, Member], events: int) -> None:
        self._members = members
        self._rev = 0
        self._latest: dict[str, str] = {}
        self._events: deque[tuple[str, str]] = deque(maxlen=events)
        self._events_told = 0

    def text(self, key: str, data: Any) -> str:
        """Write a state message for one client.

        Parameters
        ----------
        key : str
            What it is about.
        data : object
            Plain.

        Returns
        -------
        text : str
            With a number of its own.
        """
        self._rev += 1
        return state_text(key, self._rev, data)

    def publish(self, key: str, data: Any) -> None:
        """Tell everybody, now and later, a state.

        Parameters
        ----------
        key : str
            What it is about; the newest wins.
        data : object
            Plain. None is told once and then forgotten.
        """
        text = self.text(key, data)
        if data is None:
            self._latest.pop(key, None)
        elif key != FLEETING:
            self._latest[key] = text
        self._tell(key, text)

    def happened(self, event: SessionEvent) -> None:
        """Tell everybody, now and later, what has happened.

        Parameters
        ----------
        event : SessionEvent
            Of the session.
        """
        self._events_told += 1
        key = f"event/{self._events_told}"
        text = self.text(key, plain(event))
        self._events.append((key, text))
        self._tell(key, text)

    def brief(self, member: Member) -> None:
        """Tell a client what was published before it came.

        Parameters
        ----------
        member : Member
            Who.
        """
        for key, text in (*self._latest.items(), *self._events):
            member.outbox.put(key, text)

    def _tell(self, key: str, text: str) -> None:
        for member in self._members.values():
            member.outbox.put(key, text)
