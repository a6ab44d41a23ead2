"""Connections that linger are cut, and no others."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import pytest
import uvicorn

from airground.console.sweeping import SweepingServer


@dataclass(eq=False)
class Transport:
    closing: bool = False
    aborted: bool = False

    def is_closing(self) -> bool:
        return self.closing

    def abort(self) -> None:
        self.aborted = True


@dataclass(eq=False)
class Request:
    response_complete: bool = True


@dataclass(eq=False)
class Http:
    cycle: Request | None = None
    transport: Transport = field(default_factory=Transport)


@dataclass(eq=False)
class WebSocket:
    transport: Transport = field(default_factory=Transport)


def server_with(*connections: Any) -> SweepingServer:
    server = SweepingServer(uvicorn.Config("none:app"))
    server.server_state.connections.update(connections)
    return server


@pytest.mark.parametrize(
    "connection",
    [Http(), Http(Request()), Http(transport=Transport(closing=True)), WebSocket(Transport(True))],
    ids=["asks nothing", "asks nothing more", "closed", "closed WebSocket"],
)
def test_what_lingers_is_cut(connection: Any) -> None:
    server = server_with(connection)
    server.sweep(100.0)
    server.sweep(107.0)
    assert not connection.transport.aborted
    server.sweep(109.0)
    assert connection.transport.aborted


@pytest.mark.parametrize("connection", [Http(Request(response_complete=False)), WebSocket()])
def test_what_is_at_work_is_not(connection: Any) -> None:
    server = server_with(connection)
    for now in range(100, 200, 10):
        server.sweep(float(now))
    assert not connection.transport.aborted


def test_a_connection_that_asks_again_and_again_is_not() -> None:
    connection = Http(Request())
    server = server_with(connection)
    for now in range(100, 130, 3):
        server.sweep(float(now))
        connection.cycle = Request()
    assert not connection.transport.aborted


def test_nothing_is_remembered_of_what_is_gone() -> None:
    connection = Http()
    server = server_with(connection)
    server.sweep(100.0)
    server.server_state.connections.clear()
    server.sweep(101.0)
    server.server_state.connections.add(connection)  # type: ignore[arg-type]
    server.sweep(109.5)
    assert not connection.transport.aborted
