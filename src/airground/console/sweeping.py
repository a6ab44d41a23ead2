"""uvicorn's server, without what lingers."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

import uvicorn

if TYPE_CHECKING:
    import socket

__all__ = ["SweepingServer"]

SWEEP_BEATS = 10  # of uvicorn's, a tenth of a second each
IDLE_S = 8.0  # longer than uvicorn keeps a connection that has asked something


class SweepingServer(uvicorn.Server):
    """Cuts connections that ask nothing, or that were closed and do not read what is left.

    uvicorn waits for both for ever, and each costs a file of the process that drives robots.

    Parameters
    ----------
    config : uvicorn.Config
        As for uvicorn.
    """

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.ready = threading.Event()
        self._lingering: dict[Any, tuple[object, float]] = {}

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and say so.

        Parameters
        ----------
        sockets : list of socket, optional
            That listen.
        """
        await super().startup(sockets)
        self.ready.set()

    async def on_tick(self, counter: int) -> bool:
        """Sweep now and then.

        Parameters
        ----------
        counter : int
            Of uvicorn's beats.

        Returns
        -------
        ended : bool
            As uvicorn says.
        """
        if counter % SWEEP_BEATS == 0:
            self.sweep(time.monotonic())
        return await super().on_tick(counter)

    def sweep(self, now: float) -> None:
        """Cut what lingers.

        Parameters
        ----------
        now : float [s]
            Any clock that does not go back.
        """
        lingering: dict[Any, tuple[object, float]] = {}
        for connection in list(self.server_state.connections):
            transport: Any = connection.transport
            request = getattr(connection, "cycle", True)  # a WebSocket has none
            idle = request is None or getattr(request, "response_complete", False)
            if transport is None or not (idle or transport.is_closing()):
                continue
            before, since = self._lingering.get(connection, (request, now))
            since = since if before is request else now
            lingering[connection] = (request, since)
            if now - since > IDLE_S:
                transport.abort()
        self._lingering = lingering
