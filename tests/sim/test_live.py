"""The embedded world by the clock: camera and robots in threads, as a session has them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from threading import Thread

import numpy as np
import pytest

from airground.control import STOP, VelocityCommand
from airground.errors import InputError, UnreachableError
from airground.robots import Robot
from airground.sim.live import LiveWorld
from airground.sim.live_camera import EmbeddedCamera
from airground.sim.live_options import EmbeddedOptions
from airground.sim.live_robot import EmbeddedRobot
from airground.sim.live_world import EmbeddedWorld
from airground.vision.frame import Frame, ImageArray
from airground.vision.sources import FrameSource
from live_runs import CURVE
from waiting import until

PATIENT_S = 30.0  # the machine may be busy


class Clock:
    """Seconds since it was made, and what somebody adds."""

    def __init__(self) -> None:
        self.began = time.monotonic()
        self.ahead = 0.0

    def __call__(self) -> float:
        return time.monotonic() - self.began + self.ahead


@pytest.fixture(scope="module")
def clock() -> Clock:
    return Clock()


@pytest.fixture(scope="module")
def shared(clock: Clock) -> Iterator[LiveWorld]:
    """One for all tests of the camera: a floor takes its time to be painted."""
    with LiveWorld(EmbeddedWorld(EmbeddedOptions(robots=2), seed=3), clock) as world:
        yield world


@pytest.fixture
def live(shared: LiveWorld) -> LiveWorld:
    """All is well in it."""
    shared.camera.patience_s = PATIENT_S
    shared.faults.clear()
    return shared


@pytest.fixture
def unseen() -> LiveWorld:
    """One whose camera is not started."""
    return LiveWorld(EmbeddedWorld(EmbeddedOptions(), seed=3), Clock())


def state(thing: EmbeddedCamera | EmbeddedRobot) -> str:
    return thing.link.state if isinstance(thing, EmbeddedRobot) else thing.health.state


def frame(live: LiveWorld) -> Frame:
    found = live.camera.read(PATIENT_S)
    assert found is not None
    return found


def test_frames_come_newest_first_with_the_sessions_times(live: LiveWorld, clock: Clock) -> None:
    assert isinstance(live.camera, FrameSource)
    first = frame(live)
    assert state(live.camera) == "live"
    assert (first.clock, first.size_px, live.camera.clock) == ("world", (1280, 720), "world")
    dropped = live.camera.health.dropped
    until(lambda: live.camera.health.dropped >= dropped + 3)  # nobody reads
    later = frame(live)
    assert later.index > first.index + 3
    assert later.t <= clock()
    # Times are those of the numbers, whatever the machine does meanwhile.
    assert later.t - first.t == pytest.approx((later.index - first.index) / 20, abs=1e-6)
    assert live.camera.health.frames >= 2
    assert live.camera.health.frozen_s == 0.0


def test_robots_are_read_told_and_stopped_while_the_camera_draws(
    live: LiveWorld, clock: Clock
) -> None:
    red = live.robots["red"]
    assert isinstance(red, Robot)
    assert list(live.robots) == ["red", "blue"]
    ended: list[str] = []

    def loop() -> None:
        while clock() < 60 and not ended:
            live.robots["blue"].read()
            live.robots["blue"].send(VelocityCommand(0.2, 0.4))
            time.sleep(0.01)

    thread = Thread(target=loop)
    thread.start()
    try:
        start = live.truth("red").xy
        seen = frame(live).index

        def driven() -> bool:
            assert red.send(CURVE) == CURVE
            live.camera.read(0.0)
            return bool(np.hypot(*(live.truth("red").xy - start)) > 0.1)

        until(driven)
        readings = red.read()
        assert state(red) == "live"
        assert red.link.received == len(readings) > 10
        assert readings[-1].t <= clock()
        assert np.diff([one.t for one in readings]).min() > 0
        assert max(one.speed or 0.0 for one in readings) > 0.2
        red.stop()
        until(lambda: abs(live.truth("red").v) < 1e-3)
        assert np.hypot(*(live.truth("blue").xy - live.world.truth("blue", live.world.now).xy)) < 1
        until(lambda: frame(live).index > seen + 5)
    finally:
        ended.append("now")
        thread.join()
    assert live.truth("blue").theta > 3 * np.pi / 4 + 0.05


def test_commands_are_given_as_they_were_sent(unseen: LiveWorld) -> None:
    red = unseen.robots["red"]
    assert red.send(VelocityCommand(0.1, 0.2, 0.3)) == VelocityCommand(0.1, 0.2)
    assert red.send(VelocityCommand(float("nan"), 0.2)) == STOP
    assert red.link.sent == 2
    red.close()
    red.close()
    assert red.send(CURVE) == STOP
    red.stop()
    assert red.read() == []
    assert (state(red), red.link.sent) == ("closed", 3)


def test_a_robot_that_falls_silent_is_lost_and_comes_back(unseen: LiveWorld) -> None:
    red = unseen.robots["red"]
    assert state(red) == "opening"
    until(lambda: bool(red.read()))
    unseen.faults.robot("red", link_gone=True)

    def lost() -> bool:
        red.read()
        return state(red) == "lost"

    until(lost)
    assert "silent" in red.link.note
    unseen.faults.clear()
    until(lambda: bool(red.read()) and state(red) == "live")


def test_a_camera_that_is_gone_is_lost_raises_and_comes_back(live: LiveWorld) -> None:
    before = frame(live)
    live.faults.camera(gone=True)
    live.camera.patience_s = 0.3
    lost: list[str] = []

    def gone() -> bool:
        try:
            live.camera.read(0.1)
        except UnreachableError as error:
            lost.append(str(error))
        return bool(lost)

    until(gone)
    assert lost[0].startswith("lost the embedded camera: nothing for")
    until(lambda: state(live.camera) == "lost")
    live.camera.patience_s = PATIENT_S
    live.faults.clear()
    after = frame(live)
    assert after.segment == before.segment + 1
    assert after.index > before.index
    assert live.camera.health.reconnects == 1
    assert state(live.camera) == "live"


def test_a_frozen_camera_says_so(live: LiveWorld) -> None:
    frame(live)
    live.faults.camera(frozen=True)
    until(lambda: live.camera.health.frozen_s > 0.3)
    one, other = frame(live), frame(live)
    assert other.index > one.index
    assert np.array_equal(one.image, other.image)
    live.faults.clear()
    until(lambda: live.camera.health.frozen_s == 0.0)


def test_late_frames_are_late_and_are_counted(live: LiveWorld, clock: Clock) -> None:
    frame(live)
    live.faults.camera(late_s=0.6)

    def held() -> bool:
        found = frame(live)
        return (found.late_s or 0.0) > 0.59 and clock() - found.t >= 0.59

    until(held)
    assert live.camera.health.late > 0
    live.faults.clear()
    until(lambda: (frame(live).late_s or 0.0) < 0.1)


def test_a_computer_that_slept_goes_on(live: LiveWorld, clock: Clock) -> None:
    before = frame(live)
    clock.ahead += 3600.0
    until(lambda: frame(live).t > before.t + 3599)
    red = live.robots["red"]
    until(lambda: any(one.t > 3600 for one in red.read()))
    red.send(CURVE)
    assert live.world.now > 3600


def test_a_clock_that_goes_back_stops_the_world_only(live: LiveWorld, clock: Clock) -> None:
    frame(live)
    clock.ahead -= 0.5
    red = live.robots["red"]
    red.read()
    red.send(CURVE)
    clock.ahead += 0.5
    assert frame(live).t > 0


class Grey:
    """Draws quickly, once it has begun."""

    def __init__(self, painted: Callable[[], None] = lambda: None) -> None:
        self._painted = painted

    def clean(self, _: float) -> None:
        self._painted()

    def image(self, _: float, index: int) -> ImageArray:
        return np.full((72, 128, 3), index % 256, dtype=np.uint8)


def test_nobody_loses_patience_while_the_floor_is_being_painted(unseen: LiveWorld) -> None:
    def paint() -> None:
        time.sleep(0.5)
        unseen.camera.patience_s = PATIENT_S

    unseen.camera.patience_s = 0.1
    vars(unseen.world)["renderer"] = Grey(paint)
    with unseen:
        assert unseen.camera.read(0.2) is None
        assert unseen.camera.read(None) is not None


def test_closing_wakes_readers_and_stops_robots(unseen: LiveWorld) -> None:
    vars(unseen.world)["renderer"] = Grey()
    live = unseen.start()
    live.camera.patience_s = PATIENT_S
    frame(live)
    got: list[Frame | None] = []

    def read() -> None:
        while (found := live.camera.read(None)) is not None:
            got.append(found)
        got.append(None)

    thread = Thread(target=read)
    thread.start()
    until(lambda: len(got) > 2)
    live.robots["red"].send(CURVE)
    live.close()
    live.close()
    thread.join(20)
    assert got[-1] is None
    assert state(live.camera) == "ended"
    assert state(live.robots["red"]) == "closed"
    assert list(live.camera) == []


def test_a_bug_in_the_camera_is_raised_where_one_reads(unseen: LiveWorld) -> None:
    class Broken:
        def clean(self, _: float) -> None:
            raise ZeroDivisionError("of the camera")

    vars(unseen.world)["renderer"] = Broken()
    with unseen, pytest.raises(ZeroDivisionError, match="of the camera"):
        unseen.camera.read(PATIENT_S)


def test_a_camera_that_is_not_started_has_nothing(unseen: LiveWorld) -> None:
    assert state(unseen.camera) == "opening"
    assert unseen.camera.read(0.0) is None
    unseen.close()
    assert state(unseen.camera) == "ended"
    assert unseen.camera.read(None) is None


def test_unknown_robots_are_refused(unseen: LiveWorld) -> None:
    with pytest.raises(InputError, match="no robot is called"):
        unseen.truth("pink")
