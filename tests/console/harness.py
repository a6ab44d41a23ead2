"""A hub without sockets: clients whose outbox is read by hand, and a clock that is set by hand."""

from __future__ import annotations

import asyncio
import json
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

from airground.console.desk import Desk
from airground.console.hub import Hub
from airground.console.limits import ConsoleLimits
from console.fake_session import FakeSession

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from airground.console.member import Member

BEAT_S = 0.01
FAST = ConsoleLimits(state_hz=1 / BEAT_S)


class Bench:
    """A session, a hub, a desk and a clock."""

    def __init__(self, limits: ConsoleLimits = FAST) -> None:
        self.t = 1000.0
        self.session = FakeSession()
        self.hub = Hub(self.session, limits, clock=lambda: self.t)
        self.desk = Desk(self.hub)

    def join(self, name: str = "") -> Member:
        """A client that has said hello, and has read what it was told."""
        member = self.hub.join(name)
        assert member is not None
        read(member)
        return member

    def say(self, member: Member, *messages: object) -> list[Any]:
        """Say something, and give what comes back."""
        for message in messages:
            text = message if isinstance(message, str | bytes) else json.dumps(message)
            self.desk.receive(member, text)
        return read(member)

    def take(self, member: Member, seq: int = 1, **more: object) -> list[Any]:
        return self.say(member, {"kind": "controls", "seq": seq, "take": True, **more})

    def kinds(self) -> list[tuple[str, str]]:
        """Who gave which orders."""
        return [(client, order.kind) for client, order in self.session.orders]

    def hostile(self) -> dict[str, int]:
        counts: dict[str, int] = self.hub.tally.document()["by_kind"]
        return counts


def read(member: Member) -> list[Any]:
    """All that waits for a client."""
    found = []
    while (message := member.outbox.take()) is not None:
        found.append(json.loads(message) if isinstance(message, str) else message)
    return found


def newest(messages: list[Any], key: str) -> Any:
    """Data of the newest message of a key."""
    return [one["data"] for one in messages if isinstance(one, dict) and one.get("key") == key][-1]


@asynccontextmanager
async def running(bench: Bench) -> AsyncIterator[Bench]:
    """The hub listens meanwhile."""
    bench.hub.start()
    try:
        yield bench
    finally:
        bench.hub.stop()


async def beat() -> None:
    """Let the hub look at the session once or more."""
    await asyncio.sleep(4 * BEAT_S)
