"""Trajectories followed by flatness, driven by arcs under a pinhole camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import Floor, Limits, RobotState
from airground.control.trajectories.flat_tracker import FlatTracker
from airground.control.trajectories.flatness import flat_inputs
from airground.control.trajectories.spline import SplineTrajectory, times_at_speed
from airground.control.trajectories.trajectory import (
    FunctionTrajectory,
    GroundEllipse,
    GroundTrajectory,
)
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import demo_world
from unicycle_loop import Array, drive, within

if TYPE_CHECKING:
    from airground.control import ImageTrajectory

CAMERA = demo_world().camera
MIDDLE = np.array([0.0, 4.1])
CENTRE = CAMERA.project(MIDDLE)
FLOOR = Floor(LimitedHomography(CAMERA.g), CENTRE)
ELLIPSE = GroundEllipse(FLOOR, CENTRE, (1.5, 0.9), 25.0)


def astroid(t: float) -> tuple[Array, Array, Array]:
    """Four cusps, in 24 s."""
    w = 2 * np.pi / 24
    c, s = np.cos(w * t), np.sin(w * t)
    return (
        1.2 * np.array([c**3, s**3]),
        3.6 * w * np.array([-c * c * s, s * s * c]),
        3.6 * w * w * np.array([2 * c * s * s - c**3, 2 * s * c * c - s**3]),
    )


def off_the_path(trajectory: ImageTrajectory, xy: Array, span: float) -> Array:
    """Distance to the nearest of many points of it, on the ground."""
    path = CAMERA.unproject([trajectory.at(t)[0] for t in np.linspace(0, span, 5000)])
    return np.asarray(np.hypot(*(xy[:, None] - path).transpose(2, 0, 1)).min(axis=1))


@pytest.mark.parametrize(
    "limits",
    [Limits(), Limits(turn_radius_m=0.3), Limits(speed_mps=0.25)],
    ids=["free", "car", "slow"],
)
def test_it_comes_to_the_trajectory_and_stays(limits: Limits, rng: np.random.Generator) -> None:
    tracker = FlatTracker(FLOOR, ELLIPSE, limits, response_s=0.0)
    start, theta = rng.uniform([-2, 2.6], [2, 5.6]), rng.uniform(-np.pi, np.pi)
    run = drive(tracker, CAMERA, start, theta, seconds=28)
    within(limits, run)
    settled = run.t > 23
    assert run.error_m[settled].max() < 0.003
    assert off_the_path(ELLIPSE, run.xy[settled], 25).max() < 0.003


def test_from_rest_heading_away() -> None:
    tracker = FlatTracker(FLOOR, ELLIPSE, response_s=0.0)
    uv, uv_dot, uv_ddot = ELLIPSE.at(0.0)
    theta = float(flat_inputs(FLOOR.model, uv, uv_dot, uv_ddot).theta)
    run = drive(tracker, CAMERA, MIDDLE + [1.5, 0.0], theta + np.pi, seconds=10)
    within(Limits(), run)
    assert run.error_m.max() < 0.08
    assert run.command[:, 0].min() >= -1e-9
    assert run.error_m[run.t > 8].max() < 0.005


def test_it_feeds_forward_what_flatness_says(rng: np.random.Generator) -> None:
    """On the trajectory and at its speed, a short step's command is that of the flat outputs."""
    tracker = FlatTracker(FLOOR, ELLIPSE, response_s=0.0)
    for t in rng.uniform(0, 25, 10):
        inputs = flat_inputs(FLOOR.model, *ELLIPSE.at(t))
        theta, v, omega = float(inputs.theta), float(inputs.v), float(inputs.omega)
        state = RobotState(0.0, ELLIPSE.at(t)[0], theta, v, omega)
        answer = tracker.step(state, t, 1e-3)
        assert_allclose(answer.command.v, v, atol=1e-3)
        # STILL_MPS takes a little of the turn: 0.5 % at 0.25 m/s.
        assert_allclose(answer.command.omega, omega, rtol=0.01, atol=1e-3)
        assert_allclose(answer.progress - t, 1e-3, rtol=1e-6)
        assert answer.error_m < 1e-9


def test_the_error_decays_as_the_gains_say() -> None:
    """The paper's law: K_p = 1.5 * 4 and K_d = 1.5 + 4 along a line; the image error is the sum of two exponentials."""
    wide = Limits(1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3)
    way = np.array([120.0, 40.0])
    line = FunctionTrajectory(
        lambda t: (np.array([300.0, 420.0]) + way * t, way, np.zeros(2)), period=4.0
    )
    dt = 0.002
    inputs = flat_inputs(FLOOR.model, *line.at(0.0))
    aside = np.array([-way[1], way[0]]) / np.hypot(*way)
    start = line.at(0.0)[0] + 1.0 * aside  # 1 px
    tracker = FlatTracker(FLOOR, line, wide, patience_m=1e3, response_s=0.0)

    xy, theta = CAMERA.unproject(start), float(inputs.theta)
    v, omega, t = float(inputs.v), 0.0, 0.0
    # The heading that keeps the error's rate at zero in the image.
    J = FLOOR.model.jacobian(start)
    w = np.linalg.solve(J, way)
    theta, v = float(np.arctan2(w[1], w[0])), float(np.hypot(*w))
    errors = []
    for _ in range(1000):
        uv = CAMERA.project(xy)
        answer = tracker.step(RobotState(0.0, uv, theta, v, omega), t, dt)
        errors.append(float((uv - line.at(t)[0]) @ aside))
        t, v, omega = answer.progress, answer.command.v, answer.command.omega
        xy = (
            xy + np.array([np.cos(theta + omega * dt / 2), np.sin(theta + omega * dt / 2)]) * v * dt
        )
        theta += omega * dt
    times = dt * np.arange(1000)
    wanted = (4.0 * np.exp(-1.5 * times) - 1.5 * np.exp(-4.0 * times)) / 2.5
    assert_allclose(errors, wanted, atol=0.03)


