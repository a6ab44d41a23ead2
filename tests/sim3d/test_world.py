from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.control.command import VelocityCommand
from airground.errors import InputError
from airground.sim3d.options import World3dOptions
from airground.sim3d.world import World3d
from worlds3d import alone, drive, mean, small_camera

pytestmark = pytest.mark.usefixtures("physics")


def test_it_drives_straight_as_told_less_lag_and_slip() -> None:
    world = World3d(alone())
    start = world.truth("red", 0.0)
    drive(world, 0.15, 0.0, 3.0)
    end = world.truth("red", 3.0)
    assert end.v == pytest.approx(0.15, rel=0.02)
    assert end.v < 0.15
    lag = 0.04 + 0.12
    assert end.xy - start.xy == pytest.approx([0.15 * (3.0 - lag), 0.0], abs=0.01)
    assert end.theta == pytest.approx(0.0, abs=0.01)


def test_wheels_that_are_not_what_its_software_takes_them_for_make_it_drive_a_bow() -> None:
    world = World3d(alone(wheel_share=0.05), seed=3)
    drive(world, 0.15, 0.0, 3.0)
    assert abs(world.truth("red", 3.0).theta) > 0.02


def test_it_turns_left_for_a_positive_rate_and_the_wheels_slip() -> None:
    bias = {}
    for friction in (0.08, 0.5):
        world = World3d(alone(caster_friction=friction))
        drive(world, 0.0, 0.6, 1.0)
        before = world.truth("red", 0.95)
        told = mean(drive(world, 0.0, 0.6, 2.0), "turn_rate")
        after = world.truth("red", 2.95)
        turned = after.theta - before.theta
        assert 0.7 < turned < 1.2
        assert np.hypot(*(after.xy - before.xy)) < 0.03
        bias[friction] = told * 2.0 / turned
    assert 1.002 < bias[0.08] < 1.02
    assert bias[0.5] > 1.1, "a caster that drags makes wheels slip, and encoders cannot know"


def test_encoders_tell_the_speed_but_for_slip_and_ticks() -> None:
    world = World3d(alone(ticks=200))
    drive(world, 0.15, 0.0, 1.0)
    before = world.truth("red", 0.95)
    heard = drive(world, 0.15, 0.0, 2.0)
    way = float(np.hypot(*(world.truth("red", 2.95).xy - before.xy)))
    assert 1.0 < mean(heard, "speed") * 2.0 / way < 1.02
    tick = np.pi * 2 * 0.05 / 200 / 2 / 0.05  # one tick of one wheel, as a speed
    steps = np.array([k.speed for k in heard]) / tick
    assert steps == pytest.approx(np.round(steps), abs=1e-6)


def test_wheels_roll_when_it_brakes() -> None:
    world = World3d(alone(ticks=100_000))
    drive(world, 0.2, 0.0, 1.0)
    late = world.options.robots[0].options.latency_s
    heard = drive(world, 0.0, 0.0, 0.4)
    for reading in heard[1:]:
        t = reading.t - late
        way = world.truth("red", t).xy - world.truth("red", t - 0.05).xy
        assert reading.speed == pytest.approx(float(np.hypot(*way)) / 0.05, abs=0.01)


