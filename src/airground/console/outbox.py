"""What waits to be sent to one client: never more than a slow one can be told in a moment."""

from __future__ import annotations

import asyncio
from collections import deque

__all__ = ["Outbox"]

EVENT = "event/"


class Outbox:
    """Newest state per key, replies in their order, and one image. Belongs to the event loop's thread.

    Parameters
    ----------
    replies : int
        Most replies that may wait.
    events : int
        Most events that may wait; the oldest give way.
    """

    def __init__(self, replies: int = 256, events: int = 100) -> None:
        self._most_replies = replies
        self._most_events = events
        self._replies: deque[str] = deque()
        self._states: dict[str, str] = {}
        self._events: deque[str] = deque()  # their keys
        self._image: bytes | None = None
        self._image_next = False
        self._waiting = asyncio.Event()

    def __len__(self) -> int:
        return len(self._replies) + len(self._states) + (self._image is not None)

    def put(self, key: str, text: str) -> None:
        """Tell a state; one of the same key that waits is replaced, and keeps its turn.

        Parameters
        ----------
        key : str
            What it is about.
        text : str
            The message.
        """
        if key.startswith(EVENT) and key not in self._states:
            if len(self._events) >= self._most_events:
                self._states.pop(self._events.popleft(), None)
            self._events.append(key)
        self._states[key] = text
        self._waiting.set()

    def reply(self, text: str) -> bool:
        """Answer a message. Replies go before all else, and in their order.

        Parameters
        ----------
        text : str
            The message.

        Returns
        -------
        room : bool
            False if too many wait: the client asks and does not read.
        """
        if len(self._replies) >= self._most_replies:
            return False
        self._replies.append(text)
        self._waiting.set()
        return True

    def image(self, packet: bytes) -> None:
        """Show an image; one that waits is replaced.

        Parameters
        ----------
        packet : bytes
            The message.
        """
        self._image = packet
        self._waiting.set()

    def take(self) -> str | bytes | None:
        """Give what is to be sent next: replies, then states and the image in turn.

        Returns
        -------
        message : str or bytes or None
            None where nothing waits.
        """
        if self._replies:
            return self._replies.popleft()
        if self._image is not None and (self._image_next or not self._states):
            packet, self._image, self._image_next = self._image, None, False
            return packet
        self._image_next = True
        if self._states:
            key = next(iter(self._states))
            if self._events and self._events[0] == key:
                self._events.popleft()
            return self._states.pop(key)
        self._waiting.clear()
        return None

    async def next(self) -> str | bytes:
        """Wait for something to send.

        Returns
        -------
        message : str or bytes
            As `take` gives it.
        """
        while (message := self.take()) is None:
            await self._waiting.wait()
        return message
