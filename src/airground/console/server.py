"""The console's server: one address, one thread, one life."""

from __future__ import annotations

import errno
import re
import secrets
import socket
import threading
from typing import TYPE_CHECKING, Self

import uvicorn

from airground.console.access import is_loopback
from airground.console.app import console_app
from airground.console.hub import Hub
from airground.console.limits import ConsoleLimits
from airground.console.page_files import PAGE
from airground.console.sweeping import SweepingServer
from airground.errors import InputError, UnreachableError

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from airground.session.handle import SessionHandle

__all__ = ["ConsoleServer"]

TOKEN = re.compile(r"[A-Za-z0-9_-]{8,200}")  # stands in an address as it is
START_S = 10.0
GRACE_S = 1  # for clients to say goodbye
STOP_S = 10.0
# What the system holds for a client that reads slowly: more would show it an old world when it reads again.
SEND_BUFFER_BYTES = 131_072
UNREAD_S = 20.0  # after which the system gives up a client that takes nothing
MOST_REQUESTS = 128


def _bind(host: str, port: int) -> socket.socket:
    where = f"{host}:{port}"
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError) as error:
        raise UnreachableError(f"{host} is no address of this computer; try 127.0.0.1") from error
    family, _, _, _, address = found[0]
    try:
        listener = socket.create_server(address[:2], family=family)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            problem = f"{where} is in use by another program; choose another port, or 0 for any"
        elif error.errno == errno.EACCES:
            problem = f"{where} may not be used by you; choose a port above 1023"
        else:
            problem = f"cannot listen at {where}: {error.strerror or error}; try 127.0.0.1"
        raise UnreachableError(problem) from error
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)  # inherited
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(UNREAD_S * 1000))
    return listener


def _own_address(family: socket.AddressFamily) -> str:
    """Address by which others reach this computer; nothing is sent to find it."""
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect(("192.0.2.1" if family == socket.AF_INET else "2001:db8::1", 9))
            return str(probe.getsockname()[0])
    except OSError:
        return socket.gethostname()


class ConsoleServer:
    """Serves the console of a session, in a thread of its own. A context manager; entering it starts it.

    Parameters
    ----------
    handle : SessionHandle
        The session.
    host : str
        Address to bind to; beyond loopback, others on the network can watch and drive who know the token.
    port : int
        0 takes any that is free.
    token : str, optional
        That clients must know; where not given, none is needed on loopback, and a fresh one beyond it.
    limits : ConsoleLimits, optional
        On what clients do.
    page : Path
        Folder of the page.

    Raises
    ------
    InputError
        If the port or the token is wrong.
    UnreachableError
        If the address cannot be listened at.
    FileError
        If the folder holds no page.
    """

    def __init__(
        self,
        handle: SessionHandle,
        host: str = "127.0.0.1",
        port: int = 8000,
        token: str | None = None,
        *,
        limits: ConsoleLimits | None = None,
        page: Path = PAGE,
    ) -> None:
        if not 0 <= port <= 65535:
            raise InputError(f"port must be from 0 to 65535, not {port}")
        if token is not None and not TOKEN.fullmatch(token):
            raise InputError("a token must be 8 to 200 of the letters A-Z a-z 0-9 - _ only")
        limits = limits or ConsoleLimits()
        self._hub = Hub(handle, limits)
        self._socket = _bind(host, port)
        try:
            bound = self._socket.getsockname()
            loopback = is_loopback(bound[0])
            self.token = token if token is not None or loopback else secrets.token_urlsafe(16)
            self.port: int = bound[1]
            self._family = self._socket.family
            self._host = host if loopback else bound[0]
            app = console_app(self._hub, token=self.token, loopback=loopback, page=page)
        except BaseException:
            self._socket.close()
            raise
        config = uvicorn.Config(
            app,
            loop="asyncio",
            http="h11",
            ws="websockets-sansio",
            ws_max_size=limits.message_bytes,
            ws_per_message_deflate=False,  # images are compressed, and time is dear
            ws_ping_interval=5.0,
            ws_ping_timeout=10.0,
            lifespan="on",
            log_config=None,
            access_log=False,
            proxy_headers=False,
            server_header=False,
            date_header=False,
            limit_concurrency=MOST_REQUESTS,
            timeout_graceful_shutdown=GRACE_S,
        )
        self._server = SweepingServer(config)
        self._thread = threading.Thread(target=self._serve, name="console", daemon=True)
        self._fault: BaseException | None = None

    @property
    def url(self) -> str:
        """Address to open in a browser; holds the token, which the browser sends to nobody but the page."""
        host = self._host
        if host in ("0.0.0.0", "::"):
            host = _own_address(self._family)
        name = f"[{host}]" if ":" in host else host
        return f"http://{name}:{self.port}/" + (f"#token={self.token}" if self.token else "")

    def start(self) -> None:
        """Serve, from now on.

        Raises
        ------
        UnreachableError
            If that does not come about.
        """
        self._thread.start()
        if not self._server.ready.wait(START_S) or self._fault is not None:
            self.close()
            raise UnreachableError(f"the console at {self.url} could not start") from self._fault

    def _serve(self) -> None:
        try:
            self._server.run(sockets=[self._socket])
        except BaseException as error:  # SystemExit where the application did not start
            self._fault = error
        finally:
            self._server.ready.set()
            self._socket.close()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait for the end of serving.

        Parameters
        ----------
        timeout_s : float, optional [s]
            Give up after this.

        Returns
        -------
        ended : bool
            Whether it serves no more.
        """
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def close(self) -> None:
        """Say goodbye to all clients and stop serving; doing it again does nothing."""
        self._server.should_exit = True
        if not self.wait(STOP_S):
            self._server.force_exit = True
        self._socket.close()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
