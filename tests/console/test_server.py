"""One address, or one clear line why not."""

from __future__ import annotations

import socket
import urllib.request
from pathlib import Path
from typing import Any

import pytest

from airground.console.server import ConsoleServer
from airground.errors import FileError, InputError, UnreachableError
from console.fake_session import FakeSession


def test_port_0_takes_any_and_says_which(server: ConsoleServer) -> None:
    assert server.port > 0
    assert server.token is None
    assert server.url == f"http://127.0.0.1:{server.port}/"
    with urllib.request.urlopen(server.url) as answer:
        assert b"<title>page" in answer.read()
        assert "server" not in {key.lower() for key in answer.headers}


def test_a_port_in_use_is_one_line(server: ConsoleServer, page: Path) -> None:
    with pytest.raises(UnreachableError, match="in use by another program") as caught:
        ConsoleServer(FakeSession(), port=server.port, page=page)
    assert caught.value.exit_code == 4
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "kind", "line"),
    [
        ({"port": 70_000}, InputError, "port must be"),
        ({"port": -1}, InputError, "port must be"),
        ({"token": "short"}, InputError, "token must be"),
        ({"token": "with a space and #"}, InputError, "token must be"),
        ({"host": "192.0.2.7"}, UnreachableError, "cannot listen"),
        ({"host": "no such name!"}, UnreachableError, "no address of this computer"),
        ({"page": Path("nowhere")}, FileError, "index.html"),
    ],
)
def test_what_cannot_be_is_refused_at_once(
    page: Path, changes: dict[str, Any], kind: type[Exception], line: str
) -> None:
    options: dict[str, Any] = {"port": 0, "page": page} | changes
    with pytest.raises(kind, match=line):
        ConsoleServer(FakeSession(), **options)


def test_the_port_is_free_again_when_the_page_was_missing(page: Path, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    with pytest.raises(FileError):
        ConsoleServer(FakeSession(), port=port, page=tmp_path / "nowhere")
    with ConsoleServer(FakeSession(), port=port, page=page) as made:
        assert made.port == port


def test_beyond_loopback_a_token_is_made(page: Path) -> None:
    made = ConsoleServer(FakeSession(), "0.0.0.0", 0, page=page)
    try:
        assert made.token is not None
        assert len(made.token) >= 20
        assert made.url.endswith(f":{made.port}/#token={made.token}")
        assert "0.0.0.0" not in made.url
        other = ConsoleServer(FakeSession(), "0.0.0.0", 0, page=page)
        other.close()
        assert other.token != made.token
    finally:
        made.close()


def test_a_token_of_ones_own_is_needed_on_loopback_too(page: Path) -> None:
    made = ConsoleServer(FakeSession(), port=0, token="my-own-token", page=page)
    made.close()
    assert made.url == f"http://127.0.0.1:{made.port}/#token=my-own-token"


def test_closing_ends_it_and_may_be_done_twice(page: Path) -> None:
    session = FakeSession()
    made = ConsoleServer(session, port=0, page=page)
    assert made.wait(0)
    made.start()
    assert not made.wait(0.01)
    made.close()
    made.close()
    assert made.wait(0)
    assert session.listeners == []
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", made.port), timeout=1).close()


def test_a_session_that_cannot_be_listened_to_is_told_of(page: Path) -> None:
    class Deaf(FakeSession):
        def listen(self, listener: object) -> Any:
            raise RuntimeError(f"deaf to {listener}")

    made = ConsoleServer(Deaf(), port=0, page=page)
    with pytest.raises(UnreachableError, match="could not start"):
        made.start()
    assert made.wait(1)
