"""The loop that runs: when it hangs or has a bug, robots are stopped past it, and a person is told."""

from __future__ import annotations

from threading import Event
from typing import TYPE_CHECKING, Any, cast

import pytest

from airground.control import STOP, Limits, VelocityCommand
from airground.robots import RobotLink, RobotReading
from airground.session.live import LiveSession
from airground.session.options import RobotOptions, SessionOptions
from airground.session.orders import Alive, Stop
from airground.session.session import Session
from airground.vision.sources.protocol import SourceHealth
from waiting import until

if TYPE_CHECKING:
    from airground.robots import Robot
    from airground.session.tick import SessionTick
    from airground.vision.eyes import Eyes


class Told:
    """A robot that remembers what it was told."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.link = RobotLink("live")
        self.sent: list[VelocityCommand] = []
        self.stops = 0
        self.closed = False

    def read(self) -> list[RobotReading]:
        return []

    def send(self, command: VelocityCommand) -> VelocityCommand:
        self.sent.append(command)
        return command

    def stop(self) -> None:
        self.stops += 1

    def close(self) -> None:
        self.closed = True

    def __enter__(self) -> Told:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Dark:
    """A camera that shows nothing."""

    name = "dark"
    health = SourceHealth("opening")

    def __init__(self) -> None:
        self.closed = Event()

    def read(self, timeout_s: float | None = None) -> None:
        self.closed.wait(min(timeout_s or 0.1, 0.1))

    def close(self) -> None:
        self.closed.set()


def live(core: Session) -> tuple[LiveSession, list[Told]]:
    robots = [Told(one.name) for one in core.options.robots]
    given = {robot.name: cast("Robot", robot) for robot in robots}
    return LiveSession(core, Dark(), cast("Eyes", object()), given), robots


def core() -> Session:
    robots = (RobotOptions("red", "0", limits=Limits()), RobotOptions("blue", "1"))
    return Session(SessionOptions(robots))


def test_commands_go_out_at_the_rate_whatever_the_camera_does_and_stop_comes_first() -> None:
    one, robots = live(core())
    ticks: list[SessionTick] = []
    with one:
        one.listen(ticks.append)
        one.submit("me", Alive())
        until(lambda: len(ticks) > 20)
        one.submit("somebody", Stop())
        until(lambda: ticks[-1].stop_heard == 1)
        ran = one.running
    assert (ran, one.running) == (True, False)
    for robot in robots:
        assert set(robot.sent) == {STOP}
        assert len(robot.sent) >= 20
        assert robot.stops >= 1
        assert robot.closed
    assert ticks[-1].mode == "stopped"
    one.close()  # again does nothing


def test_a_stop_goes_out_past_a_loop_that_is_busy_and_overtakes_what_it_decided(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What a step has decided before it knew of the stop is not sent after it."""
    session = core()
    deciding, go = Event(), Event()
    one, robots = live(session)
    real = session.step

    def step(t: float, inputs: Any, send: Any) -> SessionTick:
        def fast(commands: dict[str, VelocityCommand]) -> None:
            if t > 0.1 and not deciding.is_set():
                deciding.set()
                go.wait(20.0)
                commands = dict.fromkeys(commands, VelocityCommand(0.5, 0.0))
            send(commands)

        return real(t, inputs, fast)

    monkeypatch.setattr(session, "step", step)
    with one:
        until(deciding.is_set)
        before = [robot.stops for robot in robots]
        one.submit("anybody", Stop())
        assert all(robot.stops > n for robot, n in zip(robots, before, strict=True))
        told = [len(robot.sent) for robot in robots]
        go.set()
        until(lambda: all(len(r.sent) > n for r, n in zip(robots, told, strict=True)))
        assert all(command.at_rest for robot in robots for command in robot.sent)


def test_a_loop_that_hangs_has_its_robots_stopped_past_it(monkeypatch: pytest.MonkeyPatch) -> None:
    session, go = core(), Event()
    one, robots = live(session)
    real = session.step

    def step(t: float, *given: Any) -> SessionTick:
        if t > 0.3:
            go.wait(20.0)
        return real(t, *given)

    monkeypatch.setattr(session, "step", step)
    with one:
        until(lambda: all(robot.stops for robot in robots))
        told = [len(robot.sent) for robot in robots]
        until(lambda: "the control loop has hung for" in one._watchdog.line)
        go.set()
        until(lambda: all(len(r.sent) > n for r, n in zip(robots, told, strict=True)))
        until(lambda: not one._watchdog.line)  # it runs again
        assert one.running


@pytest.mark.parametrize("where", ["step", "listener", "robot"])
def test_a_bug_stops_all_robots_and_says_that_it_ended(
    where: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    session = core()
    one, robots = live(session)

    def bug(*_: Any) -> Any:
        raise ZeroDivisionError("a bug of ours")

    if where == "step":
        monkeypatch.setattr(session, "step", bug)
    elif where == "robot":
        monkeypatch.setattr(robots[0], "read", bug)
    with one:
        if where == "listener":
            one.listen(bug)
        until(lambda: bool(one.failed))
        until(lambda: all(robot.stops for robot in robots))
        assert one.failed == "ZeroDivisionError: a bug of ours"
        assert not one.running
        assert "ZeroDivisionError" in capsys.readouterr().err
    assert all(robot.closed for robot in robots)