@pytest.mark.parametrize(("reverse", "cut"), [(0.2, 0.01), (0.0, 0.05)])
def test_cusps_are_driven_in_reverse_or_turned_round_at(reverse: float, cut: float) -> None:
    limits = Limits(reverse_mps=reverse)
    tracker = FlatTracker(FLOOR, GroundTrajectory(FLOOR, astroid, 24.0), limits, response_s=0.0)
    run = drive(tracker, CAMERA, MIDDLE + [1.2, 0.0], np.pi)
    within(limits, run)
    assert run.guidance.done
    assert run.guidance.progress == 25.0
    assert np.hypot(*(run.xy[-1] - MIDDLE - [1.2, 0.0])) < 0.01
    assert run.error_m.max() < cut
    assert (run.command[:, 0].min() < -0.1) == (reverse > 0)
    assert run.turned() < (2 * np.pi + 0.7 if reverse else 6 * np.pi)


def test_a_spline_is_driven_from_rest_to_rest() -> None:
    points = np.array([[300.0, 500.0], [500.0, 330.0], [800.0, 330.0], [900.0, 500.0]])
    spline = SplineTrajectory(points, times_at_speed(FLOOR, points, 0.25))
    run = drive(
        FlatTracker(FLOOR, spline, response_s=0.0), CAMERA, CAMERA.unproject(points[0]), 0.6
    )
    within(Limits(), run)
    assert run.guidance.done
    assert run.error_m.max() < 0.02
    assert np.hypot(*(CAMERA.project(run.xy[-1]) - points[-1])) <= 2.0


def test_a_trajectory_that_is_too_fast_is_driven_more_slowly() -> None:
    hasty = GroundEllipse(FLOOR, CENTRE, (1.5, 0.9), 6.0)
    run = drive(
        FlatTracker(FLOOR, hasty, response_s=0.0),
        CAMERA,
        MIDDLE + [1.5, 0.0],
        np.pi / 2,
        seconds=17,
    )
    within(Limits(), run)
    assert run.progress[-1] < 0.5 * run.t[-1]
    assert off_the_path(hasty, run.xy, 6).max() < 0.01


def test_where_there_is_no_answer_it_rests_and_says_why() -> None:
    tracker = FlatTracker(FLOOR, ELLIPSE, response_s=0.0)
    above = np.array([640.0, -2000.0])
    for uv, theta, message in ((above, 0.0, "horizon"), (CENTRE, np.nan, "not known")):
        answer = tracker.step(RobotState(0.0, uv, theta), 3.0, 0.05)
        assert answer.command.at_rest
        assert message in answer.trouble
        assert answer.progress == 3.0

    def away(t: float) -> tuple[Array, Array, Array]:  # beyond what is looked at beforehand
        return CENTRE - np.array([0.0, 3.0 * t]), np.array([0.0, -3.0]), np.zeros(2)

    answer = FlatTracker(FLOOR, FunctionTrajectory(away), response_s=0.0).step(
        RobotState(0.0, CENTRE, 0.0), 400.0, 0.05
    )
    assert "left the visible ground" in answer.trouble


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match="turn_radius_m"):
        FlatTracker(
            FLOOR, GroundTrajectory(FLOOR, astroid, 24.0), Limits(turn_radius_m=0.3), response_s=0.0
        )
    with pytest.raises(InputError, match="horizon"):
        FlatTracker(
            FLOOR,
            FunctionTrajectory(lambda t: (CENTRE - [0, 99 * t], [0, -99], [0, 0])),
            response_s=0.0,
        )
    with pytest.raises(InputError, match="never moves"):
        FlatTracker(
            FLOOR, FunctionTrajectory(lambda _: (CENTRE, [0, 0], [0, 0]), 3.0), response_s=0.0
        )
    with pytest.raises(InputError, match="heading_gain"):
        FlatTracker(FLOOR, ELLIPSE, heading_gain=1.0, response_s=0.0)
    for name in ("position_gain", "patience_m"):
        with pytest.raises(InputError, match=name):
            FlatTracker(FLOOR, ELLIPSE, **{name: 0.0})  # type: ignore[arg-type]
    state = RobotState(0.0, CENTRE, 0.0)
    for progress, dt, message in ((-1.0, 0.1, "progress"), (0.0, np.nan, "dt")):
        with pytest.raises(InputError, match=message):
            FlatTracker(FLOOR, ELLIPSE, response_s=0.0).step(state, progress, dt)
