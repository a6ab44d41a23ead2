"""From links to robots."""

from __future__ import annotations

import socket

import pytest

from airground.errors import InputError, UnreachableError
from airground.robots import Robot, check_link, open_robot


def test_a_link_says_where_and_how() -> None:
    assert check_link("red", "udp://robot.local:7001") == ("robot.local", 7001, {})
    link = "udp://[::1]:9?timeout_s=1&rate_hz=50"
    assert check_link("red", link) == ("::1", 9, {"timeout_s": 1.0, "rate_hz": 50.0})


@pytest.mark.parametrize(
    ("link", "says"),
    [
        ("embedded", "robot red: the link 'embedded' belongs to the embedded world"),
        ("embedded:red", "embedded world"),
        ("serial:///dev/ttyUSB0", "there is no link 'serial:///dev/ttyUSB0'; there are udp, such as udp:"),
        ("", "there is no link ''"),
        ("192.168.1.20:7001", "there is no link"),
        ("udp://robot", "must be host and port"),
        ("udp://:7001", "must be host and port"),
        ("udp://robot:70000", "is no link"),
        ("udp://robot:0", "1 to 65535"),
        ("udp://robot:x", "is no link"),
        ("udp://me:secret@robot:1", "must be host and port"),
        ("udp://robot:1/path", "must be host and port"),
        ("udp://robot:1?speed=3", "says 'speed'; what may be said is rate_hz, timeout_s, lost_s"),
        ("udp://robot:1?rate_hz=fast", "rate_hz must be a number, not 'fast'"),
        ("udp://[::1:5", "is no link"),
    ],
)  # fmt: skip
def test_what_is_no_link_is_refused_in_one_line(link: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as caught:
        open_robot("red", link)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "numbers",
    ["rate_hz=5", "rate_hz=nan", "timeout_s=0.01", "timeout_s=60", "timeout_s=nan", "lost_s=0"],
)
def test_numbers_out_of_range_are_refused(numbers: str) -> None:
    with pytest.raises(InputError, match=numbers.split("=", maxsplit=1)[0]):
        open_robot("red", f"udp://127.0.0.1:9?{numbers}")


def test_a_host_that_nobody_knows_cannot_be_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_: object, **__: object) -> None:
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)  # no test asks a name server
    with pytest.raises(UnreachableError, match="no way to nowhere.invalid:9"):
        open_robot("red", "udp://nowhere.invalid:9")


def test_a_link_gives_a_robot() -> None:
    with open_robot("red", "udp://127.0.0.1:9") as robot:
        assert isinstance(robot, Robot)
        assert robot.name == "red"
        assert robot.link.state == "opening"
