"""An embedded world in another process: seen, heard and driven as one in this process is."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator

import numpy as np
import pytest

from airground.control import VelocityCommand
from airground.errors import UnreachableError
from airground.robots import Robot, RobotReading
from airground.session.clock import SessionClock
from airground.sim.live_apart import WorldApart
from airground.sim.live_options import FAMILY, EmbeddedOptions
from airground.vision.detectors.registry import make_detector
from airground.vision.frame import Frame
from waiting import until

PATIENT_S = 60.0  # the machine may be busy, and a floor is painted first
CURVE = VelocityCommand(0.3, 0.5)


@pytest.fixture
def clock() -> SessionClock:
    return SessionClock()


@pytest.fixture
def apart(clock: SessionClock) -> Iterator[WorldApart]:
    with WorldApart(EmbeddedOptions(robots=2), 3, clock) as world:
        yield world


def frame(world: WorldApart) -> Frame:
    found = world.camera.read(PATIENT_S)
    assert found is not None
    return found


def state(world: WorldApart) -> str:
    return world.camera.health.state


def link(robot: Robot) -> str:
    return robot.link.state


def process(world: WorldApart) -> int:
    pid = world._child._process.pid
    assert pid is not None
    return pid


def test_frames_readings_and_commands_cross_over(apart: WorldApart, clock: SessionClock) -> None:
    assert state(apart) == "opening"
    assert apart.camera.read(0.0) is None
    red, blue = apart.robots.values()
    assert isinstance(red, Robot)
    assert (red.name, blue.name) == ("red", "blue")
    first = frame(apart)
    assert first.size_px == (1280, 720)
    assert first.clock == "world"
    assert first.t <= clock() < first.t + PATIENT_S
    detector = make_detector(f"tag:family={FAMILY}")
    began = detector.detect(first)
    assert {"0", "1", "9"} <= set(began.labels)
    start = clock()
    heard: dict[str, list[RobotReading]] = {"red": [], "blue": []}

    def turned() -> bool:
        assert red.send(CURVE) == CURVE
        for robot in (red, blue):
            heard[robot.name] += robot.read()
        time.sleep(0.02)
        told = heard["red"]
        return bool(told) and told[-1].t > start + 2

    until(turned, PATIENT_S)
    assert link(red) == "live"
    assert heard["red"][-1].speed == pytest.approx(CURVE.v, abs=0.1)
    assert all(abs(k.speed or 0.0) < 0.05 for k in heard["blue"])
    stamps = np.array([k.t for k in heard["red"]])
    assert np.all(np.diff(stamps) > 0)
    assert stamps[-1] <= clock()
    newer = frame(apart)
    assert newer.index > first.index
    seen = detector.detect(newer)
    place = dict(zip(seen.labels, seen.uv, strict=True))
    place_before = dict(zip(began.labels, began.uv, strict=True))
    assert np.hypot(*(place["0"] - place_before["0"])) > 20  # it drove
    assert np.hypot(*(place["1"] - place_before["1"])) < 1  # it was told nothing
    assert state(apart) == "live"
    assert apart.camera.health.frames > 1


def test_the_newest_frame_wins_and_all_images_come_back(
    apart: WorldApart, clock: SessionClock
) -> None:
    last = frame(apart)
    for _ in range(3):  # more than there are slots for
        time.sleep(0.5)
        late = frame(apart)
        assert late.index > last.index
        last = late
    indices = [frame(apart).index for _ in range(8)]
    assert np.all(np.diff(indices) > 0)
    assert clock() - frame(apart).t < PATIENT_S


def test_a_world_that_dies_is_said_and_harms_nobody(apart: WorldApart) -> None:
    frame(apart)
    red = apart.robots["red"]
    until(lambda: bool(red.read()), PATIENT_S)
    os.kill(process(apart), signal.SIGKILL)

    def gone() -> bool:
        try:
            apart.camera.read(0.1)
        except UnreachableError as error:
            return "has died" in str(error)
        return False

    until(gone, PATIENT_S)
    assert state(apart) == "lost"
    assert red.send(CURVE) == CURVE  # lost, as on any link
    until(lambda: red.read() == [] and link(red) == "lost", PATIENT_S)
    apart.close()
    assert apart.camera.read(0.0) is None
    apart.close()


def test_closing_ends_the_process(clock: SessionClock) -> None:
    with WorldApart(EmbeddedOptions(robots=1), 3, clock) as world:
        pid = process(world)
        os.kill(pid, 0)  # it is there
    assert state(world) == "ended"
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_commands_do_not_pile_up_before_a_world_that_hangs(apart: WorldApart) -> None:
    frame(apart)
    red = apart.robots["red"]
    os.kill(process(apart), signal.SIGSTOP)
    try:
        began = time.monotonic()
        for _ in range(3000):  # a pipe holds fewer
            red.send(CURVE)
        assert time.monotonic() - began < PATIENT_S
    finally:
        os.kill(process(apart), signal.SIGCONT)
    until(lambda: bool(red.read()) and red.read() == [], PATIENT_S)
