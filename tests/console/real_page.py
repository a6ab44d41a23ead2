"""What a page does on a real socket, and what it waits for."""

from __future__ import annotations

import json
import socket
import struct
import time
import urllib.error
import urllib.request
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.console.server import ConsoleServer

HELLO = {"kind": "hello", "version": 1, "name": "test"}


class Page:
    """What a page does, no more."""

    def __init__(self, server: ConsoleServer, hello: object = HELLO, **options: Any) -> None:
        place = f"127.0.0.1:{server.port}"
        usual = {"max_size": None, "max_queue": None, "open_timeout": 10, "close_timeout": 1}
        options = usual | {"origin": f"http://{place}"} | options
        self._life = ExitStack()
        self.socket: ClientConnection = self._life.enter_context(
            connect(f"ws://{place}/ws", **options)
        )
        self.seq = 0
        if hello is not None:
            self.send(hello)

    def send(self, message: object) -> None:
        self.socket.send(message if isinstance(message, str | bytes) else json.dumps(message))

    def ask(self, **message: object) -> dict[str, Any]:
        self.seq += 1
        self.send({"seq": self.seq, **message})
        return self.until(lambda one: one.get("reply") == self.seq)

    def order(self, **fields: object) -> dict[str, Any]:
        return self.ask(kind="order", order=fields)

    def until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The next text message that is wanted."""
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            message = self.socket.recv(timeout=10)
            if isinstance(message, str):
                document: dict[str, Any] = json.loads(message)
                if wanted(document):
                    return document
        pytest.fail("never came")

    def key(self, key: str) -> Any:
        return self.until(lambda one: one.get("key") == key)["data"]

    def image(self) -> tuple[dict[str, Any], bytes]:
        while not isinstance(message := self.socket.recv(timeout=10), bytes):
            continue
        length = int.from_bytes(message[:4], "big")
        return json.loads(message[4 : 4 + length]), message[4 + length :]

    def ending(self) -> tuple[int, str]:
        """Close code and reason."""
        try:
            while True:
                self.socket.recv(timeout=10)
        except ConnectionClosed as error:
            received = error.rcvd
        assert received is not None
        return received.code, received.reason

    def cut(self) -> None:
        """As when a cable is pulled and the system says so: no goodbye."""
        raw = self.socket.socket
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        raw.close()

    def __enter__(self) -> Page:
        return self

    def __exit__(self, *_: object) -> None:
        self._life.close()


def wait_for(true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 10
    while not true():
        assert time.monotonic() < deadline, "never came true"
        time.sleep(0.005)


def health(server: ConsoleServer) -> dict[str, Any]:
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{server.port}/health") as answer:
            text = answer.read()
    except urllib.error.HTTPError as answer:  # the session has not said anything yet
        with answer:
            text = answer.read()
    document: dict[str, Any] = json.loads(text)
    return document
