"""Each cause stops the robot within one tick, says so with its numbers, and lets it go again as it should."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from airground.control import STOP, Floor, Limits, RobotState, VelocityCommand
from airground.control.safety.bounds import SafetyBounds
from airground.control.safety.layer import SafetyLayer
from airground.control.safety.types import SafetyMemory, Situation, StopReason
from airground.control.separation.fence import Fence
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import demo_world

CAMERA = demo_world().camera
FLOOR = Floor(LimitedHomography(CAMERA.g), np.array([640.0, 400.0]))
EXACT = np.diag((1e-3 * CAMERA.g.ravel()) ** 2)
SURE = np.diag([1e-4, 1e-4, 1e-4, 1e-4, 1e-4])
ASKEW = 1e-4 * np.eye(5)  # each axis is known to 0.11 m, a diagonal to 0.16 m
ASKEW[:2, :2] = [[0.013, 0.0125], [0.0125, 0.013]]
FENCE = Fence(FLOOR, (np.array([[200.0, 250.0], [1100.0, 250.0], [1200.0, 700.0], [80.0, 700.0]]),))
AHEAD = VelocityCommand(0.3, 0.2)
TICK = 0.05
HERE = np.array([640.0, 400.0])
nan, inf = float("nan"), float("inf")


def layer(**changes: Any) -> SafetyLayer:
    given: dict[str, Any] = {
        "fence": FENCE,
        "image_size_px": CAMERA.image_size_px,
        "bounds": SafetyBounds(**changes.pop("bounds", {})),
    }
    return SafetyLayer(FLOOR, Limits(), EXACT, **{**given, **changes})


def state(t: float, **changes: Any) -> RobotState:
    known: dict[str, Any] = {"uv": HERE, "theta": 0.3, "covariance": SURE, "seen_t": t - 0.1}
    return RobotState(t + 0.1, **{**known, **changes})


def situation(t: float, state_changes: dict[str, Any] | None = None, **changes: Any) -> Situation:
    given: dict[str, Any] = {
        "state": state(t, **(state_changes or {})),
        "frame_t": t - 0.1,
        "operator_t": t - 0.2,
        "robot_t": t - 0.05,
    }
    return Situation(t, **{**given, **changes})


def going(safe: SafetyLayer, seconds: float = 0.6) -> tuple[float, SafetyMemory]:
    """A robot that has been free to go for a while; it is seen where it is told to be."""
    t, memory = 0.0, SafetyMemory()
    for k in range(round(seconds / TICK)):
        t = k * TICK
        # The robot stands in this: what it is told stays too small to be missed.
        memory = safe.check(VelocityCommand(0.05, 0.03), situation(t), memory).memory
    assert memory.going
    return t + TICK, memory


# For each cause: what is odd about the next tick, and a word and a number of the line.
CAUSES: dict[str, tuple[dict[str, Any], StopReason, str]] = {
    "time nan": ({"t": nan}, StopReason.NOT_A_NUMBER, "time is nan"),
    "time inf": ({"t": inf}, StopReason.NOT_A_NUMBER, "time is inf"),
    "clock back": ({"later": -0.3}, StopReason.CLOCK, "back by 0.25"),
    "clock stands": ({"later": -TICK}, StopReason.CLOCK, "stands"),
    "clock jumps": ({"later": 100.0}, StopReason.CLOCK, "jumped by 100"),
    "late": ({"later": 0.4}, StopReason.LATE_TICK, "0.45 s"),
    "operator's link": ({"operator_t": -3.0}, StopReason.OPERATOR_LINK, "at most 1 s"),
    "operator never heard": ({"operator_t": -inf}, StopReason.OPERATOR_LINK, "inf s ago"),
    "robot's link": ({"robot_t": 0.0}, StopReason.ROBOT_LINK, "0.60 s ago"),
    "no pictures": ({"frame_t": 0.0}, StopReason.CAMERA, "0.60 s ago"),
    "operator of the future": ({"operator_t": 2.0}, StopReason.CLOCK, "clocks disagree"),
    "frame nan": ({"frame_t": nan}, StopReason.NOT_A_NUMBER, "picture"),
    "stop": ({"stop": True}, StopReason.OPERATOR, "STOP"),
    "too close": ({"separation": "0.2 m from b"}, StopReason.SEPARATION, "0.2 m from b"),
    "no answer": ({"trouble": "goal on the horizon"}, StopReason.CONTROLLER, "goal on"),
    "no state": ({"state": None}, StopReason.TRACK, "not been found"),
    "no command": ({"command": None}, StopReason.CONTROLLER, "no command"),
    "command nan": ({"command": VelocityCommand(0.1, nan)}, StopReason.NOT_A_NUMBER, "nan rad/s"),
    "command inf": ({"command": VelocityCommand(-inf, 0)}, StopReason.NOT_A_NUMBER, "-inf m/s"),
    "stale track": ({"seen": {"seen_t": 0.0}}, StopReason.TRACK, "0.60 s ago, at most 0.5"),
    "never seen": ({"seen": {"seen_t": -inf}}, StopReason.TRACK, "inf s ago"),
    "seen nan": ({"seen": {"seen_t": nan}}, StopReason.NOT_A_NUMBER, "state"),
    "seen in the future": ({"seen": {"seen_t": 1.0}}, StopReason.CLOCK, "clocks"),
    "old state": ({"state": state(-0.5)}, StopReason.STATE_TIME, "-1.00 s"),
    "place nan": ({"seen": {"uv": [nan, 1.0]}}, StopReason.NOT_A_NUMBER, "state"),
    "heading nan": ({"seen": {"theta": nan}}, StopReason.NOT_A_NUMBER, "state"),
    "speed inf": ({"seen": {"v": inf}}, StopReason.NOT_A_NUMBER, "state"),
    "huge": ({"seen": {"uv": [1e308, 1e308], "v": 1e308}}, StopReason.NOT_A_NUMBER, "state"),
    "covariance nan": (
        {"seen": {"covariance": np.full((5, 5), nan)}},
        StopReason.NOT_A_NUMBER,
        "covariance",
    ),
    "covariance huge": (
        {"seen": {"covariance": np.diag([1e308] * 5)}},
        StopReason.NOT_A_NUMBER,
        "covariance",
    ),
    "negative variance": (
        {"seen": {"covariance": np.diag([1e-4, 1e-4, -1e-9, 0, 0])}},
        StopReason.NOT_A_NUMBER,
        "negative",
    ),
    "nothing known": ({"seen": {"covariance": None}}, StopReason.STATE_SIGMA, "nothing is known"),
    "place uncertain": (
        {"seen": {"covariance": ASKEW}},
        StopReason.STATE_SIGMA,
        "0.16 m",
    ),
    "heading uncertain": (
        {"seen": {"covariance": np.diag([1e-4, 1e-4, 0.36, 0, 0])}},
        StopReason.STATE_SIGMA,
        "0.6 rad",
    ),
    "horizon": ({"seen": {"uv": [640.0, -2000.0]}}, StopReason.HORIZON, "-2000"),
    "outside the image": ({"seen": {"uv": [640.0, 719.9]}}, StopReason.IMAGE, "1280x720"),
    "outside the fence": ({"seen": {"uv": [30.0, 690.0]}}, StopReason.FENCE, "m too far out"),
    "jump": ({"seen": {"uv": [640.0, 620.0]}}, StopReason.STATE_JUMP, "moved"),
    "turned round": ({"seen": {"theta": 2.4}}, StopReason.STATE_JUMP, "2.10 rad"),
}


def odd_tick(t: float, odd: dict[str, Any]) -> tuple[VelocityCommand | None, Situation]:
    odd = dict(odd)
    command = odd.pop("command", AHEAD)
    t += odd.pop("later", 0.0)
    now = situation(t, odd.pop("seen", None))
    return command, replace(now, **odd)


@pytest.mark.parametrize("name", CAUSES)
def test_a_cause_stops_it_at_once_and_says_why(name: str) -> None:
    odd, reason, word = CAUSES[name]
    safe = layer()
    t, memory = going(safe)
    assert not memory.sent.at_rest
    sent = safe.check(*odd_tick(t, odd), memory)
    assert sent.command == STOP
    assert sent.stop is not None
    found = {stop.reason: stop.line for stop in sent.causes}
    assert reason in found
    assert word in found[reason]
    assert "\n" not in found[reason]
    assert sent.memory.counts[reason] == 1
    assert [s.reason for s in sent.memory.stops] == list(
        dict.fromkeys(s.reason for s in sent.causes)
    )
    assert not sent.memory.going


@pytest.mark.parametrize("name", CAUSES)
def test_it_goes_on_after_some_good_ticks_unless_it_is_latched(name: str) -> None:
    odd, reason, _ = CAUSES[name]
    safe = layer()
    t, memory = going(safe)
    command, now = odd_tick(t, odd)
    memory = safe.check(command, now, memory).memory
    t = t if not np.isfinite(now.t) else now.t
    waits, jumps_back = [], 0
    for k in range(1, 9):
        sent = safe.check(AHEAD, situation(t + k * TICK), memory)
        memory = sent.memory
        waits.append(sent.command == STOP)
        assert {s.reason for s in sent.causes} <= {StopReason.STATE_JUMP}  # back again
        jumps_back += len(sent.causes)
        if sent.stop is not None and not sent.causes:
            assert "released" in sent.stop.line or "good ticks" in sent.stop.line
    if reason.latched:
        assert all(waits)
        memory = memory.released()
        for k in range(9, 14):
            assert memory.sent == STOP
            memory = safe.check(AHEAD, situation(t + k * TICK), memory).memory
        assert memory.going
    else:
        # After four good ticks it still stands, with the fifth it goes.
        assert waits[:4] == [True] * 4
        assert waits[4 + jumps_back :] == [False] * (4 - jumps_back)
        assert jumps_back <= 1
    assert memory.counts[reason] == 1


def test_a_good_tick_passes_what_is_within_the_limits_untouched() -> None:
    safe = layer()
    t, memory = going(safe)
    sent = safe.check(VelocityCommand(0.06, 0.04), situation(t), memory)
    assert (sent.command, sent.stop, sent.causes) == (VelocityCommand(0.06, 0.04), None, ())
    assert not sent.limited
    assert sent.memory.sent == sent.command
    fast = safe.check(VelocityCommand(9.0, 6.0), situation(t + TICK), sent.memory)
    assert fast.limited
    assert fast.command.v == pytest.approx(0.06 + 0.5 * TICK)
    assert fast.asked == VelocityCommand(9.0, 6.0)


def test_it_starts_with_good_ticks_only() -> None:
    safe, memory = layer(), SafetyMemory()
    sent = []
    for k in range(8):
        out = safe.check(AHEAD, situation(k * TICK), memory)
        sent.append(out.command.at_rest)
        memory = out.memory
    assert sent == [True] * 5 + [False] * 3  # the first has no time before it
    assert memory.counts == {}
    assert memory.stops == ()


def test_a_cause_that_lasts_is_told_once_and_again_when_it_comes_back() -> None:
    safe = layer()
    t, memory = going(safe)
    for k in range(30):
        hidden = {"seen_t": -1.0} if k % 15 < 5 else {}
        memory = safe.check(AHEAD, situation(t + k * TICK, hidden), memory).memory
    assert memory.counts == {StopReason.TRACK: 2}
    assert [round((s.t - t) / TICK) for s in memory.stops] == [0, 15]


def test_the_gravest_cause_comes_first() -> None:
    safe = layer()
    t, memory = going(safe)
    now = situation(t, {"seen_t": 0.0}, stop=True, operator_t=-9.0)
    sent = safe.check(None, now, memory)
    assert sent.stop is not None
    assert [s.reason for s in sent.causes] == [
        StopReason.OPERATOR,
        StopReason.OPERATOR_LINK,
        StopReason.TRACK,
        StopReason.CONTROLLER,
    ]
    assert sent.stop == sent.causes[0]


def test_stop_holds_while_it_is_pressed_whatever_is_released() -> None:
    safe = layer()
    t, memory = going(safe)
    for k in range(20):
        sent = safe.check(AHEAD, situation(t + k * TICK, stop=True), memory)
        assert sent.command == STOP
        memory = sent.memory.released()
    assert not memory.going


def test_the_calibrations_uncertainty_counts_where_the_robot_is() -> None:
    loose = np.diag((2e-2 * CAMERA.g.ravel()) ** 2)  # 4.1 % near the camera, 6.6 % far away
    safe = SafetyLayer(FLOOR, Limits(), loose, SafetyBounds(calibration_sigma=0.055))
    near = SafetyMemory(t=0.0, held=frozenset())
    for uv, stops in (([640.0, 700.0], False), ([640.0, -100.0], True)):
        sent = safe.check(AHEAD, situation(TICK, {"uv": uv}), near)
        assert [s.line for s in sent.causes] == stops * [
            "ground velocities good to 6.6%, at most 5.5%"
        ]


def test_gentle_stops_brake_within_the_limits_and_grave_ones_do_not() -> None:
    safe = layer(bounds={"gentle": True})
    fast = SafetyMemory(t=0.0, held=frozenset(), sent=VelocityCommand(0.4, 0.4))
    lost = safe.check(AHEAD, situation(TICK, state=None), fast)
    assert lost.command.v == pytest.approx(0.4 - 0.8 * TICK)
    assert lost.command.omega == pytest.approx(lost.command.v)
    assert safe.check(AHEAD, situation(TICK, stop=True), fast).command == STOP
    assert safe.check(AHEAD, situation(TICK, separation="near"), lost.memory).command == STOP


def test_nobody_has_to_watch_links_image_or_fence() -> None:
    safe = SafetyLayer(
        FLOOR, Limits(), None, SafetyBounds(position_sigma_m=inf, heading_sigma_rad=inf)
    )
    memory = SafetyMemory()
    for k in range(8):
        t = k * TICK
        outside = state(t, uv=np.array([640.0, 900.0]), covariance=None)
        memory = safe.check(VelocityCommand(0.05, 0.0), Situation(t, outside), memory).memory
    assert memory.going


class Broken:
    """A fence that fails."""

    floor = FLOOR

    def boundary(self, x: float, y: float) -> None:
        raise RuntimeError(f"no answer\nat ({x}, {y})")


def test_what_fails_inside_stops_the_robot() -> None:
    safe = layer(fence=Broken())
    memory = SafetyMemory(t=0.0, held=frozenset(), sent=AHEAD)
    sent = safe.check(AHEAD, situation(TICK, stop=True), memory)
    assert sent.command == STOP
    assert [s.reason for s in sent.causes] == [StopReason.OPERATOR, StopReason.FAULT]
    assert sent.causes[1].line == "RuntimeError: no answer"
    assert StopReason.OPERATOR in sent.memory.latched


def test_senseless_layers_and_bounds_are_refused() -> None:
    elsewhere = Floor(FLOOR.model, np.array([600.0, 400.0]))
    with pytest.raises(InputError, match="another floor"):
        SafetyLayer(elsewhere, Limits(), EXACT, fence=FENCE)
    with pytest.raises(InputError, match="image_size_px"):
        layer(image_size_px=(0, 3))
    with pytest.raises(InputError, match="symmetric"):
        SafetyLayer(FLOOR, Limits(), np.triu(np.ones((6, 6))))
    for change in (
        {"tick_s": 0.0},
        {"tick_s": inf},
        {"track_s": -1.0},
        {"jump_m": nan},
        {"window_s": inf},
        {"good_ticks": 0},
        {"good_ticks": 1.5},
        {"fence_margin_m": inf},
    ):
        with pytest.raises(InputError, match=next(iter(change))):
            SafetyBounds(**change)
