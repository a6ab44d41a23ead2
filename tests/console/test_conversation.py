"""Real clients on real sockets: from hello to the end, and all ways of leaving."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from airground.console.limits import ConsoleLimits
from airground.console.server import ConsoleServer
from airground.vision.jpeg import decode_jpeg
from console.fake_session import FakeSession, make_tick
from console.real_page import HELLO, Page, health, wait_for

if TYPE_CHECKING:
    from pathlib import Path

ALIVE = {"kind": "alive"}


def test_a_whole_conversation(server: ConsoleServer, session: FakeSession) -> None:
    with Page(server) as page:
        first = json.loads(page.socket.recv(timeout=10))
        assert first["key"] == "hello"
        me = first["data"]["client"]
        assert first["data"]["site"]["robots"][0]["name"] == "robot-0"
        assert page.ask(kind="controls", take=True)["ok"]
        assert page.key("controls")["you"]
        assert page.order(kind="drive_to", robot="robot-0", goals_px=[[5, 6]])["ok"]
        assert session.asked("drive_to") == [me]
        page.send({"kind": "ping", "id": 77})
        assert page.until(lambda one: one.get("pong") == 77)["t"] > 0
        assert page.order(kind="stop")["ok"]
        assert (
            page.until(lambda one: one.get("key") == "state" and one["data"]["stop_heard"] == 1)[
                "data"
            ]["mode"]
            == "stopped"
        )
        page.order(kind="set_fences", stay_inside=[[[0, 0], [9, 0], [9, 9]]])
        assert page.until(lambda one: one.get("key") == "fences" and one["data"]["revision"] == 1)[
            "data"
        ]["stay_inside"] == [[[0, 0], [9, 0], [9, 9]]]
    wait_for(lambda: session.asked("gone") == [me])


def test_states_come_about_twenty_times_a_second(server: ConsoleServer) -> None:
    with Page(server) as page:
        numbers = [page.key("state")["number"] for _ in range(10)]
    assert numbers == sorted(set(numbers))


def test_images_come_one_by_one_at_the_width_that_was_asked(server: ConsoleServer) -> None:
    with Page(server) as page:
        page.send({"kind": "view", "image": True, "rate_hz": 20, "width_px": 600})
        header, data = page.image()
        assert (header["width"], header["height"], header["scale"]) == (640, 360, 0.5)
        assert decode_jpeg(data).shape == (360, 640, 3)
        until = time.monotonic() + 0.4
        while time.monotonic() < until:  # the next comes only when this one is acknowledged
            assert isinstance(page.socket.recv(timeout=10), str)
        page.send({"kind": "shown", "index": header["index"] + 100})
        page.send({"kind": "shown", "index": header["index"]})
        second, _ = page.image()
        assert second["index"] > header["index"] + 5  # the newest, not the next
        page.send({"kind": "view", "image": True, "rate_hz": 20, "width_px": 5000})
        header, _ = page.image()
        assert (header["width"], header["scale"]) == (1280, 1.0)
        page.send({"kind": "view", "image": False})
        page.send({"kind": "shown", "index": header["index"]})
        until = time.monotonic() + 0.2
        while time.monotonic() < until:
            assert isinstance(page.socket.recv(timeout=10), str)


def test_a_client_that_is_cut_off_stops_what_it_drove(
    server: ConsoleServer, session: FakeSession
) -> None:
    ann = Page(server)
    with Page(server) as bob:
        ann.ask(kind="controls", take=True)
        ann.cut()
        wait_for(lambda: len(session.asked("gone")) == 1)
        assert (
            bob.until(lambda one: one.get("key") == "controls" and one["data"]["clients"] == 1)[
                "data"
            ]["holder"]
            is None
        )


def test_a_holder_that_is_silent_on_an_open_line_stops_what_it_drove(
    session: FakeSession, page: Path
) -> None:
    limits = ConsoleLimits(silence_s=0.2)
    with ConsoleServer(session, port=0, page=page, limits=limits) as server, Page(server) as ann:
        ann.ask(kind="controls", take=True)
        for _ in range(8):
            time.sleep(0.05)
            ann.order(**ALIVE)
        assert session.asked("gone") == []
        line = ann.until(lambda one: one.get("reply", 0) is None)["line"]
        assert "not heard" in line
        assert len(session.asked("gone")) == 1
        assert not ann.order(**ALIVE)["ok"]
        assert ann.ask(kind="controls", take=True)["ok"]


@pytest.mark.parametrize(
    ("hello", "code"),
    [
        ("nonsense", 4400),
        (b"\x00", 4400),
        ({"kind": "order", "seq": 1, "order": {"kind": "stop"}}, 4400),
        ({"kind": "hello"}, 4400),
        ({"kind": "hello", "version": 2, "token": "right-token"}, 4409),
        ({"kind": "hello", "version": 1, "token": "wrong-token"}, 4401),
        ({"kind": "hello", "version": 1}, 4401),
        ('{"kind":"hello","version":1,"token":"\\ud800"}', 4401),
    ],
)
def test_who_does_not_say_hello_as_it_should_is_sent_away(
    session: FakeSession, page: Path, hello: object, code: int
) -> None:
    with (
        ConsoleServer(session, port=0, token="right-token", page=page) as server,
        Page(server, hello) as client,
    ):
        found, reason = client.ending()
        assert found == code
        assert reason
        assert health(server)["hostile"] == 1
        with Page(server, HELLO | {"token": "right-token"}) as right:
            assert right.key("hello")
    assert session.orders == []


def test_who_says_nothing_is_sent_away(session: FakeSession, page: Path) -> None:
    limits = ConsoleLimits(hello_s=0.1)
    with (
        ConsoleServer(session, port=0, page=page, limits=limits) as server,
        Page(server, None) as client,
    ):
        assert client.ending()[0] == 4408


@pytest.mark.parametrize(
    "options",
    [
        {"origin": "http://evil.example"},
        {"origin": None},
        {"origin": "null"},
        {"origin": "http://localhost:1"},
        {"additional_headers": {"Host": "rebound.example"}},
        {"origin": "http://rebound.example", "additional_headers": {"Host": "rebound.example"}},
    ],
)
def test_a_page_of_another_site_does_not_get_in(
    server: ConsoleServer, session: FakeSession, options: dict[str, Any]
) -> None:
    with pytest.raises(InvalidStatus) as caught:
        Page(server, **options)
    assert caught.value.response.status_code in (400, 403, 421)
    assert session.orders == []


@pytest.mark.parametrize(
    ("frame", "code", "kind"),
    [
        (b"\x81\x82\0\0\0\0\xff\xfe", 1007, "utf8"),
        (b"\x81\xff" + (2**40).to_bytes(8, "big") + b"\0\0\0\0", 1009, "too_large"),
        (b"\x8f\x80\0\0\0\0", 1002, "protocol"),
    ],
)
def test_broken_frames_end_the_conversation_and_are_counted(
    server: ConsoleServer, session: FakeSession, frame: bytes, code: int, kind: str
) -> None:
    with Page(server) as client:
        client.ask(kind="controls", take=True)
        client.socket.socket.sendall(frame)
        assert client.ending()[0] == code
    wait_for(lambda: len(session.asked("gone")) == 1)
    assert health(server)["by_kind"] == {kind: 1}


def test_a_flood_is_ended_and_stop_in_it_is_heard(
    server: ConsoleServer, session: FakeSession
) -> None:
    with Page(server) as client:
        stop = {"kind": "order", "seq": 1, "order": {"kind": "stop"}}
        try:
            for number in range(5000):
                client.send({"kind": "shown", "index": number} if number != 300 else stop)
        except ConnectionClosed:
            pass
        assert client.ending() == (4429, "too many messages")
    assert len(session.asked("stop")) == 1


def test_thirty_two_and_no_more(server: ConsoleServer) -> None:
    with ExitStack() as stack:
        pages = [stack.enter_context(Page(server)) for _ in range(32)]
        for page in pages:
            page.key("hello")
        with Page(server) as one_more:
            assert one_more.ending()[0] == 4503
        assert pages[0].ask(kind="controls", take=True)["ok"]
        pages.pop().socket.close()
        wait_for(lambda: health(server)["clients"] == 31)
        with Page(server) as next_one:
            assert next_one.key("hello")


def resident_kb() -> int:
    with open("/proc/self/statm") as file:  # noqa: PTH123
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="needs Linux's /proc")  # noqa: PTH110
def test_a_client_that_does_not_read_costs_no_memory_and_sees_the_newest_when_it_does(
    server: ConsoleServer, session: FakeSession
) -> None:
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    raw.connect(("127.0.0.1", server.port))
    with Page(server, sock=raw, max_queue=1) as slow, Page(server) as quick:
        slow.key("hello")
        slow.send({"kind": "view", "image": True, "rate_hz": 20, "width_px": 1280})
        others = 20 * quick.key("state")["others"]  # long states, to fill all buffers soon
        assert len(others) == 200
        session.changes["others"] = make_tick().others * 20
        before = resident_kb()
        for _ in range(25):
            newest = quick.key("state")
        assert resident_kb() - before < 20_000
        last = newest["t"]
        state, read = slow.key("state"), 1
        while state["t"] < last:  # what is in the buffers is old, and there is an end to it
            state, read = slow.key("state"), read + 1
        assert read < 20
        assert slow.ask(kind="order", order={"kind": "stop"})["ok"]


def test_the_end_of_the_server_is_told(session: FakeSession, page: Path) -> None:
    with ConsoleServer(session, port=0, page=page) as server:
        client = Page(server)
        client.ask(kind="controls", take=True)
        closing = threading.Thread(target=server.close)
        closing.start()
        assert client.ending()[0] == 1012
        closing.join()
    assert len(session.asked("gone")) == 1
    assert session.listeners == []
