"""A cable that can be pulled: forwards TCP to a server on this computer, until told otherwise."""

from __future__ import annotations

import contextlib
import select
import socket
import struct
from threading import Event, Thread
from typing import Self

__all__ = ["Relay"]

CHUNK = 65536
LOOK_S = 0.05


class Relay:
    """Stands between a browser and a server. A context manager.

    Parameters
    ----------
    port : int
        Of the server, on 127.0.0.1.
    """

    def __init__(self, port: int) -> None:
        self._server = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._through = Event()
        self._through.set()
        self._closing = Event()
        self._ends: set[socket.socket] = set()
        self._threads: list[Thread] = []

    def fall_silent(self) -> None:
        """Forward nothing from now on; nobody is told, as where a radio link is lost."""
        self._through.clear()

    def cut(self) -> None:
        """Break all connections at once, and let none through."""
        self._through.clear()
        for one in list(self._ends):
            with contextlib.suppress(OSError):
                one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                one.shutdown(socket.SHUT_RDWR)

    def mend(self) -> None:
        """Forward again, also what has waited."""
        self._through.set()

    def _listen(self) -> None:
        while not self._closing.is_set():
            if not (self._through.is_set() and select.select([self._listener], [], [], LOOK_S)[0]):
                self._closing.wait(0 if self._through.is_set() else LOOK_S)
                continue
            near, _ = self._listener.accept()
            try:
                far = socket.create_connection(("127.0.0.1", self._server), timeout=10)
            except OSError:
                near.close()
                continue
            self._ends |= {near, far}
            thread = Thread(target=self._forward, args=(near, far), daemon=True)
            self._threads.append(thread)
            thread.start()

    def _forward(self, near: socket.socket, far: socket.socket) -> None:
        other = {near: far, far: near}
        with near, far, contextlib.suppress(OSError):
            while not self._closing.is_set():
                if not self._through.wait(LOOK_S):
                    if near.fileno() < 0 or _ended(near) or _ended(far):
                        return
                    continue
                for one in select.select([near, far], [], [], LOOK_S)[0]:
                    data = one.recv(CHUNK)
                    if not data:
                        return
                    other[one].sendall(data)
        self._ends -= {near, far}

    def __enter__(self) -> Self:
        thread = Thread(target=self._listen, daemon=True)
        self._threads.append(thread)
        thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self.cut()
        for thread in self._threads:
            thread.join(5)
        self._listener.close()


def _ended(one: socket.socket) -> bool:
    """Whether nothing but the end is left of a connection; reads nothing."""
    readable = select.select([one], [], [], 0)[0]
    return bool(readable) and not one.recv(1, socket.MSG_PEEK)
