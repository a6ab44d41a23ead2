"""Finding the heading from the image's motion alone, and being told when it is not known."""

from __future__ import annotations

from math import inf, pi

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import Floor, RobotState, VelocityCommand
from airground.control.estimation.options import StateOptions
from airground.control.estimation.start import Start, begun
from airground.control.estimation.state_filter import StateFilter
from airground.geometry import LimitedHomography
from airground.sim import SimCamera
from airground.sim.unicycle import arc
from late_drive import CAMERA, FLOOR, ORIGIN, TICK, LateDrive, steady

OPTIONS = StateOptions()


def turned(state: RobotState, theta: float) -> float:
    return float(abs(np.angle(np.exp(1j * (state.theta - theta)))))


@pytest.mark.parametrize("v", [0.1, -0.1])
@pytest.mark.parametrize("sources", [("odometry",), ()], ids=["odometry", "image"])
def test_the_heading_is_unknown_until_it_moves_gently_either_way(
    rng: np.random.Generator, sources: tuple[str, ...], v: float
) -> None:
    program = steady(v, 0.1)
    drive = LateDrive(rng, program=program, sources=sources, duration_s=3.5)
    first = None
    for now, state_filter, state in drive.driven(OPTIONS):
        if 0.2 < now < 0.6:
            assert not state_filter.ready
            assert state_filter.searching
            assert "drive gently forward" in state_filter.trouble
            assert np.isnan(state.theta)
            assert_allclose(state.uv, drive.mark(now), atol=5)  # where to look is known
            assert state.covariance is not None
            assert state.covariance[2, 2] > 1
        if state_filter.ready and first is None:
            first = now
            truth = drive.at(now + drive.actuation_s)
            assert turned(state, truth[2]) < 0.35
            assert np.hypot(*(drive.at(now)[:2] - drive.at(0.0)[:2])) < 0.15
    assert first is not None
    assert not state_filter.searching
    assert turned(state, drive.at(now + drive.actuation_s)[2]) < 0.12


def test_without_commands_and_odometer_the_front_is_where_it_drives_to(
    rng: np.random.Generator,
) -> None:
    for v, front in ((0.2, 0.0), (-0.2, pi)):
        drive = LateDrive(rng, program=steady(v), sources=(), duration_s=3.0)
        *_, (now, state_filter, state) = drive.driven(OPTIONS, told=False)
        assert state_filter.ready
        assert state.covariance is not None
        error = turned(state, drive.at(now + drive.actuation_s)[2] + front)
        assert error < min(0.5, 3 * np.sqrt(state.covariance[2, 2]))
        assert state.v == pytest.approx(
            abs(drive.at(now + drive.actuation_s)[3]), abs=3 * np.sqrt(state.covariance[3, 3])
        )


def test_a_mark_off_the_axle_shows_the_heading_in_a_turn_on_the_spot(
    rng: np.random.Generator,
) -> None:
    arm = (0.2, 0.0)
    drive = LateDrive(
        rng, program=steady(0.0, 0.8), sources=("odometry",), arm_m=arm, duration_s=3.0
    )
    *_, (now, state_filter, state) = drive.driven(StateOptions(lever_arm_m=arm))
    assert state_filter.ready
    assert turned(state, drive.at(now + drive.actuation_s)[2]) < 0.15


def test_a_compass_tells_the_heading_at_once(rng: np.random.Generator) -> None:
    drive = LateDrive(rng, sources=("compass",), duration_s=0.6)
    ready = [now for now, state_filter, _ in drive.driven(OPTIONS) if state_filter.ready]
    assert ready[0] < 0.2
    state_filter = StateFilter(FLOOR, OPTIONS)
    state_filter.read(0.0, heading=7 * pi + 0.2)
    state_filter.see(0.01, ORIGIN)
    state = state_filter.predict(0.02)
    assert turned(state, pi + 0.2) < 1e-9
    assert abs(state.theta) <= pi
    assert state.covariance is not None
    bias, noise = OPTIONS.heading_bias_sigma_rad, OPTIONS.heading_sigma_rad
    assert state.covariance[2, 2] == pytest.approx(bias**2 + noise**2, rel=0.05)


def test_noise_on_a_robot_that_stands_is_no_heading(rng: np.random.Generator) -> None:
    """Without commands, where any motion would be taken for driving."""
    state_filter = StateFilter(FLOOR, OPTIONS)
    for k in range(400):
        state_filter.see(k * TICK, ORIGIN + rng.normal(0, 1, 2))
        assert not state_filter.ready


