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
PATIENCE_S = 10.0


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
        self._cables = 0  # pulled so far
        self._closing = Event()
        self._threads: list[Thread] = []

    def fall_silent(self) -> None:
        """Forward nothing from now on; nobody is told, as where a radio link is lost."""
        self._through.clear()

    def cut(self) -> None:
        """Break all connections at once, and let none through."""
        self._through.clear()
        self._cables += 1

    def mend(self) -> None:
        """Forward again, also what has waited."""
        self._through.set()

    def _listen(self) -> None:
        while not self._closing.is_set():
            if not self._through.wait(LOOK_S):
                continue
            if not select.select([self._listener], [], [], LOOK_S)[0]:
                continue
            near, _ = self._listener.accept()
            near.settimeout(PATIENCE_S)
            try:
                far = socket.create_connection(("127.0.0.1", self._server), timeout=PATIENCE_S)
            except OSError:
                near.close()
                continue
            self._begin(self._forward, near, far, self._cables)

    def _forward(self, near: socket.socket, far: socket.socket, cable: int) -> None:
        other = {near: far, far: near}
        with near, far, contextlib.suppress(OSError):
            while cable == self._cables:
                if not self._through.wait(LOOK_S):
                    continue
                for one in select.select([near, far], [], [], LOOK_S)[0]:
                    data = one.recv(CHUNK)
                    if not data:
                        return
                    other[one].sendall(data)
            for one in other:  # a reset, not a goodbye
                one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

    def _begin(self, work: object, *arguments: object) -> None:
        assert callable(work)
        thread = Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def __enter__(self) -> Self:
        self._begin(self._listen)
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self.cut()
        for thread in self._threads:
            thread.join(PATIENCE_S)
        self._listener.close()
