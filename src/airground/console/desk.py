"""What comes of a client's messages. Hostile ones come to nothing but a count; STOP always comes through."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from airground.console.member import FLOOD, TOO_LARGE
from airground.console.page_messages import (
    AskControls,
    GiveOrder,
    Hello,
    HostileError,
    Ping,
    Shown,
    View,
    is_stop,
    read_document,
    read_message,
    seq_of,
)
from airground.errors import InputError
from airground.session.orders import Gone, Stop, parse_order

if TYPE_CHECKING:
    from airground.console.hub import Hub
    from airground.console.member import Member

__all__ = ["Desk"]

SHORT = 1000  # characters: a STOP is shorter, and is looked for even in a flood


class Desk:
    """Takes messages of clients that have said hello.

    Parameters
    ----------
    hub : Hub
        That the clients belong to.
    """

    def __init__(self, hub: Hub) -> None:
        self._hub = hub

    def receive(self, member: Member, message: str | bytes) -> None:
        """Do what a client asks, if it may; never raises for anything that it sends.

        Parameters
        ----------
        member : Member
            Who.
        message : str or bytes
            As it came.
        """
        now = self._hub.clock()
        seq = None
        try:
            if isinstance(message, bytes):
                raise HostileError("binary", "messages must be text")
            size = len(message)  # letters beyond ASCII are longer, and hardly used
            if size > self._hub.limits.message_bytes:
                member.end(TOO_LARGE)
                raise HostileError("too_large", "message too large")
            granted = member.messages.take(now) and member.bytes.take(now, size)
            if not granted and size > SHORT:
                raise HostileError("flood", "too many messages: some were dropped")
            document = read_document(message, self._hub.limits.depth)
            seq = seq_of(document)
            if is_stop(document):
                self._stop(member, seq, now)
                if not (granted or member.faults.take(now)):
                    member.end(FLOOD)
                return
            if not granted:
                raise HostileError("flood", "too many messages: some were dropped")
            self._obey(member, document, now)
        except HostileError as fault:
            self._hub.tally.hostile(fault.kind)
            member.refuse(fault, seq, now)

    def _stop(self, member: Member, seq: int | None, now: float) -> None:
        member.heard_s = now
        if seq is not None and seq > member.last_seq:
            member.last_seq = seq
        self._hub.submit(member, Stop(), seq)

    def _obey(self, member: Member, document: dict[str, Any], now: float) -> None:
        said = read_message(document)
        if isinstance(said, Hello):
            raise HostileError("malformed", "hello was said already")
        if isinstance(said, GiveOrder | AskControls):
            if said.seq <= member.last_seq:
                raise HostileError("bad_seq", f"seq must ascend; the last was {member.last_seq}")
            member.last_seq = said.seq
        if isinstance(said, GiveOrder):
            self._order(member, said)
        elif isinstance(said, AskControls):
            self._hub.hand_over(member, said)
        elif isinstance(said, View):
            member.flow.ask(said)
            self._hub.offer_image(member, now)
        elif isinstance(said, Shown):
            member.flow.acknowledge(said.index)
            self._hub.offer_image(member, now)
        elif isinstance(said, Ping):
            member.pong(said.id, self._hub.handle.now())
        member.heard_s = now  # understood: somebody is there

    def _order(self, member: Member, said: GiveOrder) -> None:
        if self._hub.controls.holder != member.client:
            raise HostileError("watcher", "take the controls first")
        try:
            order = parse_order(said.order)
        except InputError as error:
            raise HostileError("order", str(error)) from error
        if isinstance(order, Gone):
            raise HostileError("order", "gone is the server's to say; give back the controls")
        self._hub.submit(member, order, said.seq)
