"""Each fault of the embedded world does what it says, and its end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.control import STOP
from airground.errors import InputError
from airground.sim.live_faults import Faults
from airground.sim.live_options import FAMILY, EmbeddedOptions
from airground.vision.detectors.registry import make_detector
from live_runs import CURVE, Run, run


def labels(drive: Run) -> list[tuple[str, ...]]:
    return [seen.labels for seen in drive.seen]


def test_a_frozen_camera_sends_the_same_picture_with_new_times() -> None:
    drive = run(EmbeddedOptions(), red=CURVE).go(1)
    world = drive.world
    drive.look = False
    world.faults.camera(frozen=True)
    drive.go(0.5)
    frames = world.frames(world.now)
    # The first is none that came before: nobody had drawn one.
    assert all(np.array_equal(frame.image, frames[-1].image) for frame in frames[1:])
    assert_allclose(np.diff([frame.t for frame in frames]), 0.05)
    assert np.diff([frame.index for frame in frames]).tolist() == [1] * (len(frames) - 1)
    assert world.truth("red", world.now).v > 0.28  # and it drives on
    world.faults.camera(frozen=False)
    drive.go(0.3)
    assert not np.array_equal(world.frames(world.now)[-1].image, frames[-1].image)


def test_frozen_sightings_do_not_change_either() -> None:
    drive = run(red=CURVE).go(1)
    drive.world.faults.camera(frozen=True)
    drive.go(0.2).fresh().go(1)
    for seen in drive.seen:
        assert_array_equal(seen.uv, drive.seen[0].uv)
    assert_allclose(np.diff([seen.t for seen in drive.seen]), 0.05)


def test_a_camera_that_is_gone_loses_what_was_on_its_way_and_begins_a_segment() -> None:
    drive = run().go(1)
    world = drive.world
    drive.look = False
    last = world.pictures(world.now)
    assert last == []
    world.faults.camera(gone=True)
    drive.go(2)
    assert world.pictures(world.now) == []
    world.faults.camera(gone=False)
    back_s = world.now
    drive.go(0.5)
    pictures = world.pictures(world.now)
    assert {picture.segment for picture in pictures} == {1}
    assert back_s <= pictures[0].exposed_s + 1e-9
    assert np.diff([picture.index for picture in pictures]).tolist() == [1] * (len(pictures) - 1)
    assert pictures[0].index < 25  # it does not count what it did not take


def test_late_pictures_can_be_told_by_their_stamps() -> None:
    drive = run(red=CURVE).go(1)
    world = drive.world
    world.faults.camera(late_s=1.0)
    since = world.now
    drive.fresh().go(3)
    held = [(s.t, a) for s, a in zip(drive.seen, drive.arrived, strict=True) if s.t > since + 0.1]
    assert_allclose([arrived - t for t, arrived in held], 1.0, atol=0.021)
    silent = np.diff(drive.arrived).max()
    assert 0.9 < silent < 1.1
    for seen in drive.seen:  # stamped as usual: exposure and the usual latency
        assert_allclose(seen.uv[0], world.truth("red", seen.t - 0.06).uv, atol=1e-6)
    drive.look = False
    drive.go(0.1)
    late = [one.late_s for one in world.pictures(world.now)]
    assert late == pytest.approx([1.0] * len(late))
    # When it is over, what was held up comes at once.
    world.faults.camera(late_s=0.0)
    drive.go(0.1)
    pictures = world.pictures(world.now)
    assert len(pictures) > 15
    drive.go(0.1)
    for picture in world.pictures(world.now):
        assert picture.arrives_s == pytest.approx(picture.t, abs=1e-6)


def test_late_pictures_may_be_stamped_when_they_come() -> None:
    drive = run(red=CURVE).go(1)
    world = drive.world
    world.faults.camera(late_s=0.5, stamped_late=True)
    drive.go(1).fresh().go(1)
    for seen, arrived in zip(drive.seen, drive.arrived, strict=True):
        assert arrived - 0.021 < seen.t <= arrived + 1e-9
        assert_allclose(seen.uv[0], world.truth("red", seen.t - 0.56).uv, atol=1e-3)
    drive.look = False
    drive.go(0.1)
    assert {picture.late_s for picture in world.pictures(world.now)} == {None}


def test_a_robot_without_a_link_is_silent_deaf_and_stops_by_itself() -> None:
    drive = run(red=CURVE, blue=CURVE).go(2)
    world = drive.world
    world.faults.robot("red", link_gone=True)
    drive.go(1).fresh().go(0.5)
    assert drive.told["red"] == []
    assert len(drive.told["blue"]) >= 24
    assert abs(world.truth("red", world.now).v) < 0.02
    assert world.truth("blue", world.now).v > 0.28
    world.faults.robot("red", link_gone=False)
    drive.go(1)
    assert world.truth("red", world.now).v > 0.28
    assert drive.told["red"][0].t > 3.4  # what was told meanwhile is lost


def test_a_covered_tag_is_not_seen() -> None:
    drive = run(red=CURVE).go(0.5)
    drive.world.faults.robot("red", covered=True)
    drive.go(0.2).fresh().go(0.5)
    assert set(labels(drive)) == {("1", "9")}
    drive.world.faults.robot("red", covered=False)
    drive.go(0.2).fresh().go(0.2)
    assert set(labels(drive)) == {("0", "1", "9")}


def test_covers_swaps_and_false_sightings_show_in_pictures_too() -> None:
    drive = run(EmbeddedOptions(), red=CURVE)
    drive.look = False
    world = drive.go(0.5).world

    def found() -> dict[str, Any]:
        world.pictures(world.now)
        drive.go(0.16)
        frame = world.frames(world.now)[-1]
        seen = make_detector(f"tag:family={FAMILY}").detect(frame)  # that remembers nothing
        return {"t": frame.t - 0.06, **dict(zip(seen.labels, seen.uv, strict=True))}

    world.faults.robot("red", covered=True)
    assert sorted(set(found()) - {"t"}) == ["1", "9"]
    world.faults.robot("red", covered=False)
    world.faults.swap("red", "blue")
    seen = found()
    assert np.hypot(*(seen["0"] - world.truth("blue", seen["t"]).uv)) < 0.3
    assert np.hypot(*(seen["1"] - world.truth("red", seen["t"]).uv)) < 0.3
    world.faults.clear()
    world.faults.robot("red", seen_off_m=(0.0, 1.2))
    seen = found()
    there = world.camera.project(world.truth("red", seen["t"]).xy + [0.0, 1.2])
    assert np.hypot(*(seen["0"] - there)) < 0.3


def test_a_false_sighting_is_where_it_is_said_to_be_and_the_robot_is_not() -> None:
    drive = run(red=CURVE).go(1)
    world = drive.world
    before = world.truth("red", world.now).xy
    world.faults.robot("red", seen_off_m=(0.5, -0.3))
    drive.go(0.2).fresh().go(0.3)
    seen = drive.seen[-1]
    truth = world.truth("red", seen.t - 0.06)
    assert_allclose(seen.uv[0], world.camera.project(truth.xy + [0.5, -0.3]), atol=1e-6)
    assert np.hypot(*(truth.xy - before)) < 0.2


def test_swapped_robots_are_seen_in_each_others_place() -> None:
    drive = run(red=CURVE).go(0.5)
    world = drive.world
    world.faults.swap("blue", "red")
    drive.go(0.2).fresh().go(0.3)
    seen = drive.seen[-1]
    assert_allclose(seen.uv[0], world.truth("blue", seen.t - 0.06).uv, atol=1e-6)
    assert_allclose(seen.uv[1], world.truth("red", seen.t - 0.06).uv, atol=1e-6)


def test_a_blocked_robot_stands_while_its_wheels_turn() -> None:
    drive = run(red=CURVE).go(1)
    world = drive.world
    world.faults.robot("red", blocked=True)
    at = world.truth("red", world.now).xy
    drive.go(1)
    assert np.hypot(*(world.truth("red", world.now).xy - at)) < 1e-9
    assert drive.told["red"][-1].speed == pytest.approx(0.3, abs=0.01)


def test_a_robot_without_motors_stands_and_says_so() -> None:
    drive = run(red=CURVE).go(1)
    world = drive.world
    world.faults.robot("red", motor_off=True)
    drive.go(1)
    at = world.truth("red", world.now)
    assert (at.v, at.omega) == (0.0, 0.0)
    assert drive.told["red"][-1].speed == 0.0
    assert drive.told["red"][-1].t > world.now - 0.021
    world.faults.clear()
    drive.go(0.5)
    assert world.truth("red", world.now).v > 0.28


def test_a_runaway_goes_on_whatever_it_is_told() -> None:
    drive = run(red=CURVE).go(2)
    world = drive.world
    world.faults.robot("red", runaway=True)
    drive.commands = {"red": STOP}
    drive.go(2)
    at = world.truth("red", world.now)
    assert at.v == pytest.approx(0.3, abs=0.02)
    assert at.omega == pytest.approx(0.35, abs=0.02)
    assert drive.told["red"][-1].speed == pytest.approx(0.3, abs=0.02)
    world.faults.robot("red", runaway=False)
    drive.go(1)
    assert abs(world.truth("red", world.now).v) < 0.01


def test_a_push_moves_a_robot_and_its_wheels_do_not_feel_it() -> None:
    drive = run().go(1)
    world = drive.world
    before = world.truth("red", world.now)
    world.faults.push("red", ahead_m=0.2, left_m=-0.1, turn_rad=0.0)
    drive.fresh().go(0.5)
    after = world.truth("red", world.now)
    ahead = np.array([np.cos(before.theta), np.sin(before.theta)])
    left = np.array([-ahead[1], ahead[0]])
    way = after.xy - before.xy
    assert way @ ahead == pytest.approx(0.2, rel=0.05)
    assert way @ left == pytest.approx(-0.1, rel=0.05)
    assert max(abs(reading.speed or 0.0) for reading in drive.told["red"]) < 1e-9
    assert after.v == 0.0
    world.faults.push("red", turn_rad=1.0)
    drive.go(0.5)
    assert world.truth("red", world.now).theta - after.theta == pytest.approx(1.0, rel=0.05)
    assert drive.told["red"][-1].heading == pytest.approx(world.truth("red", world.now).theta)


def test_a_stuck_compass_reads_the_same_while_the_turn_rate_is_right() -> None:
    drive = run(red=CURVE).go(1)
    world = drive.world
    last = drive.told["red"][-1].heading
    world.faults.robot("red", compass_stuck=True)
    drive.fresh().go(1)
    assert {reading.heading for reading in drive.told["red"]} == {last}
    assert drive.told["red"][-1].turn_rate == pytest.approx(0.35, abs=0.02)
    world.faults.robot("red", compass_stuck=False)
    drive.go(0.1)
    heading = drive.told["red"][-1].heading
    assert heading is not None
    assert last is not None
    assert heading - last > 0.3


def test_clear_ends_all_of_them() -> None:
    faults = Faults(["red", "blue"])
    well = faults.state
    faults.camera(frozen=True, late_s=1.0)
    faults.camera(gone=True)
    assert (faults.state.camera.frozen, faults.state.camera.gone) == (True, True)
    faults.robot("red", blocked=True)
    faults.swap("red", "blue")
    assert not faults.state.robots["blue"].blocked
    faults.clear()
    assert faults.state == well


@pytest.mark.parametrize(
    ("switch", "says"),
    [
        (lambda f: f.camera(broken=True), "there is no fault 'broken'; there are frozen, gone"),
        (lambda f: f.camera(late_s=-1.0), "late_s"),
        (lambda f: f.camera(late_s=60.0), "late_s must be 0 to 8"),
        (lambda f: f.camera(late_s=float("nan")), "late_s"),
        (lambda f: f.camera(gone="yes"), "gone must be true or false"),
        (lambda f: f.robot("pink", blocked=True), "no robot is called 'pink'"),
        (lambda f: f.robot("red", frozen=True), "there is no fault 'frozen'"),
        (lambda f: f.robot("red", seen_off_m=(1.0,)), "seen_off_m"),
        (lambda f: f.robot("red", seen_off_m=(1.0, float("inf"))), "seen_off_m"),
        (lambda f: f.swap("red", "red"), "two robots"),
        (lambda f: f.swap("red", "pink"), "no robot is called"),
        (lambda f: f.push("pink", 0.1), "no robot is called"),
        (lambda f: f.push("red", float("nan")), "finite"),
    ],
)
def test_wrong_switches_are_refused(switch: Any, says: str) -> None:
    faults = Faults(["red", "blue"])
    well = faults.state
    with pytest.raises(InputError, match=says):
        switch(faults)
    assert faults.state == well
    assert faults.take_pushes() == []
