"""A ground speed held by what a simulated camera sees, of a vehicle that does not know its own speed."""

from __future__ import annotations

from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.control import VelocityCommand
from airground.control.estimation.options import StateOptions
from airground.control.estimation.state_filter import StateFilter
from airground.control.speed_hold import SpeedHold, SpeedMemory
from airground.errors import InputError
from late_drive import CAMERA, FLOOR, TICK

HOLD = SpeedHold()
WANTED = 0.3


def test_a_wrong_odometer_does_not_show_over_an_image_whose_scale_changes_threefold(
    rng: np.random.Generator,
) -> None:
    """It reads 20 % more than it drives, and drives what it reads; from far away until close to the camera."""
    near, far = np.array([0.0, 2.6]), np.array([0.0, 6.4])
    speeds_px = np.linalg.norm(CAMERA.project_velocity(np.stack([near, far]), (0.0, -1.0)), axis=1)
    assert speeds_px[0] > 3 * speeds_px[1]
    options = StateOptions(speed_lag_s=0.15, actuation_delay_s=0.05)
    state_filter, memory = StateFilter(FLOOR, options), SpeedMemory()
    xy, v, steps = far.copy(), 0.0, 10
    waiting: list[tuple[float, np.ndarray]] = []
    commands = [(0.0, 0.0)]
    speeds = []
    for k in range(round(12 / TICK)):
        now = k * TICK
        uv = CAMERA.project(xy) + rng.normal(0, 1, 2)
        waiting.append((now, uv))
        while waiting and waiting[0][0] <= now - 0.1:
            state_filter.see(*waiting.pop(0))
        state_filter.read(now, speed=1.2 * v * (1 + 0.1 * rng.normal()))
        state = state_filter.predict(now)
        sigma = nan if state.covariance is None else float(np.sqrt(state.covariance[3, 3]))
        command, memory = HOLD.step(memory, WANTED, state.v, TICK, sigma_mps=sigma)
        state_filter.sent(now, VelocityCommand(command, 0.0))
        commands.append((now + 0.05, command))
        for i in range(steps):
            t = now + i * TICK / steps
            told = [c for start, c in commands[-4:] if start <= t]
            v += (told[-1] / 1.2 - v) * (1 - np.exp(-TICK / steps / 0.15))
            xy = xy - (0.0, v * TICK / steps)
        speeds.append(v)
    late = np.array(speeds)[round(6 / TICK) :]
    assert near[1] < xy[1] < 3.2  # that far it came
    assert abs(late.mean() / WANTED - 1) < 0.01
    assert abs(late / WANTED - 1).max() < 0.03
    halves = np.convolve(late, np.full(15, 1 / 15), "valid")  # means over 0.5 s
    assert abs(halves / WANTED - 1).max() < 0.02
    assert np.max(speeds) < 1.06 * WANTED
    assert memory.scale == pytest.approx(1.2, rel=0.02)


def driven(
    unit: float | list[float], wanted: list[float], lag: float = 0.15
) -> tuple[list[float], SpeedMemory]:
    """True speeds of a vehicle that drives `unit` of what it is told, with a lag, seen 0.1 s late."""
    memory, v, speeds = SpeedMemory(), 0.0, [0.0] * 3
    units = unit if isinstance(unit, list) else [unit] * len(wanted)
    for share, speed in zip(units, wanted, strict=True):
        command, memory = HOLD.step(memory, speed, speeds[-3], TICK)
        v += (share * command - v) * (1 - np.exp(-TICK / lag))
        speeds.append(v)
    return speeds[3:], memory


