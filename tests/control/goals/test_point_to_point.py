"""Clicked goals, driven by arcs under a pinhole camera."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import Floor, Limits, RobotState
from airground.control.goals.point_to_point import PointToPoint
from airground.control.goals.point_to_point_omni import PointOmni
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import SimCamera, demo_world
from unicycle_loop import Array, Run, drive, within

CAMERA = demo_world().camera
ORIGIN = CAMERA.project([0.0, 4.1])
LOW, HIGH = [-2.0, 2.6], [2.0, 5.6]


def floor(camera: SimCamera = CAMERA) -> Floor:
    return Floor(LimitedHomography(camera.g), camera.project([0.0, 4.1]))


FLOOR = floor()


def arrived(run: Run, goal: Array, tolerance_m: float = 0.01, tolerance_px: float = 2.0) -> None:
    assert run.guidance.done, f"still {run.error_m[-1]} m off after {run.t[-1]} s"
    assert np.hypot(*(run.xy[-1] - goal)) <= tolerance_m
    assert np.hypot(*(CAMERA.project(run.xy[-1]) - CAMERA.project(goal))) <= tolerance_px


@pytest.mark.parametrize(
    "limits",
    [
        Limits(),
        Limits(reverse_mps=0.0),
        Limits(turn_radius_m=0.4),
        Limits(turn_radius_m=0.4, reverse_mps=0.0),
        Limits(turn_rate_radps=0.5, turn_acceleration_radps2=1.0, speed_mps=1.0),
    ],
    ids=["free", "forward", "car", "forward car", "slow turner"],
)
def test_it_arrives_from_anywhere(limits: Limits, rng: np.random.Generator) -> None:
    for k in range(5):
        goal = rng.uniform(LOW, HIGH)
        start = rng.uniform(LOW, HIGH) if k % 3 else goal + rng.normal(0, 0.1, 2)
        run = drive(
            PointToPoint(FLOOR, CAMERA.project(goal)[None], limits, response_s=0.0),
            CAMERA,
            start,
            rng.uniform(-np.pi, np.pi),
        )
        arrived(run, goal)
        within(limits, run)
        # No circling: half a turn to face it, or round and back for a car.
        assert run.turned() < (np.pi + 0.5 if limits.turn_radius_m == 0 else 2 * np.pi + 0.5)
        straight = float(np.hypot(*(start - goal)))
        assert run.t[-1] < 10 + 2 * straight / limits.speed_mps


@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_it_arrives_with_the_heading(radius: float, rng: np.random.Generator) -> None:
    limits = Limits(turn_radius_m=radius)
    for _ in range(3):
        goal, heading = rng.uniform(LOW, HIGH), rng.uniform(-np.pi, np.pi)
        controller = PointToPoint(
            FLOOR, CAMERA.project(goal)[None], limits, heading, response_s=0.0
        )
        run = drive(controller, CAMERA, rng.uniform(LOW, HIGH), rng.uniform(-np.pi, np.pi))
        arrived(run, goal)
        within(limits, run)
        assert abs(np.angle(np.exp(1j * (run.theta[-1] - heading)))) <= 0.03


@pytest.mark.parametrize("reverse", [0.0, 0.2])
@pytest.mark.parametrize("ahead", [-0.1, 0.0, 0.2])
def test_a_goal_inside_the_turning_circle_is_not_circled(reverse: float, ahead: float) -> None:
    limits = Limits(turn_radius_m=0.5, reverse_mps=reverse)
    start, theta = np.array([0.2, 4.0]), 0.3
    c, s = np.cos(theta), np.sin(theta)
    goal = start + np.array([[c, -s], [s, c]]) @ [ahead, 0.35]
    run = drive(
        PointToPoint(FLOOR, CAMERA.project(goal)[None], limits, response_s=0.0),
        CAMERA,
        start,
        theta,
    )
    arrived(run, goal)
    assert run.turned() < 2 * np.pi
    assert (run.command[:, 0].min() < 0) == (reverse > 0)


def test_it_passes_goals_without_stopping() -> None:
    goals = np.array([[-1.5, 3.2], [0.0, 3.4], [1.2, 4.2], [0.4, 5.2], [-1.2, 4.8]])
    limits = Limits()
    controller = PointToPoint(FLOOR, CAMERA.project(goals), limits, passing_m=0.12, response_s=0.0)
    run = drive(controller, CAMERA, [-2.0, 2.8], 0.5)
    arrived(run, goals[-1])
    within(limits, run)
    for goal in goals:
        assert np.hypot(*(run.xy - goal).T).min() < 0.12
    assert (np.diff(run.progress) >= 0).all()
    between = (run.t > 1.5) & (run.progress < 4)
    assert run.command[between, 0].min() > 0.1
    slowed = PointToPoint(
        FLOOR, CAMERA.project(goals), Limits(lateral_acceleration_mps2=0.05), response_s=0.0
    )
    careful = drive(slowed, CAMERA, [-2.0, 2.8], 0.5)
    within(Limits(lateral_acceleration_mps2=0.05), careful)
    assert careful.t[-1] > run.t[-1]


def test_goals_one_after_another_at_one_place_are_passed() -> None:
    goal = np.array([0.5, 4.0])
    run = drive(
        PointToPoint(FLOOR, CAMERA.project([goal, goal, goal]), response_s=0.0),
        CAMERA,
        goal - [1.0, 0.0],
        2.0,
    )
    arrived(run, goal)


def test_image_and_ground_agree(rng: np.random.Generator) -> None:
    """The same ground under a camera that looks straight down, as a map does, gives the same commands."""
    above = SimCamera(np.array([[100.0, 0.0, 600.0], [0.0, -100.0, 800.0], [0, 0, 1]]), (1280, 720))
    for limits in (Limits(), Limits(turn_radius_m=0.4)):
        goals = rng.uniform(LOW, HIGH, (3, 2))
        loose = {"tolerance_px": 1e3, "limits": limits}
        seen = PointToPoint(FLOOR, CAMERA.project(goals), **loose)  # type: ignore[arg-type]
        mapped = PointToPoint(floor(above), above.project(goals), **loose)  # type: ignore[arg-type]
        for _ in range(50):
            xy, theta, v, omega = rng.uniform(LOW, HIGH), rng.uniform(-3, 3), 0.3, rng.normal()
            progress = float(rng.integers(0, 3))
            a, b = (
                c.step(RobotState(0.0, cam.project(xy), theta, v, omega), progress, 0.05)
                for c, cam in ((seen, CAMERA), (mapped, above))
            )
            assert_allclose(
                [a.command.v, a.command.omega], [b.command.v, b.command.omega], atol=1e-7
            )
            assert_allclose(a.error_m, b.error_m, atol=1e-9)
            assert a.progress == b.progress


def test_the_bearing_and_the_gains_are_those_of_the_ground(rng: np.random.Generator) -> None:
    """Far from limits: omega is the gain times the bearing, v the gain times the distance."""
    wide = Limits(1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3)
    for _ in range(20):
        xy, theta = rng.uniform(LOW, HIGH), rng.uniform(-3, 3)
        bearing = rng.uniform(-0.3, 0.3)
        d = rng.uniform(0.2, 0.5)
        goal = xy + d * np.array([np.cos(theta + bearing), np.sin(theta + bearing)])
        controller = PointToPoint(
            FLOOR, CAMERA.project(goal)[None], wide, reverse_within_m=0.0, response_s=0.0
        )
        state = RobotState(0.0, CAMERA.project(xy), theta)
        command = controller.step(state, 0.0, 100.0).command
        assert_allclose(command.omega, 3.0 * bearing, atol=1e-9)
        assert_allclose(command.v, 1.5 * d * np.cos(bearing) ** 2, atol=1e-9)


def test_a_g_that_is_off_still_leads_to_the_pixel(rng: np.random.Generator) -> None:
    for _ in range(3):
        G = CAMERA.image_from_ground.copy()
        G[:, :2] *= 1 + rng.uniform(-0.05, 0.05, 2)
        G[2, :2] *= 1 + rng.uniform(-0.05, 0.05)
        wrong = Floor(LimitedHomography.from_homography(G), ORIGIN)
        goal = rng.uniform(LOW, HIGH)
        controller = PointToPoint(wrong, CAMERA.project(goal)[None], response_s=0.0)
        run = drive(controller, CAMERA, rng.uniform(LOW, HIGH), rng.uniform(-3, 3))
        arrived(run, goal, tolerance_m=0.012)  # the tolerance in metres is g's
        assert run.turned() < np.pi + 0.4


def test_noise_does_not_make_it_hunt(rng: np.random.Generator) -> None:
    """1 px at each tick, not filtered, which is 1 to 3 cm there; the state says so."""
    for _ in range(2):
        goal = rng.uniform([-2.0, 4.0], HIGH)
        J = FLOOR.model.jacobian(CAMERA.project(goal))
        covariance = np.zeros((5, 5))
        covariance[:2, :2] = np.linalg.inv(J.T @ J)
        run = drive(
            PointToPoint(FLOOR, CAMERA.project(goal)[None], response_s=0.0),
            CAMERA,
            rng.uniform(LOW, HIGH),
            rng.uniform(-3, 3),
            seconds=20,
            noise_px=1.0,
            covariance=covariance,
            rng=rng,
            until_done=False,
        )
        assert run.guidance.done
        assert np.hypot(*(run.xy[-1] - goal)) < 0.06
        first = int(np.argmax(run.progress == 1))
        assert (np.diff(run.progress[first:]) != 0).sum() <= 2
        near = int(np.argmax(np.hypot(*(run.xy - goal).T) < 0.1))
        assert run.turned(near) < 1.5


def test_it_rests_at_the_goal_until_it_is_pushed_away() -> None:
    goal = np.array([0.3, 4.0])
    controller = PointToPoint(FLOOR, CAMERA.project(goal)[None], tolerance_px=100.0, response_s=0.0)
    for offset, progress, wanted in (
        (0.0, 0.0, 1.0),
        (0.004, 0.0, 1.0),
        (0.009, 0.0, 0.0),  # not yet: it aims inside the tolerance
        (0.015, 1.0, 1.0),  # resting, it stays
        (0.03, 1.0, 0.0),
    ):
        xy = goal - [offset, 0.0]
        state = RobotState(0.0, CAMERA.project(xy), 0.0, v=0.1 * (offset == 0.009))
        answer = controller.step(state, progress, 0.05)
        assert answer.progress == wanted, offset
        assert answer.done == answer.command.at_rest == (wanted == 1)
        assert_allclose(answer.error_m, offset, atol=1e-9)


def test_a_left_handed_ground_is_driven_as_well(rng: np.random.Generator) -> None:
    mirrored = SimCamera(CAMERA.image_from_ground @ np.diag([1.0, -1.0, 1.0]), CAMERA.image_size_px)
    ground = Floor(LimitedHomography(mirrored.g), ORIGIN)
    goal = np.array([0.7, -4.3])
    run = drive(
        PointToPoint(ground, mirrored.project(goal)[None], response_s=0.0),
        mirrored,
        [-1, -3.0],
        2.0,
    )
    assert run.guidance.done
    assert np.hypot(*(run.xy[-1] - goal)) <= 0.01


def test_an_omnidirectional_robot_goes_straight_and_turns_meanwhile(
    rng: np.random.Generator,
) -> None:
    limits = Limits(reverse_mps=0.0)
    for _ in range(2):
        goal, start = rng.uniform(LOW, HIGH), rng.uniform(LOW, HIGH)
        heading = rng.uniform(-3, 3)
        controller = PointOmni(FLOOR, CAMERA.project(goal)[None], limits, heading, response_s=0.0)
        run = drive(controller, CAMERA, start, rng.uniform(-3, 3))
        arrived(run, goal)
        assert abs(np.angle(np.exp(1j * (run.theta[-1] - heading)))) <= 0.03
        way = (goal - start) / np.hypot(*(goal - start))
        aside = (run.xy - start) @ [-way[1], way[0]]
        assert np.abs(aside).max() < 0.01
        assert np.hypot(run.command[:, 0], run.command[:, 2]).max() <= limits.speed_mps + 1e-9
    goals = np.array([[-1.0, 3.4], [1.0, 3.4], [1.0, 5.0]])
    run = drive(PointOmni(FLOOR, CAMERA.project(goals), response_s=0.0), CAMERA, [-1.5, 3.0], 1.0)
    arrived(run, goals[-1])
    assert run.turned() == 0.0
    for goal in goals:
        assert np.hypot(*(run.xy - goal).T).min() < 0.15


@pytest.mark.parametrize("kind", [PointToPoint, PointOmni])
def test_where_there_is_no_answer_it_rests_and_says_why(
    kind: type[PointToPoint | PointOmni],
) -> None:
    above, here = np.array([640.0, -2000.0]), CAMERA.project([0.0, 4.0])
    for state, goal, message in (
        (RobotState(0.0, here, 0.0), above, "goal 0 at .* horizon: click on the ground"),
        (RobotState(0.0, above, 0.0), here, "robot at .* horizon"),
        (RobotState(0.0, here, np.nan), here, "not known"),
        (RobotState(0.0, [np.nan, 3.0], 0.0), here, "not known"),  # type: ignore[arg-type]
        (RobotState(0.0, here, 0.0, v=np.nan), here, "not known"),
    ):
        answer = kind(FLOOR, goal[None]).step(state, 0.0, 0.05)
        assert answer.command.at_rest
        assert not answer.done
        with pytest.raises(AssertionError, match=message):
            raise AssertionError(answer.trouble)


def test_what_cannot_be_is_refused() -> None:
    goals = CAMERA.project([[0.0, 4.0]])
    with pytest.raises(InputError, match="empty"):
        PointToPoint(FLOOR, np.empty((0, 2)), response_s=0.0)
    with pytest.raises(InputError, match="NaN"):
        PointToPoint(FLOOR, np.array([[np.nan, 0.0]]), response_s=0.0)
    for name in ("tolerance_px", "tolerance_m", "tolerance_rad", "passing_m", "distance_gain"):
        with pytest.raises(InputError, match=name):
            PointToPoint(FLOOR, goals, **{name: 0.0})  # type: ignore[arg-type]
    with pytest.raises(InputError, match="spiral"):
        PointToPoint(FLOOR, goals, heading_gain=1.0, response_s=0.0)
    with pytest.raises(InputError, match="heading"):
        PointToPoint(FLOOR, goals, heading=np.inf, response_s=0.0)
    with pytest.raises(InputError, match="response_s"):
        PointToPoint(FLOOR, goals, response_s=-1.0)
    state = RobotState(0.0, goals[0], 0.0)
    for progress, dt, message in ((2.0, 0.1, "progress"), (np.nan, 0.1, "progress"), (0, 0, "dt")):
        with pytest.raises(InputError, match=message):
            PointToPoint(FLOOR, goals, response_s=0.0).step(state, progress, dt)
