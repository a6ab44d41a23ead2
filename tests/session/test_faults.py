"""Each fault of docs/faults.md, at a moment that nobody chose: what happens, within what time, and when it is over."""

from __future__ import annotations

import errno
import os
import re
from math import inf
from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.robots import RobotReading
from airground.session.inputs import Heard
from airground.session.orders import DriveTo, Release, Rest, Stop
from airground.session.recorder import Recorder
from session_faults import AHEAD, FAULTS, with_fault
from session_runs import session, speed, under_way, view

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("name", FAULTS)
def test_the_robot_is_told_to_stand_in_time_and_a_person_why(
    name: str, rng: np.random.Generator
) -> None:
    fault = FAULTS[name]
    one, answer = with_fault(fault, float(rng.uniform(0, 0.1)), int(rng.integers(1000)))
    assert answer.rest_s <= fault.within_s
    assert answer.still_s <= fault.still_s
    assert answer.stop_s <= fault.stops_all_s
    assert answer.line
    assert any(re.search(fault.says, line) for line in one.said), one.said
    assert one.tick is not None
    assert one.tick.camera.state == fault.camera
    if fault.stops_all_s < inf:
        assert one.tick.mode == "stopped"
        assert re.search(f"{fault.says}|blocked, or carried", one.tick.why)

    if fault.ends:
        one.world.faults.clear()
        one.operator = "me"
    told = len(one.said)
    one.run(0.9)
    assert view(one).command.at_rest == (fault.then != "goes on")
    if fault.then == "goes on":
        assert view(one).task == "goal"
        assert speed(one) > 0.05
        assert "goes on" in one.said[0 if not fault.ends else told :]
        return
    assert view(one).task == "none"  # what was driven is forgotten
    if fault.then == "waits for release":
        one.order(DriveTo("red", (AHEAD,)))
        one.step()
        assert one.refused[-1] == "STOP is pressed: release it first"
        one.order(Release(), "somebody")
        one.run(0.4)
        assert one.tick.mode == "idle"
        assert view(one).command.at_rest
        assert view(one).stop == ""


def test_one_robot_whose_link_is_gone_keeps_no_other_from_driving() -> None:
    one = under_way(2)
    one.world.faults.robot("red", link_gone=True)
    one.run(1.0)
    assert view(one).command.at_rest
    assert view(one).stop_reason == "robot's link lost"
    assert speed(one) < 0.02
    assert speed(one, "blue") > 0.1
    assert view(one, "blue").stop == ""


def test_robots_that_are_taken_for_each_other_are_stopped() -> None:
    """Two robots side by side whose marks change places: neither is where its wheels have it."""
    one = under_way(2)
    one.world.faults.swap("red", "blue")
    one.run(1.5, lambda tick: tick.mode == "stopped")
    assert one.tick is not None
    assert re.search("(red|blue): for the 2nd time .* not where its wheels have it", one.tick.why)
    one.run(0.5)
    for name in ("red", "blue"):
        assert view(one, name).command.at_rest
        assert speed(one, name) < 0.02


def test_a_robot_that_does_not_heed_stop_is_told_of() -> None:
    one = under_way()
    one.world.faults.robot("red", runaway=True)
    one.order(Stop())
    one.run(2.5)
    assert view(one).command.at_rest
    assert (view(one).speed_mps or 0) > 0.1  # what it does is seen
    assert any(re.match(r"does not stop: told 0.0\d m/s .* does 0.2\d m/s", k) for k in one.said)


def test_a_robot_that_moves_and_is_to_stand_is_told_of_and_stops_no_other() -> None:
    one = under_way(1)
    one.world.faults.robot("red", runaway=True)
    one.order(Rest("red"))
    one.run(2.5)
    assert any("moves and is to stand, is it carried?" in line for line in one.said)
    assert one.tick is not None
    assert one.tick.mode == "idle"


def test_a_robot_that_is_carried_while_it_stands_may_be_sent_off_then() -> None:
    one = session()
    one.run(0.3)
    for _ in range(4):
        one.world.faults.push("red", ahead_m=0.1)
        one.run(0.2)
    assert one.tick is not None
    assert one.tick.mode == "idle"
    one.run(0.5)
    one.order(DriveTo("red", (AHEAD,)))
    one.run(0.8)
    assert speed(one) > 0.1