@pytest.mark.parametrize("unit", [0.7, 0.8, 1.0, 1.3])
@pytest.mark.parametrize("wanted", [WANTED, -0.15])
def test_it_holds_whatever_the_unit_and_does_not_swing(unit: float, wanted: float) -> None:
    speeds, memory = driven(unit, [wanted] * 300)
    relative = np.array(speeds) / wanted
    assert_allclose(relative[200:], 1.0, atol=0.01)
    assert relative.max() < max(unit, 1.0) + 0.08
    assert memory.scale == pytest.approx(1 / unit, rel=0.01)
    assert not memory.at_bound
    # The scale is known by now: another speed is right at once.
    speeds, _ = driven(unit, [wanted] * 300 + [2 * wanted] * 90)
    assert_allclose(np.array(speeds)[330:] / (2 * wanted), 1.0, atol=0.02)


def test_a_right_unit_is_left_alone_while_the_vehicle_speeds_up() -> None:
    for lag in (0.15, 0.35):  # slower than it is thought to be
        scales = [driven(1.0, [WANTED] * n, lag)[1].scale for n in (10, 20, 30, 60)]
        assert_allclose(scales, 1.0, atol=0.05)


def test_a_blocked_vehicle_is_told_no_more_than_the_bound_and_comes_free_soon() -> None:
    speeds, memory = driven([0.0] * 600, [WANTED] * 600)
    assert memory.scale == HOLD.most
    assert memory.at_bound
    speeds, memory = driven([0.0] * 600 + [1.0] * 250, [WANTED] * 850)
    assert not memory.at_bound
    assert_allclose(speeds[800:], WANTED, rtol=0.02)


@pytest.mark.parametrize("measured", [nan, inf, -inf])
def test_nothing_is_learnt_from_what_is_not_measured(measured: float) -> None:
    memory = SpeedMemory(1.2, WANTED, WANTED)
    command, after = HOLD.step(memory, WANTED, measured, TICK)
    assert command == pytest.approx(1.2 * WANTED)
    assert after.scale == 1.2
    for sigma in (nan, inf, 1e300):
        _, after = HOLD.step(memory, WANTED, 0.1, TICK, sigma_mps=sigma)
        assert after.scale == 1.2
    _, after = HOLD.step(memory, WANTED, 0.1, TICK)
    assert after.scale > 1.2


def test_rest_is_rest_and_nothing_is_learnt_at_it() -> None:
    memory = SpeedMemory(1.2, WANTED, WANTED)
    for wanted in (0.0, nan, inf):
        command, after = HOLD.step(memory, wanted, 0.5, TICK)
        assert command == 0.0
        assert after.scale == 1.2
    _, after = HOLD.step(SpeedMemory(1.2, 0.01, 0.01), 0.01, 0.5, TICK)
    assert after.scale == 1.2


NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


@given(st.lists(st.tuples(NUMBERS, NUMBERS, st.floats(min_value=0)), max_size=30))
def test_any_measurement_leaves_the_scale_within_its_bounds(
    steps: list[tuple[float, float, float]],
) -> None:
    memory = SpeedMemory()
    for wanted, measured, sigma in steps:
        within = max(-1e6, min(1e6, wanted))
        command, memory = HOLD.step(memory, within, measured, TICK, sigma_mps=sigma)
        assert 1 / HOLD.most <= memory.scale <= HOLD.most
        assert np.isfinite([command, memory.following_mps, memory.expected_mps]).all()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"time_s": 0.0}, "time_s must be positive"),
        ({"lag_s": -1.0}, "lag_s must be 0 or more"),
        ({"lateness_s": nan}, "lateness_s must be 0 or more"),
        ({"most": 1.0}, "most must be above 1"),
        ({"sigma_share": inf}, "sigma_share must be positive"),
    ],
)
def test_options_are_checked(wrong: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        SpeedHold(**wrong)


def test_steps_are_checked() -> None:
    for dt in (0.0, nan, inf):
        with pytest.raises(InputError, match="dt must be positive"):
            HOLD.step(SpeedMemory(), WANTED, WANTED, dt)
    with pytest.raises(InputError, match="sigma_mps must be 0 or more"):
        HOLD.step(SpeedMemory(), WANTED, WANTED, TICK, sigma_mps=-1.0)
