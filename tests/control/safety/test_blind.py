"""Safety without a floor: each cause by itself, and a hand-over from and to the layer that has one."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite, nan
from typing import Any

import numpy as np
import pytest

from airground.control import (
    STOP,
    Floor,
    Limits,
    RobotState,
    SafetyBounds,
    SafetyLayer,
    SafetyMemory,
    Sent,
    Situation,
    StopReason,
    VelocityCommand,
)
from airground.control.safety.blind import BlindSafety
from airground.control.safety.blind_types import BlindSituation
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import demo_world

SIZE = (1280, 720)
DT = 0.05
GO = VelocityCommand(0.2, 0.0)
STEP = (200.0, 0.0)  # px/m: forwards is to the right


def known(t: float, **changed: Any) -> BlindSituation:
    now = BlindSituation(
        t,
        uv=(640.0, 360.0),
        seen_t=t - 0.1,
        uv_dot=(0.0, 0.0),
        step_px=STEP,
        speed_mps=0.0,
        turn_radps=0.0,
        frame_t=t - 0.1,
        operator_t=t,
        robot_t=t,
    )
    return replace(now, **changed)


class Drive:
    """Ticks in a row, of a robot that does at once what it is told."""

    def __init__(self, **bounds: Any) -> None:
        self.safety = BlindSafety(Limits(), SIZE, SafetyBounds(**bounds))
        self.memory = SafetyMemory()
        self.t = 0.0

    def tick(self, command: VelocityCommand | None = GO, **changed: Any) -> Sent:
        self.t += DT
        before = self.memory.sent
        honest = {
            "speed_mps": before.v,
            "turn_radps": before.omega,
            "uv_dot": (STEP[0] * before.v, 0.0),
        }
        sent = self.safety.check(command, known(self.t, **{**honest, **changed}), self.memory)
        self.memory = sent.memory
        return sent

    def ticks(self, count: int, command: VelocityCommand | None = GO, **changed: Any) -> Sent:
        for _ in range(count):
            sent = self.tick(command, **changed)
        return sent


@pytest.fixture
def going() -> Drive:
    drive = Drive()
    assert drive.ticks(20).command == GO
    return drive


def test_it_goes_after_some_good_ticks_and_gains_speed_within_the_limits() -> None:
    drive = Drive()
    speeds = [drive.tick().command.v for _ in range(20)]
    assert speeds[:5] == [0.0] * 5
    assert np.diff(speeds).max() <= Limits().acceleration_mps2 * DT + 1e-12
    assert speeds[-1] == 0.2
    too_fast = drive.ticks(40, VelocityCommand(3.0, 0.0))
    assert too_fast.command.v == Limits().speed_mps
    assert too_fast.limited


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"stop": True}, StopReason.OPERATOR),
        ({"uv": None}, StopReason.TRACK),
        ({"seen_t": None}, StopReason.TRACK),
        ({"seen_t": 0.0}, StopReason.TRACK),
        ({"seen_t": 99.0}, StopReason.CLOCK),
        ({"seen_t": nan}, StopReason.NOT_A_NUMBER),
        ({"uv": (nan, 3.0)}, StopReason.NOT_A_NUMBER),
        ({"uv_dot": (0.0, inf)}, StopReason.NOT_A_NUMBER),
        ({"step_px": (nan, 0.0)}, StopReason.NOT_A_NUMBER),
        ({"speed_mps": nan}, StopReason.NOT_A_NUMBER),
        ({"turn_radps": inf}, StopReason.NOT_A_NUMBER),
        ({"frame_t": 0.0}, StopReason.CAMERA),
        ({"operator_t": -1.0}, StopReason.OPERATOR_LINK),
        ({"robot_t": 0.0}, StopReason.ROBOT_LINK),
        ({"separation": "another robot"}, StopReason.SEPARATION),
        ({"disobeys": "others saw it"}, StopReason.DISOBEDIENCE),
        ({"trouble": "no leg"}, StopReason.CONTROLLER),
        ({"uv": (-3.0, 360.0), "step_px": None}, StopReason.IMAGE),
        ({"uv": "a string"}, StopReason.FAULT),
    ],
)
def test_every_cause_stops_at_once(
    going: Drive, changed: dict[str, Any], reason: StopReason
) -> None:
    sent = going.tick(GO, **changed)
    assert sent.command == STOP
    assert sent.stop is not None
    assert sent.stop.reason is reason
    assert sent.stop.line
    after = going.tick()
    assert after.command == STOP  # not without some good ticks
    if reason.latched:
        assert going.ticks(30).command == STOP
        going.memory = going.memory.released()
    assert going.ticks(20).command == GO


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        (None, StopReason.CONTROLLER),
        (VelocityCommand(nan, 0.0), StopReason.NOT_A_NUMBER),
        (VelocityCommand(0.1, inf), StopReason.NOT_A_NUMBER),
    ],
)
def test_a_command_that_is_none_stops(
    going: Drive, command: VelocityCommand | None, reason: StopReason
) -> None:
    sent = going.tick(command)
    assert sent.command == STOP
    assert sent.stop is not None
    assert sent.stop.reason is reason


@pytest.mark.parametrize("by", [nan, 0.0, -0.2, 0.3, 5.0])
def test_a_clock_that_jumps_stops(going: Drive, by: float) -> None:
    going.t += by - DT
    sent = going.tick()
    assert sent.command == STOP
    assert sent.stop is not None
    if isfinite(by):
        assert sent.stop.reason in (StopReason.CLOCK, StopReason.LATE_TICK)


def test_it_stops_before_it_leaves_the_image_and_may_only_come_back() -> None:
    drive = Drive(image_margin_px=20.0)
    drive.ticks(20)
    assert drive.tick(uv=(1200.0, 360.0)).stop is None
    sent = drive.tick(uv=(1250.0, 360.0))  # 10 px to go, and 13 until it rests
    assert sent.stop is not None
    assert sent.stop.reason is StopReason.IMAGE
    assert "1280x720" in sent.stop.line
    outside: dict[str, Any] = {"uv": (1270.0, 360.0)}
    assert drive.ticks(30, **outside).command == STOP
    assert drive.ticks(30, VelocityCommand(-0.2, 0.0), **outside).command.v == -0.2
    assert drive.ticks(30, VelocityCommand(0.0, 0.8), **outside).command.omega == 0.8
    # Along the border is not nearer to it.
    assert drive.ticks(30, GO, uv=(1270.0, 360.0), step_px=(0.0, 200.0), uv_dot=None).command == GO


def test_where_nothing_is_known_of_the_way_it_may_not_drive_outside_the_margin() -> None:
    drive = Drive(image_margin_px=20.0)
    unknown: dict[str, Any] = {"step_px": None, "uv_dot": None}
    assert drive.ticks(30, **unknown).command == GO
    sent = drive.ticks(30, uv=(1270.0, 360.0), **unknown)
    assert sent.command == STOP
    assert sent.stop is not None
    assert "by hand" in sent.stop.line


@pytest.mark.parametrize(
    ("command", "told", "disobeys"),
    [
        (GO, {"speed_mps": 0.0}, True),  # its wheels stand
        (VelocityCommand(0.35, 0.0), {"uv_dot": (0.0, 0.0)}, True),  # they turn, the mark stands
        (GO, {"speed_mps": -0.2, "uv_dot": (-40.0, 0.0)}, True),  # the wrong way round
        (VelocityCommand(0.0, 0.8), {"turn_radps": -0.8}, True),
        (STOP, {"uv_dot": (60.0, 0.0)}, True),  # told to rest, and it is carried off
        (GO, {"speed_mps": None, "uv_dot": None, "turn_radps": None}, False),  # nobody tells
        (GO, {"step_px": None, "uv_dot": (0.0, 0.0)}, False),  # a metre is not known in pixels
        (GO, {"uv_dot": (45.0, 4.0)}, False),  # noise
        (VelocityCommand(0.0, 0.8), {"uv_dot": (30.0, 10.0)}, False),  # a mark beside the axle
    ],
)
def test_obedience_by_odometer_and_image(
    going: Drive, command: VelocityCommand, told: dict[str, Any], disobeys: bool
) -> None:
    for k in range(60):
        sent = going.tick(command, **told)
        if sent.stop is not None:
            assert disobeys
            assert sent.stop.reason is StopReason.DISOBEDIENCE
            assert 1.0 <= k * DT <= 2.0
            break
    else:
        assert not disobeys


def test_before_it_ever_went_it_may_be_carried_to_its_place() -> None:
    drive = Drive(good_ticks=100)
    sent = drive.ticks(60, STOP, uv_dot=(300.0, 0.0))
    assert StopReason.DISOBEDIENCE not in sent.memory.latched


def test_gentle_stops_brake_within_the_limits() -> None:
    drive = Drive(gentle=True)
    drive.ticks(20)
    sent = drive.tick(uv=None)
    assert sent.command.v == pytest.approx(0.2 - Limits().deceleration_mps2 * DT)
    assert drive.tick(stop=True).command == STOP


def test_memory_is_handed_over_to_the_layer_with_a_floor_and_back(going: Drive) -> None:
    camera = demo_world().camera
    floor = Floor(LimitedHomography(camera.g), np.array([640.0, 400.0]))
    layer = SafetyLayer(floor, Limits(), None, SafetyBounds())
    for _ in range(30):
        going.t += DT
        state = RobotState(
            going.t,
            np.array([640.0, 400.0]),
            0.0,
            0.2,
            covariance=np.diag([1e-4] * 5),
            seen_t=going.t,
        )
        still = replace(state, v=0.0)
        sent = layer.check(STOP, Situation(going.t, still), going.memory)
        going.memory = sent.memory
        assert sent.stop is None
    assert going.ticks(10).command == GO  # free to go on at once
    going.tick(stop=True)
    assert StopReason.OPERATOR in going.memory.latched
    going.t += DT
    sent = layer.check(
        GO, Situation(going.t, replace(state, t=going.t, seen_t=going.t)), going.memory
    )
    assert sent.command == STOP
    assert sent.stop is not None
    assert sent.stop.reason is StopReason.OPERATOR


def test_an_image_without_size_is_refused() -> None:
    with pytest.raises(InputError, match="image_size_px"):
        BlindSafety(Limits(), (0, 720))