def test_a_robot_that_is_blocked_while_it_is_told_little_is_noticed() -> None:
    one = session()
    one.run(0.3)
    one.order(DriveTo("red", ((420.0, 430.0),)))  # it begins with a turn on the spot
    one.run(0.6)
    one.world.faults.robot("red", blocked=True)
    one.run(5.0, lambda tick: tick.mode == "stopped")
    assert one.tick is not None
    assert one.tick.mode == "stopped"
    assert "does not get on" in one.tick.why or "carried" in one.tick.why


@pytest.mark.parametrize("jump_s", [5.0, 0.6, -5.0])
def test_a_clock_that_jumps_stops_the_robot_at_once_and_it_goes_on(jump_s: float) -> None:
    one = under_way()
    assert one.tick is not None
    wrong = one.session.step(one.t + jump_s, [])
    assert wrong.commands["red"].at_rest
    red = wrong.robots[0]
    if jump_s > one.session.options.bounds.operator_s:
        assert any(event.line.startswith("me is not heard") for event in wrong.events)
        one.run(0.5)
        assert view(one).command.at_rest
        assert view(one).task == "none"
    else:
        assert red.stop_reason in ("clock", "late tick")
        assert any("clock" in event.line or "tick" in event.line for event in wrong.events)
        one.run(1.2)
        assert view(one).task == "goal"
        assert speed(one) > 0.2
    one.order(DriveTo("red", (AHEAD,)))
    one.run(1.0)
    assert speed(one) > 0.1


def test_a_robot_that_tells_nonsense_is_driven_by_what_the_camera_sees() -> None:
    one = under_way()
    for k in range(60):
        bad = (np.nan, np.inf, -np.inf, 1e300)[k % 4]
        nonsense = (RobotReading(bad, 0.0, 0.0, 0.0), RobotReading(one.t, bad, bad, bad))
        one.session.step(one.t + 0.01, [Heard("red", nonsense)])
        tick = one.step()
        assert tick.commands["red"].finite
    assert speed(one) > 0.2


def test_orders_of_many_robots_stand_when_the_operator_is_gone() -> None:
    one = under_way(2)
    one.operator = ""
    one.run(1.8)
    for name in ("red", "blue"):
        assert view(one, name).command.at_rest
        assert view(one, name).task == "none"
        assert speed(one, name) < 0.02
    one.operator = "me"
    one.run(0.5)
    assert view(one).command.at_rest


def test_what_is_being_planned_when_the_operator_goes_is_not_driven() -> None:
    """Neither after STOP and release, nor when somebody comes back, does a plan that comes late move anything."""
    for end in ("stop", "silent"):
        one = session(job_s=1.5)
        one.run(0.3)
        one.order(DriveTo("red", (AHEAD,)))
        one.step()
        if end == "stop":
            one.order(Stop())
            one.step()
            one.order(Release())
        else:
            one.operator = ""
            one.run(1.2)
            one.operator = "me"
        one.run(1.8)
        assert view(one).task == "none"
        assert speed(one) < 0.01


def test_a_full_disk_ends_the_recording_and_not_the_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = under_way()
    room, notes, real = 20_000, list[str](), os.write

    def write(fd: int, data: memoryview) -> int:
        nonlocal room
        if room == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = real(fd, data[:room])
        room -= taken
        return taken

    monkeypatch.setattr("airground.records.session_log_file.os.write", write)
    path = tmp_path / "s.mcap"
    recorder = Recorder(path, one.session.options, None, images="none", note=notes.append)
    for _ in range(60):
        tick = one.step()
        for _ in range(40):  # as much as a longer session
            recorder.step(one.inputs, tick)
        if recorder.trouble:
            break
    recorder.close()
    monkeypatch.undo()
    assert "the disk is full" in recorder.trouble
    assert notes == [recorder.trouble]
    before = speed(one)
    one.run(0.5)
    assert min(before, speed(one)) > 0.2  # it drives on
