"""The UDP driver on real sockets, and against a robot in a process of its own that knows only docs/robots.md."""

from __future__ import annotations

import contextlib
import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from airground.control import STOP, VelocityCommand
from airground.robots.udp import UdpRobot
from waiting import until

PEER = Path(__file__).with_name("udp_robot.py")


@pytest.fixture
def peer() -> Iterator[socket.socket]:
    """A socket in the robot's place."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        line.settimeout(20)
        yield line


def heard(peer: socket.socket) -> tuple[dict[str, Any], Any]:
    text, sender = peer.recvfrom(4096)
    return json.loads(text), sender


def opened(peer: socket.socket, **options: Any) -> UdpRobot:
    return UdpRobot("red", "127.0.0.1", peer.getsockname()[1], **options)


def wait_for(peer: socket.socket, v: float, times: int = 1) -> list[dict[str, Any]]:
    """Commands until some in a row have a speed."""
    found: list[dict[str, Any]] = []
    end = time.monotonic() + 20
    while time.monotonic() < end:
        found.append(heard(peer)[0])
        if len(found) >= times and all(one["v_mps"] == v for one in found[-times:]):
            return found
    raise AssertionError(f"{v} m/s was never told {times} times: {found[-5:]}")


def reading(t_s: float, **more: Any) -> bytes:
    return json.dumps({"t_s": t_s, "speed_mps": 0.5, **more}).encode()


def test_the_newest_command_is_repeated_and_numbered(peer: socket.socket) -> None:
    with opened(peer) as robot:
        assert heard(peer)[0]["v_mps"] == 0.0  # it stands before anybody says anything
        assert robot.send(VelocityCommand(0.3, -0.2)) == VelocityCommand(0.3, -0.2)
        told = wait_for(peer, 0.3, times=4)  # one sending, and repeats of it
        numbers = [one["seq"] for one in told]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        assert {
            (one["omega_radps"], one["lateral_mps"], one["timeout_s"]) for one in told[-4:]
        } == {(-0.2, 0.0, 0.5)}
        assert told[-1]["t_s"] > told[-2]["t_s"]
        assert robot.link.sent >= numbers[-1]


def test_a_caller_that_falls_silent_is_replaced_by_a_stop(peer: socket.socket) -> None:
    """The loop hangs, and the driver's thread does not: it must not go on telling what was right once."""
    with opened(peer, timeout_s=0.2) as robot:
        robot.send(VelocityCommand(0.3, 0.0))
        wait_for(peer, 0.3)
        wait_for(peer, 0.0, times=3)
        robot.send(VelocityCommand(0.1, 0.0))
        wait_for(peer, 0.1)


def test_stop_and_close_say_it_several_times(peer: socket.socket) -> None:
    robot = opened(peer)
    robot.send(VelocityCommand(0.3, 0.0))
    wait_for(peer, 0.3)
    robot.stop()
    wait_for(peer, 0.0, times=3)
    robot.send(VelocityCommand(0.3, 0.0))
    wait_for(peer, 0.3)
    robot.close()
    robot.close()
    assert robot.link.state == "closed"
    assert robot.send(VelocityCommand(0.3, 0.0)) == STOP
    robot.stop()
    wait_for(peer, 0.0, times=5)
    peer.setblocking(False)  # on loopback what was sent is there
    rest = []
    with contextlib.suppress(BlockingIOError):
        while True:
            rest.append(heard(peer)[0])
    assert {one["v_mps"] for one in rest} <= {0.0}


def test_what_is_not_finite_stops_it(peer: socket.socket) -> None:
    with opened(peer) as robot:
        robot.send(VelocityCommand(0.3, 0.0))
        wait_for(peer, 0.3)
        assert robot.send(VelocityCommand(float("nan"), 0.0)) == STOP
        wait_for(peer, 0.0)