def headings_off(world: World3d) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Heading read less heading, over a whole turn."""
    heard = drive(world, 0.0, 1.0, 8.0)
    late = world.options.robots[0].options.latency_s
    off = [k.heading - world.truth("red", k.t - late).theta for k in heard if k.heading is not None]
    return np.angle(np.exp(1j * np.array(off)))


def test_the_compass_is_off_by_a_bias_and_by_what_iron_does_once_per_turn() -> None:
    clean = headings_off(World3d(alone(compass_iron=0.0, compass_rad=0.0, compass_bias_rad=0.1)))
    assert clean == pytest.approx(np.full(len(clean), 0.1), abs=0.005)
    iron = headings_off(World3d(alone(compass_iron=0.05, compass_rad=0.0, compass_bias_rad=0.0)))
    assert np.ptp(iron) == pytest.approx(0.1, rel=0.1)
    assert abs(iron.mean()) < 0.02
    noisy = headings_off(World3d(alone(compass_iron=0.0, compass_rad=0.02)))
    assert noisy.std() == pytest.approx(0.02, rel=0.25)


def test_a_gyro_drifts_and_encoders_at_rest_do_not() -> None:
    gyro = World3d(alone(turn_rate="gyro", gyro_bias_radps=0.02, gyro_radps=0.0), seed=1)
    encoders = World3d(alone())
    off = [k.turn_rate for k in drive(gyro, 0.0, 0.0, 2.0)]
    assert abs(np.mean([k for k in off if k is not None])) > 0.002
    assert mean(drive(encoders, 0.0, 0.0, 2.0), "turn_rate") == 0.0
    turning = mean(drive(gyro, 0.0, 0.6, 2.0)[20:], "turn_rate")
    assert turning == pytest.approx(gyro.truth("red", gyro.now).omega, abs=0.06)


def test_without_commands_it_stops_and_a_new_one_starts_it_again() -> None:
    world = World3d(alone())
    world.command("red", 0.0, VelocityCommand(0.2, 0.0))
    world.advance(0.5)
    assert world.truth("red", 0.5).v > 0.18
    world.advance(1.5)
    assert abs(world.truth("red", 1.5).v) < 0.005
    drive(world, 0.2, 0.0, 0.6)
    assert world.truth("red", world.now).v > 0.15


def test_commands_come_late_and_motors_lag() -> None:
    world = World3d(alone())
    world.command("red", 0.0, VelocityCommand(0.2, 0.0))
    world.advance(0.3)
    assert abs(world.truth("red", 0.04).v) < 0.002
    assert 0.05 < world.truth("red", 0.16).v < 0.18


def test_wheels_have_a_top_speed_and_the_bow_stays() -> None:
    world = World3d(alone(most_speed_mps=0.3))
    drive(world, 1.0, 1.0, 2.0)
    truth = world.truth("red", world.now)
    assert truth.v < 0.3
    assert truth.omega / truth.v == pytest.approx(1.0, rel=0.1)


def test_readings_are_stamped_late_and_given_once() -> None:
    world = World3d(alone())
    world.advance(1.0)
    heard = world.readings("red", 1.0)
    assert [k.t for k in heard] == pytest.approx(np.arange(1, 20) * 0.05 + 0.05)
    assert world.readings("red", 1.0) == []
    assert world.time_offset_s == pytest.approx(-0.01)


def test_the_other_vehicle_goes_round_its_route() -> None:
    options = World3dOptions(camera=small_camera())
    cart = replace(options.others[0], route_m=((-0.6, 0.6), (0.6, 0.6), (0.6, 0.9), (-0.6, 0.9)))
    world = World3d(replace(options, others=(cart,)), seed=2)
    corners = np.array([*cart.route_m, cart.route_m[0]])
    far, near = [], np.full(4, np.inf)
    for t in np.arange(0.0, 30.0, 0.2):
        world.advance(t)
        xy = world.truth("cart", world.now).xy
        a, way = corners[:-1], np.diff(corners, axis=0)
        share = np.clip(((xy - a) * way).sum(axis=1) / (way**2).sum(axis=1), 0, 1)
        far.append(np.hypot(*(a + share[:, None] * way - xy).T).min())
        near = np.minimum(near, np.hypot(*(corners[:-1] - xy).T))
    assert max(far) < 0.05
    assert near.max() < 0.06, "it has been at every corner"


def test_what_is_not_ours_can_be_neither_told_nor_asked() -> None:
    world = World3d(World3dOptions(camera=small_camera()))
    with pytest.raises(InputError, match="somebody else's"):
        world.command("cart", 0.0, VelocityCommand(0.1, 0.0))
    with pytest.raises(InputError, match="somebody else's"):
        world.readings("cart", 0.0)
    with pytest.raises(InputError, match="there are red, cart"):
        world.truth("pink", 0.0)


def test_time_goes_forward_and_nothing_is_known_of_the_future() -> None:
    world = World3d(alone(), start_s=10.0)
    world.advance(11.0)
    assert world.now == pytest.approx(11.0)
    with pytest.raises(InputError, match="cannot go"):
        world.advance(10.5)
    with pytest.raises(InputError, match="too late"):
        world.command("red", 10.0, VelocityCommand(0.1, 0.0))
    with pytest.raises(InputError, match="no lateral"):
        world.command("red", 11.0, VelocityCommand(0.1, 0.0, 0.1))
    for ask in (world.frames, lambda t: world.readings("red", t)):
        with pytest.raises(InputError, match="advance it first"):
            ask(12.0)
    with pytest.raises(InputError, match="known from"):
        world.truth("red", 12.0)


@pytest.mark.usefixtures("drawing")
def test_the_same_seed_gives_the_same_readings_and_pictures() -> None:
    def watched(seed: int) -> tuple[list[object], list[bytes]]:
        options = World3dOptions(camera=small_camera(rate_hz=4.0))
        with World3d(options, seed) as world:
            heard = drive(world, 0.15, 0.3, 1.0)
            return list(heard), [frame.image.tobytes() for frame in world.frames(world.now)]

    first, again, other = watched(5), watched(5), watched(6)
    assert len(first[1]) == 4
    assert first == again
    assert first[0] != other[0]
    assert first[1] != other[1]


@pytest.mark.usefixtures("drawing")
def test_pictures_come_late_once_and_only_when_asked_for() -> None:
    with World3d(alone(small_camera(rate_hz=10.0))) as world:
        world.advance(1.0)
        world.drop_frames()
        world.advance(1.2)
        assert world.frames(1.1) == []
        frames = world.frames(1.2)
        assert [frame.t for frame in frames] == pytest.approx([1.16])
        assert [frame.index for frame in frames] == [11]
        assert frames[0].size_px == (640, 360)
        assert world.frames(1.2) == []
