"""One client that has said hello: what waits for it, what it may still ask for, why it was sent away."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING

from airground.console.limits import ConsoleLimits, TokenBucket
from airground.console.messages import message_text
from airground.console.outbox import Outbox
from airground.console.pictures import ImageFlow

if TYPE_CHECKING:
    from airground.console.page_messages import HostileError

__all__ = [
    "BAD_HELLO",
    "BAD_TOKEN",
    "BAD_VERSION",
    "FLOOD",
    "FULL",
    "LATE_HELLO",
    "OURS",
    "TOO_LARGE",
    "UNREAD",
    "Ending",
    "Member",
]


@dataclass(frozen=True, slots=True)
class Ending:
    """Why the server ends a conversation. Distinct, so that a page knows whether to try again."""

    code: int
    """Close code of the WebSocket."""

    reason: str
    """In one line."""


TOO_LARGE = Ending(1009, "message too large")
OURS = Ending(1011, "fault of the server")
BAD_HELLO = Ending(4400, "the first message must be a hello")
BAD_TOKEN = Ending(4401, "wrong token: open the address that the server printed")
LATE_HELLO = Ending(4408, "no hello in time")
BAD_VERSION = Ending(4409, "page and server are of different versions: reload the page")
FLOOD = Ending(4429, "too many messages")
UNREAD = Ending(4430, "answers are not read")
FULL = Ending(4503, "too many clients")


class Member:
    """A client of the console. Belongs to the event loop's thread.

    Parameters
    ----------
    client : str
        Unique in this session.
    name : str
        To show to others.
    limits : ConsoleLimits
        What it may do.
    now : float [s]
        Any clock that does not go back.
    """

    def __init__(self, client: str, name: str, limits: ConsoleLimits, now: float) -> None:
        self.client = client
        self.name = name
        self.outbox = Outbox(limits.replies, limits.events)
        self.flow = ImageFlow(limits.state_hz)
        self.messages = TokenBucket(limits.messages_per_s, limits.burst_messages)
        self.bytes = TokenBucket(limits.bytes_per_s, limits.burst_bytes)
        self.faults = TokenBucket(limits.faults_per_s, limits.burst_faults)
        self.warned_s = -1.0
        self.last_seq = -1
        self.heard_s = now
        self.ending: Ending | None = None
        self.ended = asyncio.Event()

    def end(self, ending: Ending) -> None:
        """Send it away; the first reason counts.

        Parameters
        ----------
        ending : Ending
            Why.
        """
        self.ending = self.ending or ending
        self.ended.set()

    def reply(self, seq: int | None, ok: bool, line: str = "") -> None:
        """Answer a message, or tell of something that came of one.

        Parameters
        ----------
        seq : int or None
            Number of the message; None where it is not known.
        ok : bool
            Whether it was taken.
        line : str
            Why not.
        """
        self._say({"reply": seq, "ok": ok, "line": line})

    def pong(self, number: int, t: float) -> None:
        """Answer a ping.

        Parameters
        ----------
        number : int
            Of the ping.
        t : float [s]
            Session clock.
        """
        self._say({"pong": number, "t": round(t, 4)})

    def refuse(self, fault: HostileError, seq: int | None, now: float) -> None:
        """Say that a message was refused; who goes on with it is sent away.

        Parameters
        ----------
        fault : HostileError
            What was wrong.
        seq : int or None
            Number of the message, where it had one.
        now : float [s]
            As for `Member`.
        """
        if not self.faults.take(now):
            self.end(FLOOD)
        elif (
            fault.kind != "flood" or now - self.warned_s >= 1.0
        ):  # a flood is answered once a second
            self.warned_s = now if fault.kind == "flood" else self.warned_s
            self.reply(seq, False, fault.line)

    def _say(self, document: dict[str, object]) -> None:
        if not self.outbox.reply(message_text(document)):
            self.end(UNREAD)
