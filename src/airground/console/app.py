"""The console as a web application: a page, its health, and one WebSocket. Nothing is written over HTTP."""

from __future__ import annotations

from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute

from airground.console.access import host_allowed, same_origin
from airground.console.client import converse
from airground.console.desk import Desk
from airground.console.page_files import PAGE, find_page_files, read_page_file
from airground.errors import FileError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from starlette.requests import Request
    from starlette.types import ASGIApp, Message, Receive, Scope, Send
    from starlette.websockets import WebSocket

    from airground.console.hub import Hub

__all__ = ["HEADERS", "Guard", "console_app"]

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; "
        "worker-src 'self' blob:; connect-src 'self'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}
"""On every answer."""


class Guard:
    """Turns away requests that mean another server, and puts the headers on every answer.

    Parameters
    ----------
    app : ASGIApp
        What it guards.
    hub : Hub
        That counts.
    loopback : bool
        Whether the server is bound to loopback.
    """

    def __init__(self, app: ASGIApp, hub: Hub, *, loopback: bool) -> None:
        self._app = app
        self._hub = hub
        self._loopback = loopback

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with 421 or 403."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                MutableHeaders(raw=message["headers"]).update(HEADERS)
            await send(message)

        headers = Headers(scope=scope)
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        host = hosts[0] if len(hosts) == 1 else None
        if not host_allowed(host, loopback=self._loopback):
            self._hub.tally.hostile("host")
            answer: ASGIApp = PlainTextResponse("this is not the server that you mean", 421)
        elif scope["type"] == "websocket" and not (
            len(origins) == 1 and same_origin(origins[0], host)
        ):
            self._hub.tally.hostile("origin")
            answer = PlainTextResponse("only the page of this server may connect", 403)
        else:
            answer = self._app
        await answer(scope, receive, send_with_headers)


def console_app(
    hub: Hub, *, token: str | None = None, loopback: bool = True, page: Path = PAGE
) -> ASGIApp:
    """Put the console together.

    Parameters
    ----------
    hub : Hub
        Begins to listen when the application starts, and stops with it.
    token : str, optional
        That clients must know.
    loopback : bool
        Whether the server is bound to loopback.
    page : Path
        Folder of the page.

    Returns
    -------
    app : ASGIApp
        To be run by a server with lifespan.

    Raises
    ------
    FileError
        If the folder holds no page.
    """
    files = find_page_files(page)
    desk = Desk(hub)

    @asynccontextmanager
    async def life(_: Starlette) -> AsyncIterator[None]:
        hub.start()
        try:
            yield
        finally:
            hub.stop()

    def file(request: Request) -> Response:  # in a thread, as it reads
        path = files.get(request.url.path)
        if path is None:
            return PlainTextResponse("there is no such file", 404)
        try:
            found = read_page_file(path)
        except FileError:
            return PlainTextResponse("there is no such file", 404)
        tag = {"ETag": found.tag}
        if request.headers.get("if-none-match") == found.tag:
            return Response(status_code=304, headers=tag)
        return Response(found.content, media_type=found.media_type, headers=tag)

    async def health(_: Request) -> Response:
        document = hub.health()
        return JSONResponse(document, 200 if document["status"] == "ok" else 503)

    async def talk(websocket: WebSocket) -> None:
        await converse(websocket, hub, desk, token)

    routes = [
        Route("/health", health, methods=["GET"]),
        WebSocketRoute("/ws", talk),
        Route("/{path:path}", file, methods=["GET"]),
    ]
    return Guard(Starlette(routes=routes, lifespan=life), hub, loopback=loopback)
