"""Goals, paths, speeds and hand, in the truth of the embedded world."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.session.hand import HOLD_S
from airground.session.orders import DriveTo, FollowPath, Hand, Rest, SetFences, SetSpeed, Sketch
from session_runs import RED_GOAL, off_m, off_px, session, speed, view

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.geometry.arrays import FloatArray
    from airground.session.stepped import SteppedSession

NEAR = (560.0, 330.0)


def test_a_robot_arrives_where_was_clicked_and_says_so() -> None:
    one = session()
    one.run(0.3)
    one.order(DriveTo("red", (NEAR,)))
    tick = one.run(12, lambda tick: tick.robots[0].done)
    assert view(one).done
    assert tick.mode == "idle"
    one.run(0.4)
    assert speed(one) < 0.005
    assert off_px(one, NEAR) < 3
    assert off_m(one, NEAR) < 0.02
    assert view(one).goals_px == (NEAR,)
    assert (view(one).error_px or 0.0) < 3
    assert view(one).stop == ""


def test_a_robot_keeps_the_speed_that_was_set_and_its_own_limit() -> None:
    one = session()
    one.run(0.2)
    one.order(SetSpeed("red", 99.0))
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(1.6)
    assert view(one).speed_limit_mps == 0.5
    assert speed(one) == pytest.approx(0.5, rel=0.06)
    one.order(SetSpeed("red", 0.15))
    one.run(1.0)
    assert view(one).speed_limit_mps == 0.15
    assert speed(one) == pytest.approx(0.15, rel=0.06)


def test_a_robot_that_is_told_to_rest_brakes_within_its_limits_and_forgets() -> None:
    one = session()
    one.run(0.2)
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(1.2)
    one.order(Rest("red"))
    speeds = [one.step().commands["red"].v for _ in range(30)]
    assert np.diff([0.3, *speeds]).min() > -0.8 * 0.02 - 0.02
    assert speeds[-1] == 0
    assert view(one).task == "none"


def test_a_sketch_is_shown_then_driven_as_it_was_shown() -> None:
    one = session()
    one.run(0.2)
    share = np.linspace(0, 1, 40)
    drawn = [(480 + 200 * s, 370 - 60 * s - 25 * np.sin(2 * np.pi * s)) for s in share]
    one.order(Sketch("red", 7, tuple(drawn)))
    tick = one.run(1.0, lambda tick: bool(tick.paths))
    shown = tick.paths[0]
    assert (shown.robot, shown.sketch, shown.drivable, shown.released) == ("red", 7, True, False)
    assert shown.deviation_px < 20
    assert 0.5 < shown.length_m < 3
    assert tick.mode == "idle"
    assert view(one).command.at_rest  # nothing moves by it
    one.order(FollowPath("red", 7))
    one.run(15, lambda tick: tick.robots[0].task == "path")
    assert one.tick is not None
    assert one.tick.paths[0].released
    places = []
    progress = [0.0]
    while not view(one).done:
        one.run(0.1)
        assert one.t < 40
        places.append(one.world.truth("red", one.t).uv)
        progress.append(view(one).progress)
    line = shown.points[:, :2]
    dense = np.column_stack(
        [np.interp(np.linspace(0, 1, 4000), np.linspace(0, 1, len(line)), k) for k in line.T]
    )
    off = [float(np.hypot(*(dense - place).T).min()) for place in places]
    assert np.sqrt(np.mean(np.square(off))) < 3
    assert np.diff(progress).min() >= 0
    assert progress[-1] > 0.97
    one.run(1.0)  # it comes to rest
    assert off_px(one, tuple(line[-1])) < 2
    assert off_m(one, tuple(line[-1])) < 0.01


def test_what_stands_in_the_way_is_waited_for_and_told() -> None:
    """Blue stands in a corridor that is too narrow to pass it."""
    one = session(2)
    one.run(0.2)
    red, blue = (one.world.truth(name, one.t).xy for name in ("red", "blue"))
    along = (blue - red) / hypot(*(blue - red))
    aside = 0.6 * np.array([-along[1], along[0]])
    ends = red - 0.8 * along, blue + 1.6 * along
    corners = [ends[0] + aside, ends[0] - aside, ends[1] - aside, ends[1] + aside]
    one.order(SetFences(stay_inside=(_pixels(one, corners),)))
    one.order(SetSpeed("red", 0.5))
    one.run(0.2)
    one.order(DriveTo("red", _pixels(one, [blue + 0.9 * along])))
    one.run(14, lambda tick: any("waits" in event.line for event in tick.events))
    assert "waits: something stands in its way" in one.said
    assert view(one).stop  # and why, all the time
    one.run(0.5)
    red, blue = (one.world.truth(name, one.t).xy for name in ("red", "blue"))
    assert hypot(*(red - blue)) > 2 * one.world.radius_m - 0.02
    assert speed(one) < 0.02
    assert one.tick is not None
    assert one.tick.mode == "driving"


def _pixels(one: SteppedSession, xy: ArrayLike) -> tuple[tuple[float, float], ...]:
    return tuple((float(u), float(v)) for u, v in one.world.camera.project(np.array(xy)))


def test_a_robot_stays_out_of_what_was_fenced_and_goes_round_it() -> None:
    one = session()
    one.run(0.2)
    one.order(SetSpeed("red", 0.5))
    start, goal = one.world.truth("red", one.t).uv, np.array(RED_GOAL)
    middle = one.world.camera.unproject((start + goal) / 2)
    corners = np.array([[-0.3, 0.0], [0.0, -0.3], [0.3, 0.0], [0.0, 0.3]]) + middle
    one.order(SetFences(keep_out=(_pixels(one, corners),)))
    one.run(0.2)
    (inside,) = _pixels(one, [middle])
    one.order(DriveTo("red", (inside,)))
    one.run(0.2)
    assert view(one).task == "none"
    assert len(one.refused) == 1
    one.order(Sketch("red", 1, (tuple(start), inside, RED_GOAL)))
    one.run(0.4)
    assert one.tick is not None
    assert not one.tick.paths[0].drivable
    assert one.tick.paths[0].undrivable[0][1]
    one.order(DriveTo("red", (RED_GOAL,)))
    nearest = np.inf
    while not view(one).done:
        one.run(0.2)
        assert one.t < 40
        xy = one.world.truth("red", one.t).xy
        nearest = min(nearest, _distance(corners, xy))
    assert one.world.radius_m - 0.02 < nearest < one.world.radius_m + 0.3
    assert off_m(one, RED_GOAL) < 0.02


def _distance(corners: FloatArray, xy: FloatArray) -> float:
    """From a convex ring that does not hold the point."""
    best = np.inf
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        s = np.clip((xy - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        best = min(best, float(np.hypot(*(a + s * (b - a) - xy))))
    return best


def test_a_robot_driven_by_hand_does_not_leave_the_fence() -> None:
    one = session()
    one.run(0.2)
    x, y = one.world.truth("red", one.t).xy
    corners = np.array([[-0.7, -0.7], [0.7, -0.7], [0.7, 0.7], [-0.7, 0.7]]) + [x, y]
    one.order(SetFences(stay_inside=(_pixels(one, corners),)))
    one.run(0.2)
    for _ in range(20):
        one.order(Hand("red", 1.0, 0.0))
        one.run(0.1)
    xy = one.world.truth("red", one.t).xy - [x, y]
    assert np.abs(xy).max() < 0.7 - one.world.radius_m + 0.03
    assert speed(one) < 0.05


def test_a_hand_that_is_not_repeated_lets_go() -> None:
    one = session()
    one.run(0.2)
    one.order(Hand("red", 1.0, 0.5))
    one.step()
    assert view(one).task == "hand"
    assert one.tick is not None
    assert one.tick.mode == "driving"
    one.run(HOLD_S - 0.04)
    assert view(one).command.v > 0.1
    assert view(one).command.omega > 0.4
    one.run(0.1)
    assert view(one).task == "none"
    one.run(0.4)
    assert view(one).command.at_rest


def test_a_stick_at_rest_takes_nothing_away_and_a_pushed_one_does() -> None:
    one = session()
    one.run(0.2)
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(0.4)
    one.order(Hand("red", 0.0, 0.0))
    one.step()
    assert view(one).task == "goal"
    one.order(Hand("red", -0.5, 0.0))
    one.step()
    assert view(one).task == "hand"
    one.run(0.3)
    one.order(Hand("red", -0.5, 0.0))
    one.run(0.3)
    assert view(one).command.v == pytest.approx(-0.1, abs=0.02)  # half of what it may do in reverse


def test_left_on_the_stick_is_left_on_the_ground() -> None:
    one = session()
    one.run(0.2)
    before = one.world.truth("red", one.t).theta
    for _ in range(8):
        one.order(Hand("red", 0.0, 0.6))
        one.run(0.1)
    assert one.world.truth("red", one.t).theta > before + 0.3
