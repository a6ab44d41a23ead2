"""A calibration drive: to a calibration that is right, and whatever may come between."""

from __future__ import annotations

import numpy as np
import pytest

from airground.session.orders import Calibrate, DriveTo, EndCalibration, Hand, Release, Stop
from airground.session.stepped import SteppedSession
from session_runs import RED_GOAL, session, speed, view


def drive(by: str = "guided", robots: int = 1, **options: bool) -> SteppedSession:
    one = session(robots, known=options.get("known", False), job_s=0.3)
    one.run(0.3)
    one.order(Calibrate(by))  # type: ignore[arg-type]
    one.step()
    return one


def test_two_robots_drive_until_the_camera_is_known_and_what_comes_out_is_right() -> None:
    """The slow one."""
    one = drive(robots=2)
    tick = one.run(110, lambda tick: tick.calibration.phase == "good")
    assert tick.calibration.phase == "good", one.said
    assert tick.mode == "calibrating"
    assert tick.calibration.live_sigma is not None
    assert tick.calibration.live_sigma <= tick.calibration.wanted_sigma
    one.order(EndCalibration())
    tick = one.run(5, lambda tick: tick.calibration.status == "calibrated")
    assert (tick.mode, tick.calibration.revision, one.refused) == ("idle", 1, [])
    assert any(line.startswith("calibrated: speeds are known to") for line in one.said)
    found, camera = one.session.calibration, one.world.camera
    assert found is not None
    assert found.time_offset_s == pytest.approx(one.world.time_offset_s, abs=0.03)
    for place in ((-0.9, 3.6), (0.9, 4.3), (0.0, 3.5), (1.2, 5.2)):
        for velocity in ((0.3, 0.0), (0.0, 0.3)):
            uv = camera.project(np.array(place))
            image = camera.project_velocity(np.array(place), np.array(velocity))
            xy_dot, covariance = found.ground_velocity(uv, image)
            error = xy_dot - velocity
            sigma = np.sqrt(np.trace(covariance))
            assert np.hypot(*error) <= 0.08 * 0.3
            assert np.hypot(*error) <= 3 * sigma
    one.order(DriveTo("red", (RED_GOAL,)))  # and it can be driven with
    one.run(2.0)
    assert one.refused == []
    assert view(one).task == "goal"


def test_legs_are_driven_by_one_robot_at_a_time_and_told() -> None:
    one = drive(robots=2)
    both = 0
    for _ in range(35):
        one.run(0.1)
        both += speed(one) > 0.03 and speed(one, "blue") > 0.03
    assert both == 0
    assert one.tick is not None
    assert one.tick.calibration.phase in ("starting", "running")
    assert one.tick.calibration.robot in ("red", "blue")
    assert one.tick.calibration.advice
    assert max(abs(view(one, name).command.v) for name in ("red", "blue")) <= 0.3


def test_stop_during_a_leg_stops_it_and_the_drive_can_be_gone_on_with() -> None:
    one = drive()
    one.run(8, lambda tick: tick.commands["red"].v > 0.2)
    assert view(one).task == "leg"
    one.order(Stop())
    one.step()
    assert view(one).command.at_rest
    assert one.tick is not None
    assert one.tick.mode == "stopped"
    one.run(0.5)
    assert speed(one) < 0.02
    one.order(Release())
    tick = one.run(1.0)
    assert tick.mode == "calibrating"
    assert view(one).command.at_rest  # nothing moves by a release
    assert "paused" in tick.calibration.advice
    known = len(one.session.drive.estimate.data._sightings) if one.session.drive else 0
    assert known > 20
    one.order(Calibrate())
    one.run(8, lambda tick: tick.commands["red"].v > 0.1)
    assert view(one).command.v > 0.1
    assert one.session.drive is not None
    assert len(one.session.drive.estimate.data._sightings) > known  # and nothing was forgotten


def test_an_operator_who_is_gone_pauses_the_drive() -> None:
    one = drive()
    one.run(8, lambda tick: tick.commands["red"].v > 0.2)
    one.operator = ""
    one.run(1.3)
    assert view(one).command.at_rest
    one.operator = "me"
    one.run(0.5)
    assert view(one).command.at_rest
    assert one.tick is not None
    assert one.tick.mode == "calibrating"


@pytest.mark.parametrize("fault", ["gone", "covered", "link"])
def test_what_is_lost_during_a_leg_stops_it(fault: str) -> None:
    one = drive()
    one.run(8, lambda tick: tick.commands["red"].v > 0.2)
    if fault == "gone":
        one.world.faults.camera(gone=True)
    elif fault == "covered":
        one.world.faults.robot("red", covered=True)
    else:
        one.world.faults.robot("red", link_gone=True)
    one.run(0.6)
    assert view(one).command.at_rest
    assert view(one).stop
    one.run(0.45)
    assert speed(one) < 0.02


def test_a_hand_takes_the_drive_over_from_the_legs() -> None:
    one = drive()
    one.run(8, lambda tick: tick.commands["red"].v > 0.2)
    one.order(Hand("red", 0.0, 0.0))
    one.step()
    assert view(one).task == "leg"
    one.order(Hand("red", 0.0, 0.5))
    one.run(0.3)
    assert view(one).task == "hand"
    assert "driven by hand: legs are paused" in one.said
    assert view(one).command.omega > 0.3
    one.run(1.0)
    assert view(one).task == "none"
    assert view(one).command.at_rest


def test_driven_by_hand_from_the_start() -> None:
    one = drive("hand")
    one.run(0.5)
    assert view(one).command.at_rest
    for _ in range(10):
        one.order(Hand("red", 1.0, 0.0))
        one.run(0.1)
    assert speed(one) > 0.15
    assert one.tick is not None
    assert "drive straight along three directions" in one.tick.calibration.advice


def test_a_drive_that_is_discarded_leaves_what_was() -> None:
    one = drive(known=True)
    before = one.session.calibration
    one.run(3.0)
    one.order(EndCalibration(keep=False))
    tick = one.run(0.5)
    assert one.session.calibration is before
    assert (tick.mode, tick.calibration.phase) == ("idle", "off")
    one.order(DriveTo("red", (RED_GOAL,)))
    one.run(1.2)
    assert speed(one) > 0.1


def test_a_drive_that_says_too_little_is_refused_and_goes_on() -> None:
    one = drive()
    one.run(0.5)
    one.order(EndCalibration())
    tick = one.run(1.0)
    assert len(one.refused) == 1
    assert one.refused[0].startswith("no calibration yet: ")
    assert tick.mode == "calibrating"