def test_a_blocked_robot_does_not_show_a_heading(rng: np.random.Generator) -> None:
    state_filter = StateFilter(FLOOR, OPTIONS)
    for k in range(150):
        state_filter.sent(k * TICK, VelocityCommand(0.2, 0.0))
        state_filter.see(k * TICK, ORIGIN + rng.normal(0, 1, 2))
    assert state_filter.trouble
    corner = CAMERA.unproject(ORIGIN)
    for k in range(150, 350):  # and now it is free
        state_filter.sent(k * TICK, VelocityCommand(0.2, 0.0))
        way = (0.0, 0.2 * (k - 150) * TICK)
        state_filter.see(k * TICK, CAMERA.project(corner + way) + rng.normal(0, 1, 2))
    assert state_filter.ready
    assert turned(state_filter.predict(350 * TICK), pi / 2) < 0.1


def test_a_left_handed_ground_is_driven_on_alike(rng: np.random.Generator) -> None:
    camera = SimCamera(CAMERA.image_from_ground @ np.diag([1.0, -1.0, 1.0]), CAMERA.image_size_px)
    floor = Floor(LimitedHomography(camera.g), ORIGIN)
    assert floor.clockwise
    state_filter, xy, theta = StateFilter(floor, OPTIONS), camera.unproject(ORIGIN), 0.4
    state_filter.sent(-1.0, VelocityCommand(0.2, 0.5))
    for k in range(60):
        state_filter.see(k * TICK, camera.project(xy) + rng.normal(0, 1, 2))
        xy = xy + arc(theta, 0.2, 0.5, TICK)
        theta += 0.5 * TICK
    state = state_filter.predict(60 * TICK)
    assert turned(state, theta) < 0.1
    assert_allclose(state.uv, camera.project(xy), atol=3)


def test_the_first_belief_knows_what_hangs_together() -> None:
    """Heading and bias err against each other, and the axle is where the mark is less an arm that turns."""
    options = StateOptions(lever_arm_m=(0.3, -0.1))
    R = (4e-4, 1e-4, 2e-4)
    start = Start.anew(options).read(0.0, (0.7, 0.1, 0.2)).seen(0.0, (1.0, 2.0), R, options)
    belief = begun(start, options)
    assert belief is not None
    P, theta = belief.covariance, belief.mean[2]
    assert theta == pytest.approx(0.7)
    c, s = np.cos(theta), np.sin(theta)
    assert_allclose(belief.mean[:2], [1.0 - 0.3 * c - 0.1 * s, 2.0 - 0.3 * s + 0.1 * c])
    mark = np.zeros((2, 8))
    mark[:, :2], mark[:, 2] = np.eye(2), [-0.3 * s + 0.1 * c, 0.3 * c + 0.1 * s]
    assert_allclose(mark @ P @ mark.T, [[R[0], R[1]], [R[1], R[2]]], atol=1e-12)
    both = P[2, 2] + 2 * P[2, 7] + P[7, 7]  # what the compass read
    assert both == pytest.approx(options.heading_sigma_rad**2)
    assert np.linalg.eigvalsh(P)[0] > 0


@pytest.mark.parametrize(
    ("stretch", "sway", "known"),
    [(1.0, 0.0, True), (1.0, 0.05, False), (4.0, 0.0, False), (0.2, 0.0, False)],
)
def test_motion_that_is_not_what_the_robot_was_told_shows_no_heading(
    stretch: float, sway: float, known: bool
) -> None:
    """It is told 0.2 m/s; the mark goes at another speed, or to and fro: somebody carries it."""
    start = Start.anew(OPTIONS)
    for k in range(40):
        start = start.read(k * TICK, (inf, 0.2, 0.0))
        way = np.array([stretch * start.mean[0], sway * np.sin(k)])
        c, s = np.cos(0.8), np.sin(0.8)
        x, y = np.array([[c, -s], [s, c]]) @ way
        start = start.seen(k * TICK, (x, y), (2e-5, 0.0, 2e-5), OPTIONS)
        start = start.moved([(TICK, None)], OPTIONS)
    belief = begun(start, OPTIONS)
    assert (belief is not None) == known
    assert belief is None or belief.mean[2] == pytest.approx(0.8)
