"""The embedded world in simulated time: the same each time, late as it says, and never out of memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.control import VelocityCommand
from airground.errors import InputError
from airground.sim.live_options import FAMILY, MOST_ROBOTS, EmbeddedOptions
from airground.sim.live_world import EmbeddedWorld
from airground.vision.detectors.registry import make_detector
from live_runs import CURVE, SMOOTH, run

NOISY = EmbeddedOptions(robots=3, jitter_s=0.01)


def test_the_same_seed_gives_the_same_world() -> None:
    one, other, third = (run(NOISY, seed, red=CURVE, blue=CURVE).go(3) for seed in (1, 1, 2))
    assert one.told == other.told != third.told
    assert one.arrived == other.arrived != third.arrived
    for a, b in zip(one.seen, other.seen, strict=True):
        assert_array_equal(a.uv, b.uv)
        assert (a.t, a.labels) == (b.t, b.labels)
    assert not np.array_equal(one.seen[-1].uv, third.seen[-1].uv)
    assert_array_equal(one.world.truth("red", 2.5).xy, other.world.truth("red", 2.5).xy)


def test_sightings_show_the_truth_as_late_as_the_camera_is() -> None:
    drive = run(replace(SMOOTH, latency_s=0.08), red=CURVE, blue=CURVE).go(6)
    assert len(drive.seen) == 119
    world = drive.world
    for seen, arrived in zip(drive.seen, drive.arrived, strict=True):
        assert seen.labels == ("0", "1", "9")
        assert -1e-6 < arrived - seen.t < 0.021  # it is asked 50 times a second
        for name, uv, angle in zip(("red", "blue", "cart"), seen.uv, seen.angle, strict=True):
            truth = world.truth(name, seen.t - 0.08)
            assert_allclose(uv, truth.uv, atol=1e-6)
            ahead = world.camera.project(
                truth.xy + 0.01 * np.array([np.cos(truth.theta), np.sin(truth.theta)])
            )
            assert np.cos(angle - np.arctan2(*(ahead - truth.uv)[::-1])) > 0.998
    # As a detector gives them: corners of the black square, clockwise from the tag's upper left.
    truth = world.truth("red", drive.seen[-1].t - 0.08)
    along = np.array([np.cos(truth.theta), np.sin(truth.theta)])
    aside = np.array([-along[1], along[0]])
    upper_left = world.camera.project(truth.xy + 0.2 * along + 0.2 * aside)
    assert_allclose(drive.seen[-1].outline[0, 0], upper_left, atol=1e-6)


def test_the_noise_of_sightings_is_what_it_is_said_to_be() -> None:
    drive = run(replace(SMOOTH, sigma_px=0.5, camera_hz=100.0)).go(4)
    off = np.array([s.uv[0] - drive.world.truth("red", s.t - 0.06).uv for s in drive.seen])
    assert np.abs(off.mean(axis=0)).max() < 4 * 0.5 / np.sqrt(len(off))
    assert_allclose(off.std(axis=0), 0.5, rtol=0.2)
    assert_allclose(drive.seen[0].covariance, np.tile(0.25 * np.eye(2), (3, 1, 1)))


def test_readings_are_stamped_by_the_least_delay_of_their_link() -> None:
    drive = run(red=CURVE).go(4)
    late = SMOOTH.odometry.latency_s
    for reading in drive.told["red"]:
        truth = drive.world.truth("red", reading.t - late)
        assert reading.heading is not None
        assert np.cos(reading.heading - truth.theta) > 1 - 1e-9
        assert reading.speed == pytest.approx(truth.v, abs=0.01)
        assert reading.turn_rate == pytest.approx(truth.omega, abs=0.06)
    times = [reading.t for reading in drive.told["red"]]
    assert_allclose(np.diff(times), 0.02)
    assert drive.world.time_offset_s == pytest.approx(late - 0.06)
    blind = replace(SMOOTH, odometry=replace(SMOOTH.odometry, compass=False))
    assert run(blind).go(0.5).told["red"][0].heading is None


def test_frames_are_drawn_when_one_asks_and_show_what_was() -> None:
    drive = run(EmbeddedOptions(robots=4), red=CURVE, blue=CURVE)
    drive.look = False
    world = drive.go(1.0).world
    assert "scene" not in vars(world)  # nothing was painted
    frames = world.frames(world.now)[-2:]
    detector = make_detector(f"tag:family={FAMILY}")
    for frame in frames:
        assert (frame.size_px, frame.clock, frame.segment) == ((1280, 720), "world", 0)
        found = detector.detect(frame)
        assert sorted(found.labels) == ["0", "1", "2", "3", "9"]
        for label, uv in zip(found.labels, found.uv, strict=True):
            name = {"9": "cart"}.get(label) or world.robots[int(label)].name
            assert np.hypot(*(uv - world.truth(name, frame.t - 0.06).uv)) < 0.3
    assert_array_equal(frames[0].image, world.renderer.image(frames[0].t - 0.06, frames[0].index))
    assert world.frames(world.now) == []  # each once


def test_who_takes_sightings_leaves_no_frames() -> None:
    drive = run().go(1.0)
    assert len(drive.seen) > 15
    assert drive.world.frames(drive.world.now) == []


def test_a_robot_that_is_told_nothing_stops_by_itself() -> None:
    drive = run(red=CURVE).go(2)
    assert drive.world.truth("red", drive.world.now).v > 0.28
    drive.world.advance(drive.world.now + 2.0)
    then = [drive.world.truth("red", 1.96 + after).v for after in (0.45, 1.0, 2.0)]
    assert then[0] > 0.28
    assert abs(then[1]) < 0.02
    assert abs(then[2]) < 1e-4


def test_all_places_are_seen_and_apart() -> None:
    drive = run(replace(SMOOTH, robots=MOST_ROBOTS)).go(0.5)
    world = drive.world
    assert sorted(drive.seen[-1].labels) == ["0", "1", "2", "3", "4", "5", "9"]
    assert world.closest_m > 2 * world.radius_m
    assert [(one.name, one.tag) for one in world.robots[:4]] == [
        ("red", 0),
        ("blue", 1),
        ("green", 2),
        ("yellow", 3),
    ]


def test_vehicles_that_drive_into_each_other_are_told_of() -> None:
    # Their ways cross 1.77 m ahead of the one and 0.78 m ahead of the other.
    drive = run(red=VelocityCommand(0.6, 0.0), blue=VelocityCommand(0.264, 0.0))
    assert drive.go(0.5).world.closest_m > 1.5
    assert drive.go(3).world.closest_m < 0.2


def test_the_cart_goes_round_for_ever_in_view_and_clear_of_the_middle() -> None:
    drive = run(replace(SMOOTH, robots=1, camera_hz=4.0))
    world = drive.world
    seen = []
    for t in range(31):  # a round takes 28 s
        world.advance(float(t))
        seen += world.sightings(float(t))
    assert len(seen) == 120
    assert all("9" in one.labels for one in seen)
    truths = [world.truth("cart", float(t)) for t in np.arange(1e5, 1e5 + 30, 0.1) if t <= 1e5 + 30]
    assert_allclose([one.v for one in truths], 0.5, atol=1e-4)
    xy = np.array([one.xy for one in truths])
    assert np.abs(np.diff(xy, axis=0)).max() < 0.051
    assert xy[:, 1].min() > 6.0
    assert world.camera.visible(xy, 20.0).all()


def test_time_only_goes_forwards_and_must_have_come() -> None:
    world = EmbeddedWorld(SMOOTH, start_s=5.0)
    assert world.now == 5.0
    world.advance(5.5)
    for wrong in (5.4, float("nan"), float("inf")):
        with pytest.raises(InputError, match="cannot go to"):
            world.advance(wrong)
        with pytest.raises(InputError, match="cannot go to"):
            world.skip(wrong)
    for ask in (world.frames, world.sightings, world.pictures):
        with pytest.raises(InputError, match="advance it first"):
            ask(5.6)
    with pytest.raises(InputError, match="advance it first"):
        world.readings("red", 5.6)
    with pytest.raises(InputError, match="advance it first"):
        world.truth("red", 5.6)
    assert world.sightings(5.5)[0].t == pytest.approx(5.06)


def test_unknown_robots_and_wrong_commands_are_refused() -> None:
    world = EmbeddedWorld(SMOOTH)
    for ask in (world.readings, world.truth):
        with pytest.raises(InputError, match="no robot is called 'pink'; there are red, blue"):
            ask("pink", 0.0)
    with pytest.raises(InputError, match="no robot is called"):
        world.command("pink", 0.0, CURVE)
    with pytest.raises(InputError, match="must be finite"):
        world.command("red", 0.0, VelocityCommand(float("nan"), 0.0))
    with pytest.raises(InputError, match="sideways"):
        world.command("red", 0.0, VelocityCommand(0.0, 0.0, 0.1))
    with pytest.raises(InputError, match="cart"):
        EmbeddedWorld(replace(SMOOTH, cart=False)).truth("cart", 0.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"robots": 0},
        {"robots": 7},
        {"camera_hz": 0.0},
        {"latency_s": 0.0},
        {"latency_s": 3.0},
        {"jitter_s": -1.0},
        {"sigma_px": float("nan")},
    ],
)
def test_options_out_of_range_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        EmbeddedOptions(**wrong)  # type: ignore[arg-type]


def test_a_world_without_a_cart_and_one_that_drives_sideways() -> None:
    options = replace(SMOOTH, cart=False, kind="omni", robots=1)
    drive = run(options, red=VelocityCommand(0.0, 0.0, 0.3)).go(2)
    assert drive.seen[-1].labels == ("0",)
    way = drive.world.truth("red", 1.9).xy - drive.world.truth("red", 0.0).xy
    assert way @ [-np.sin(np.pi / 4), np.cos(np.pi / 4)] > 0.4


def test_skipping_an_hour_leaves_all_at_rest_and_nothing_on_its_way() -> None:
    drive = run(red=CURVE).go(1)
    world = drive.world
    world.skip(3600.0)
    assert world.readings("red", 3600.0) == []
    assert world.sightings(3600.0) == []
    at = world.truth("red", 3600.0)
    assert (at.v, at.omega) == (0.0, 0.0)
    assert np.hypot(*(at.xy - world.truth("red", 3000.0).xy)) == 0.0
    with pytest.raises(InputError, match="forgotten"):
        world.truth("red", 0.5)
    world.advance(3600.5)
    assert 20 <= len(world.readings("red", 3600.5)) <= 26
    assert 8 <= len(world.sightings(3600.5)) <= 10
    world.command("red", 3600.5, CURVE)
    world.advance(3601.0)
    assert world.truth("red", 3601.0).v > 0.2


def test_what_nobody_asks_for_is_forgotten() -> None:
    world = EmbeddedWorld(replace(SMOOTH, robots=1))
    for k in range(60):
        world.advance(k * 1.0)
    assert len(world.shutter.coming()) <= 20 * 12
    assert len(world.readings("red", world.now)) == 500
    assert len(world._fleet.vehicles["red"]._history._times) < 2 * 12 * 250 + 300
    assert len(world.sightings(world.now)) > 100  # and those that are left can be looked at
