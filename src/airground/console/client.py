"""One conversation over a WebSocket, from hello to the end."""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress
from typing import TYPE_CHECKING

from starlette.websockets import WebSocketDisconnect

from airground.console.access import token_matches
from airground.console.hub import VERSION
from airground.console.member import (
    BAD_HELLO,
    BAD_TOKEN,
    BAD_VERSION,
    FULL,
    LATE_HELLO,
    OURS,
    TOO_LARGE,
    Ending,
)
from airground.console.page_messages import Hello, HostileError, read_document, read_message

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from airground.console.desk import Desk
    from airground.console.hub import Hub
    from airground.console.member import Member

__all__ = ["converse"]

CLOSING_S = 1.0  # for saying goodbye to who may not read it
# Ends that the WebSocket layer finds by itself, and what they are counted as.
BROKEN = {1002: "protocol", 1007: "utf8", 1009: "too_large"}

log = logging.getLogger(__name__)


async def converse(websocket: WebSocket, hub: Hub, desk: Desk, token: str | None) -> None:
    """Talk to a client until one of the two has enough.

    Parameters
    ----------
    websocket : WebSocket
        Not accepted yet; where it comes from was looked at.
    hub : Hub
        That the client joins.
    desk : Desk
        That takes its messages.
    token : str or None
        That it must know; None where none is needed.
    """
    await websocket.accept()
    ending: Ending | None
    member: Member | None = None
    try:
        member, ending = await _greet(websocket, hub, token)
        if member is not None:
            ending = await _talk(websocket, hub, desk, member)
    except Exception:  # a fault of ours, which must not stay hidden
        log.exception("a conversation with the console failed")
        hub.tally.fault()
        ending = OURS
    finally:
        if member is not None:
            hub.leave(member)
    if ending is not None:
        with suppress(TimeoutError, WebSocketDisconnect, RuntimeError):  # it may be gone already
            async with asyncio.timeout(CLOSING_S):
                await websocket.close(ending.code, ending.reason)


async def _receive(websocket: WebSocket, hub: Hub) -> str | bytes | None:
    """Next message; None when there will be no more."""
    event = await websocket.receive()
    if event["type"] == "websocket.disconnect":
        kind = BROKEN.get(event.get("code") or 0)
        if kind is not None:
            hub.tally.hostile(kind)
        return None
    text = event.get("text")
    message: str | bytes = event.get("bytes") or b"" if text is None else text
    return message


async def _greet(
    websocket: WebSocket, hub: Hub, token: str | None
) -> tuple[Member | None, Ending | None]:
    if hub.waiting >= hub.limits.clients:
        hub.tally.hostile("full")
        return None, FULL
    hub.waiting += 1
    try:
        async with asyncio.timeout(hub.limits.hello_s):
            message = await _receive(websocket, hub)
    except TimeoutError:
        hub.tally.hostile("late_hello")
        return None, LATE_HELLO
    finally:
        hub.waiting -= 1
    if message is None:
        return None, None
    return _answer(message, hub, token)


def _answer(
    message: str | bytes, hub: Hub, token: str | None
) -> tuple[Member | None, Ending | None]:
    kind, ending = "full", FULL
    try:
        if isinstance(message, bytes):
            raise HostileError("binary", "a hello must be text")
        if len(message) > hub.limits.message_bytes:
            hub.tally.hostile("too_large")
            return None, TOO_LARGE
        hello = read_message(read_document(message, hub.limits.depth))
    except HostileError as fault:
        hub.tally.hostile(fault.kind)
        return None, BAD_HELLO
    if not isinstance(hello, Hello):
        kind, ending = "before_hello", BAD_HELLO
    elif not token_matches(token, hello.token):
        kind, ending = "token", BAD_TOKEN
    elif hello.version != VERSION:
        kind, ending = "version", BAD_VERSION
    elif (member := hub.join(hello.name)) is not None:
        return member, None
    hub.tally.hostile(kind)
    return None, ending


async def _talk(websocket: WebSocket, hub: Hub, desk: Desk, member: Member) -> Ending | None:
    """Read and write until the client leaves, or is sent away."""

    async def read() -> None:
        while member.ending is None:
            message = await _receive(websocket, hub)
            if message is None:
                return
            desk.receive(member, message)

    async def write() -> None:
        with suppress(WebSocketDisconnect):
            while True:
                message = await member.outbox.next()
                if isinstance(message, str):
                    await websocket.send_text(message)
                else:
                    await websocket.send_bytes(message)

    tasks = [asyncio.ensure_future(work) for work in (read(), write(), member.ended.wait())]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    for task in done:
        task.result()  # raises what went wrong
    return member.ending
