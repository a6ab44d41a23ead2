"""The clients, and what all of them are told: listens to the session and fans out."""

from __future__ import annotations

import asyncio
import logging
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from airground._version import __version__
from airground.console.board import Board
from airground.console.controls import Controls
from airground.console.ear import Ear
from airground.console.limits import ConsoleLimits
from airground.console.member import Member
from airground.console.messages import plain, site_document, state_document
from airground.console.news import News
from airground.console.pictures import Pictures
from airground.console.tally import Tally
from airground.errors import AirgroundError
from airground.session.orders import Gone

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.console.controls import Handover
    from airground.console.page_messages import AskControls
    from airground.session.handle import SessionHandle
    from airground.session.orders import Order
    from airground.session.tick import SessionTick

__all__ = ["VERSION", "Hub"]

VERSION = 1
"""Of the protocol; page and server must speak the same."""

COUNTS_S = 1.0  # at most so often counts are told
STALL_S = 0.3  # a beat that is later than this tells that nobody was listened to meanwhile

log = logging.getLogger(__name__)


class Hub:
    """All of the console but sockets. Lives in the event loop's thread.

    Parameters
    ----------
    handle : SessionHandle
        The session.
    limits : ConsoleLimits
        On what clients do.
    clock : callable
        Seconds that do not go back.
    """

    def __init__(
        self,
        handle: SessionHandle,
        limits: ConsoleLimits | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.handle = handle
        self.limits = limits or ConsoleLimits()
        self.clock = clock
        self.controls = Controls()
        self.members: dict[str, Member] = {}
        self.waiting = 0
        self.tally = Tally()
        self._ear = Ear()
        self._period_s = 1 / self.limits.state_hz
        self._board = Board(self.members, self.limits.events)
        self._joined = 0
        self._counted_s = -COUNTS_S
        self._told: SessionTick | None = None
        self._told_s = 0.0
        self._beat: asyncio.Handle | None = None
        self._beat_due_s = self._beat_at = 0.0
        self._failed_s = -1.0

    # Life

    def start(self) -> None:
        """Begin to listen; called in a running event loop."""
        loop = asyncio.get_running_loop()
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="console-pictures")
        self._pictures = Pictures(self._pool)
        self._news = News(self.handle, self._pool, self._board.publish)
        self._ear.start(self.handle)
        self._beat_due_s, self._beat_at = self.clock(), loop.time()
        self._beat = loop.call_soon(self._on_beat)

    def stop(self) -> None:
        """Listen no more; whoever held the controls is gone."""
        if self._beat is None:
            return
        self._ear.stop()
        self._beat.cancel()
        for member in list(self.members.values()):
            self.leave(member)
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._beat = None

    # News

    def _on_beat(self) -> None:
        now = self.clock()
        late_s = now - self._beat_due_s
        self._beat_due_s = now + self._period_s
        loop = asyncio.get_running_loop()
        self._beat_at = max(self._beat_at + self._period_s, loop.time())
        self._beat = loop.call_at(self._beat_at, self._on_beat)
        if late_s > STALL_S:  # what they said meanwhile is not read yet
            for member in self.members.values():
                member.heard_s += late_s
        self._guarded(self._tell)
        self._guarded(self._look_for_silence)

    def _guarded(self, work: Callable[[], None]) -> None:
        """One view that cannot be told must not silence the console; it is logged once a second."""
        try:
            work()
        except Exception:
            self.tally.fault()
            if self.clock() - self._failed_s >= 1.0:
                self._failed_s = self.clock()
                log.exception("the console could not tell its clients what is new")

    def _tell(self) -> None:
        for client, why in self._ear.refusals():
            self.tally.refused()
            if (member := self.members.get(client)) is not None:
                member.reply(None, False, why)
        for event in self._ear.events():
            self._board.happened(event)
        now = self.clock()
        tick = self._ear.newest
        if tick is not None and tick is not self._told:
            self._told, self._told_s = tick, now
            self._news.tell(tick, now, anybody=bool(self.members))
        if self.tally.news and now - self._counted_s >= COUNTS_S:
            self.tally.news, self._counted_s = False, now
            self._board.publish("counts", self.tally.document())
        for member in self.members.values():
            self.offer_image(member, now)

    def _look_for_silence(self) -> None:
        holder = self.members.get(self.controls.holder or "")
        if holder is None:
            return
        if self.clock() - holder.heard_s > self.limits.silence_s:
            self.tally.silence()
            self._after(self.controls.give_back(holder.client))
            holder.reply(
                None,
                False,
                f"the controls were let go: you were not heard for {self.limits.silence_s:g} s",
            )

    def health(self) -> dict[str, Any]:
        """Give how the console stands, without anything that a token protects.

        Returns
        -------
        document : dict
            ``status`` is ``ok``, or ``silent`` where the session has said nothing for a second.
        """
        silent_s = None if self._told is None else self.clock() - self._told_s
        return {
            "status": "ok" if silent_s is not None and silent_s < 1.0 else "silent",
            "version": __version__,
            "protocol": VERSION,
            "clients": len(self.members),
            "held": self.controls.holder is not None,
            **self.tally.document(),
        }

    # Clients

    def join(self, name: str) -> Member | None:
        """Take in a client that has said hello, and tell it all that there is to know.

        Parameters
        ----------
        name : str
            To show to others.

        Returns
        -------
        member : Member or None
            None where there are too many.
        """
        if len(self.members) >= self.limits.clients:
            return None
        self._joined += 1
        client = f"c{self._joined}"
        member = Member(client, name or client, self.limits, self.clock())
        hello = {
            "version": VERSION,
            "server": f"airground {__version__}",
            "client": client,
            "site": site_document(self.handle.site),
            "limits": plain(self.limits),
        }
        member.outbox.put("hello", self._board.text("hello", hello))
        self._board.brief(member)
        if self._told is not None:  # also where the session has fallen silent since
            state = state_document(self._told, self.handle.now())
            member.outbox.put("state", self._board.text("state", state))
        self.members[client] = member
        self._tell_controls()
        return member

    def leave(self, member: Member) -> None:
        """Forget a client; if it held the controls, what it drove stops.

        Parameters
        ----------
        member : Member
            That is gone; doing it again does nothing.
        """
        if self.members.pop(member.client, None) is None:
            return
        handover = self.controls.give_back(member.client)
        self._after(handover)
        if not handover.changed:
            self._tell_controls()

    def submit(self, member: Member, order: Order, seq: int | None) -> None:
        """Hand an order to the session, and tell the client that it was.

        Parameters
        ----------
        member : Member
            Who asks, and may.
        order : Order
            What for.
        seq : int or None
            Number that the reply names.
        """
        try:
            self.handle.submit(member.client, order)
        except AirgroundError as error:
            member.reply(seq, False, str(error))
        else:
            member.reply(seq, True)

    def hand_over(self, member: Member, asked: AskControls) -> None:
        """Give or take the controls.

        Parameters
        ----------
        member : Member
            Who asks.
        asked : AskControls
            What for.
        """
        if asked.take:
            handover = self.controls.take(member.client, force=asked.force)
        else:
            handover = self.controls.give_back(member.client)
        self._after(handover)
        member.reply(asked.seq, handover.ok, handover.line)
        loser = self.members.get(handover.gone or "")
        if loser is not None and loser is not member:
            loser.reply(None, False, f"{member.name} has taken the controls")

    def _after(self, handover: Handover) -> None:
        if handover.gone is not None:
            with suppress(AirgroundError):  # the session has ended, and with it what was driven
                self.handle.submit(handover.gone, Gone())
        if handover.changed:
            self._tell_controls()

    def _tell_controls(self) -> None:
        holder = self.members.get(self.controls.holder or "")
        shared = {
            "holder": None if holder is None else holder.client,
            "name": "" if holder is None else holder.name,
            "clients": len(self.members),
        }
        for member in self.members.values():
            text = self._board.text("controls", shared | {"you": member is holder})
            member.outbox.put("controls", text)

    def offer_image(self, member: Member, now: float) -> None:
        """Send the newest image to a client, if it is due one.

        Parameters
        ----------
        member : Member
            Who.
        now : float [s]
            As the hub's clock gives it.
        """
        shown = self.handle.image() if member.flow.wanted else None
        if shown is None or not member.flow.begin(shown, now):
            return

        def give(packet: bytes | BaseException) -> None:
            if not isinstance(packet, bytes):
                self.tally.fault()
                member.flow.acknowledge(shown.index)
            elif member.flow.expects(shown):
                member.outbox.image(packet)

        self._pictures.ask(shown, member.flow.width_px, give)
