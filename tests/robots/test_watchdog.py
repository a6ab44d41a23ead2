"""The watchdog against loops that hang, also inside a driver."""

from __future__ import annotations

import time
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING

import pytest

from airground.errors import InputError
from airground.robots.watchdog import Watchdog
from waiting import until

if TYPE_CHECKING:
    from airground.robots import Robot


class Counted:
    """As much of a robot as a watchdog touches."""

    def __init__(self, name: str = "one", lock: Lock | None = None) -> None:
        self.name = name
        self.stops: list[float] = []
        self._lock = lock or Lock()

    def stop(self) -> None:
        with self._lock:
            self.stops.append(time.monotonic())


def robots(*some: Counted) -> list[Robot]:
    return list(some)  # type: ignore[arg-type]


def test_a_loop_that_feeds_it_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]  # a clock of its own: this machine may be slow
    monkeypatch.setattr("airground.robots.watchdog.monotonic", lambda: now[0])
    robot = Counted()
    with Watchdog(robots(robot), 0.04) as watchdog:
        for _ in range(60):
            now[0] += 0.03
            watchdog.feed()
            time.sleep(0.006)  # it looks every 5 ms
        assert (watchdog.stops, watchdog.line) == (0, "")
        now[0] += 0.05
        until(lambda: len(robot.stops) == 1)


def test_it_stops_all_robots_once_says_so_and_recovers() -> None:
    one, other = Counted(), Counted("other")
    lines: list[str] = []
    with Watchdog(robots(one, other), 0.1, tell=lines.append) as watchdog:
        fed = time.monotonic()
        watchdog.feed()
        until(lambda: bool(one.stops and other.stops))
        assert one.stops[0] - fed > 0.1
        time.sleep(0.25)
        assert (len(one.stops), len(other.stops), watchdog.stops) == (1, 1, 1)
        assert "hung" in watchdog.line
        assert "stopped" in lines[0]
        end = time.monotonic() + 20
        while watchdog.line and time.monotonic() < end:
            watchdog.feed()
            time.sleep(0.005)
        assert watchdog.line == ""
        until(lambda: len(one.stops) == 2)  # and it watches on
        assert lines[1] == "the control loop runs again"


def test_a_driver_that_hangs_keeps_no_other_robot_from_being_stopped() -> None:
    """The loop hangs inside the first robot, and holds its lock."""
    lock, let_go = Lock(), Event()
    hung, other = Counted("hung", lock), Counted("other")

    def loop() -> None:
        with lock:
            let_go.wait(20)

    thread = Thread(target=loop)
    thread.start()
    with Watchdog(robots(hung, other), 0.1) as watchdog:
        until(lambda: len(other.stops) == 1)
        watchdog.feed()
        until(lambda: len(other.stops) == 2)
        assert hung.stops == []
        let_go.set()
        thread.join()
        until(lambda: len(hung.stops) == 1)  # of two, one was enough


def test_closing_ends_it_and_leaves_robots_alone() -> None:
    robot = Counted()
    watchdog = Watchdog(robots(robot), 0.05).start()
    watchdog.close()
    watchdog.close()
    time.sleep(0.15)
    assert robot.stops == []


def test_it_needs_a_time() -> None:
    for after_s in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="after_s"):
            Watchdog([], after_s)
