"""What is refused, with which line, and that nothing changes by it."""

from __future__ import annotations

import pytest

from airground.session.orders import (
    Alive,
    Calibrate,
    DriveTo,
    EndCalibration,
    FollowPath,
    Gone,
    Hand,
    Order,
    Release,
    Rest,
    SetFences,
    SetSpeed,
    Sketch,
    Stop,
)
from airground.session.session import Session
from session_runs import RED_GOAL, session, view

LINE = ((500.0, 420.0), (600.0, 360.0), (700.0, 330.0))
BOX = ((600.0, 330.0), (640.0, 330.0), (640.0, 300.0), (600.0, 300.0))

STRANGERS = [
    DriveTo("nobody", (RED_GOAL,)),
    Sketch("nobody", 1, LINE),
    FollowPath("nobody", 1),
    Rest("nobody"),
    SetSpeed("nobody", 0.2),
    Calibrate("guided", ("red", "nobody")),
    Hand("nobody", 1.0, 0.0),
]
MOVING = [DriveTo("red", (RED_GOAL,)), FollowPath("red", 1), Calibrate(), Hand("red", 1.0, 0.0)]
NEED_GROUND = [
    DriveTo("red", (RED_GOAL,)),
    Sketch("red", 1, LINE),
    FollowPath("red", 1),
    Hand("red", 1.0, 0.0),
]


def name(order: Order) -> str:
    return order.kind


@pytest.mark.parametrize("order", STRANGERS, ids=name)
def test_a_robot_that_there_is_not(order: Order) -> None:
    one = session()
    one.run(0.2)
    one.order(order)
    tick = one.step()
    assert tick.refused == (("me", "there is no robot 'nobody'; there are red"),)
    assert tick.mode == "idle"


@pytest.mark.parametrize("order", MOVING, ids=name)
def test_nothing_that_moves_is_begun_while_stop_is_pressed(order: Order) -> None:
    one = session()
    one.run(0.2)
    one.order(Stop(), "somebody")
    one.step()
    one.order(order)
    tick = one.step()
    assert tick.refused == (("me", "STOP is pressed: release it first"),)
    assert (tick.mode, tick.why, tick.stop_heard) == ("stopped", "STOP, by somebody", 1)


@pytest.mark.parametrize("order", NEED_GROUND, ids=name)
def test_what_needs_the_ground_waits_for_a_calibration(order: Order) -> None:
    one = session(known=False)
    one.run(0.2)
    one.order(order)
    assert one.step().refused[0][1].endswith("calibrate first")


@pytest.mark.parametrize("order", NEED_GROUND[:1] + NEED_GROUND[2:3], ids=name)
def test_nothing_is_steered_during_a_calibration_drive(order: Order) -> None:
    one = session()
    one.run(0.2)
    one.order(Calibrate("hand"))
    one.step()
    one.order(order)
    assert one.step().refused == (("me", "a calibration drive is under way: end it first"),)
    one.order(EndCalibration(keep=False))
    tick = one.step()
    assert tick.mode == "idle"
    assert tick.calibration.status == "calibrated"


def test_a_calibration_drive_that_there_is_not_cannot_be_ended() -> None:
    one = session()
    one.run(0.1)
    one.order(EndCalibration())
    assert one.step().refused == (("me", "no calibration drive is under way"),)


def test_no_calibration_before_the_camera_has_shown_anything() -> None:
    one = session(known=False)
    one.order(Calibrate())
    assert one.step().refused == (("me", "the camera has not shown anything yet"),)


def test_nobody_drives_by_fences_that_are_not_there_yet() -> None:
    one = session(job_s=0.3)
    one.run(0.2)
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(0.5)
    assert view(one).task == "goal"
    one.order(SetFences(keep_out=(BOX,)))
    one.step()
    assert view(one).task == "none"
    one.order(DriveTo("red", (RED_GOAL,)))
    assert one.step().refused == (("me", "the fences are being drawn: try again"),)
    one.run(0.4)
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(0.4)
    assert view(one).task == "goal"


def test_fences_that_are_none_are_said_and_hold_robots_until_others_are_drawn() -> None:
    one = session()
    one.run(0.2)
    one.order(SetFences(keep_out=(((10.0, 10.0), (20.0, 10.0), (30.0, 10.0)),)))
    one.run(0.2)
    assert any("the fences cannot be used, draw others" in line for line in one.said)
    one.order(DriveTo("red", (RED_GOAL,)))
    assert "draw others" in one.step().refused[0][1]
    one.order(SetFences())
    one.step()
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(0.2)
    assert view(one).task == "goal"


def test_a_path_is_released_only_as_it_was_shown() -> None:
    one = session()
    one.run(0.2)
    one.order(FollowPath("red", 1))
    assert one.step().refused[0][1] == "that path is not known any more: draw it again"
    one.order(Sketch("red", 1, LINE))
    one.run(0.2)
    one.order(FollowPath("red", 2))
    assert one.step().refused[0][1] == "that path is not known any more: draw it again"
    one.order(SetFences(keep_out=(BOX,)))  # it was checked against others
    one.run(0.2)
    one.order(FollowPath("red", 1))
    assert one.step().refused[0][1] == "that path is not known any more: draw it again"
    one.order(Sketch("red", 3, ((500.0, 420.0), (500.0, 420.0))))
    one.run(0.2)
    one.order(FollowPath("red", 3))
    assert one.step().refused[0][1].startswith("the path cannot be driven: ")


def test_goals_that_are_no_ground_are_refused() -> None:
    one = session()
    one.run(0.2)
    for goal, line in (((640.0, -400.0), "is outside the image"), ((2000.0, 300.0), "outside")):
        one.order(DriveTo("red", (goal,)))
        one.run(0.2)
        assert line in one.refused[-1]
        assert view(one).task == "none"


def test_only_who_is_at_the_controls_can_leave_them() -> None:
    one = session()
    one.run(0.2)
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(0.3)
    one.order(Gone(), "somebody else")
    one.step()
    assert view(one).task == "goal"
    one.order(Gone(), "me")
    one.step()
    assert view(one).task == "none"


def test_stop_counts_each_time_and_is_released_by_anybody_at_the_controls() -> None:
    one = session()
    for client in ("a", "b", "c"):
        one.order(Stop(), client)
    tick = one.step()
    assert (tick.stop_heard, tick.why) == (3, "STOP, by a")
    one.order(Release(), "me")
    tick = one.step()
    assert (tick.mode, tick.why, tick.stop_heard) == ("idle", "", 3)
    one.order(Alive(), "me")
    assert one.step().refused == ()


def test_rest_of_one_robot_lets_the_other_drive_on() -> None:
    one = session(2)
    one.run(0.2)
    for robot in ("red", "blue"):
        one.order(DriveTo(robot, (RED_GOAL if robot == "red" else (1112.0, 431.0),)))
    one.run(0.2)
    one.order(Rest("red"))
    one.step()
    assert (view(one).task, view(one, "blue").task) == ("none", "goal")
    one.order(Rest())
    one.step()
    assert view(one, "blue").task == "none"


def test_a_session_says_in_its_ticks_what_it_was_asked_and_when() -> None:
    core: Session = session().session
    first, second = core.step(0.02, []), core.step(0.04, [])
    assert (first.number, second.number, second.t) == (1, 2, 0.04)