def test_readings_come_on_the_sessions_clock(peer: socket.socket) -> None:
    with opened(peer, clock=lambda: time.monotonic() - 500.0) as robot:
        driver = heard(peer)[1]
        for k in range(20):
            peer.sendto(reading(9000 + time.monotonic(), heading_rad=0.1 * k), driver)
            time.sleep(0.005)
        until(lambda: robot.link.received == 20)
        readings = robot.read()
        assert robot.read() == []
        assert [one.heading for one in readings] == pytest.approx([0.1 * k for k in range(20)])
        assert {one.speed for one in readings} == {0.5}
        assert {one.turn_rate for one in readings} == {None}
        now = time.monotonic() - 500.0
        assert now - 20 < readings[-1].t <= now
        assert robot.link.state == "live"
        assert robot.link.refused == 0


def test_strangers_rubbish_and_what_came_twice_are_counted_and_change_nothing(
    peer: socket.socket,
) -> None:
    with opened(peer) as robot, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        driver = heard(peer)[1]
        stranger.sendto(reading(5.0), driver)
        until(lambda: robot.link.refused == 1)
        assert "which is not the robot" in robot.link.note
        assert robot.link.state == "opening"
        peer.sendto(reading(5.0), driver)
        for text in (reading(5.0), reading(4.9), b"rubbish", b"x" * 60_000, b""):
            peer.sendto(text, driver)
        until(lambda: robot.link.refused == 6)
        peer.sendto(reading(5.1), driver)
        until(lambda: robot.link.received == 2)
        assert robot.link.refused == 6
        peer.sendto(reading(1.0), driver)  # it was started again
        until(lambda: robot.link.received == 3)
        assert [one.speed for one in robot.read()] == [0.5, 0.5, 0.5]


def test_a_flood_does_not_keep_commands_from_going_out(peer: socket.socket) -> None:
    with opened(peer) as robot:
        driver = heard(peer)[1]
        over = [False]

        def flood() -> None:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
                while not over[0]:
                    stranger.sendto(b"x" * 500, driver)

        thread = Thread(target=flood)
        thread.start()
        try:
            until(lambda: robot.link.refused > 200)
            robot.send(VelocityCommand(0.3, 0.0))
            robot.send(VelocityCommand(0.2, 0.0))
            wait_for(peer, 0.2, times=3)
        finally:
            over[0] = True
            thread.join()
        assert robot.read() == []


def test_nobody_there_is_told_and_survived() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        port = line.getsockname()[1]
    with UdpRobot("red", "127.0.0.1", port) as robot:
        for _ in range(5):
            robot.send(VelocityCommand(0.1, 0.0))
            time.sleep(0.01)
        assert robot.link.state == "opening"
        assert f"127.0.0.1:{port}" in robot.link.note


def test_a_robot_in_another_process_drives_is_lost_and_comes_back() -> None:
    with subprocess.Popen(
        [sys.executable, str(PEER), "--seconds", "60", "--clock-zero", "-3000"],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            port = int(process.stdout.readline().split()[1])
            began = time.monotonic()
            with UdpRobot(
                "red", "127.0.0.1", port, clock=lambda: time.monotonic() - began, timeout_s=0.3
            ) as robot:
                until(lambda: robot.link.state == "live")
                headings: list[float] = []

                def turned() -> bool:
                    robot.send(VelocityCommand(0.4, 1.0))
                    headings.extend(one.heading for one in robot.read() if one.heading is not None)
                    return bool(headings) and headings[-1] > 0.3

                until(turned)
                # We fall silent, the driver says so, and it stands.
                until(lambda: any(one.speed == 0.0 for one in robot.read()))
                # It hangs: we see that it is silent.
                process.send_signal(signal.SIGSTOP)
                until(lambda: robot.link.state == "lost")
                assert "silent" in robot.link.note
                process.send_signal(signal.SIGCONT)
                until(lambda: robot.link.state == "live")
                robot.send(VelocityCommand(0.4, 0.0))
                until(lambda: any(one.speed == 0.4 for one in robot.read()))
            # `close` has told it to stand; its own watchdog had nothing to do then.
            told: list[str] = []
            while not told or not told[-1].startswith("told") or told[-1].split()[2] != "0.0":
                told.append(process.stdout.readline())
            assert not told[-1].startswith("alone")
        finally:
            process.kill()
