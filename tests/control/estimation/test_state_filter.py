"""The state filter against simulated drives: late sightings, noisy readings, dropouts, orders of arrival."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import STOP, VelocityCommand
from airground.control.estimation.options import StateOptions
from airground.control.estimation.state_filter import StateFilter
from airground.geometry.arrays import FloatArray
from late_drive import CAMERA, FLOOR, ORIGIN, TICK, LateDrive, nees, position_error

OPTIONS = StateOptions()
SOURCES = [("compass", "odometry"), ("odometry",), ("compass",), ()]
NAMES = ["all", "odometry", "compass", "image"]


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("sources", SOURCES, ids=NAMES)
def test_prediction_takes_the_lag_away_and_says_how_well(
    rng: np.random.Generator, sources: tuple[str, ...]
) -> None:
    predicted, lagging, headings, ratios = [], [], [], []
    drive = LateDrive(rng, latency_s=0.1, sources=sources, duration_s=6.5)
    for now, state_filter, state in drive.driven(OPTIONS):
        if now < 2.0:
            continue
        truth = drive.at(now + drive.actuation_s)
        predicted.append(position_error(state, truth))
        lagging.append(position_error(state_filter.predict(state.seen_t), truth))
        headings.append(np.angle(np.exp(1j * (state.theta - truth[2]))))
        ratios.append(nees(state, truth))
        assert state.seen_t == state_filter.seen_t >= now - 0.16
    # 0.3 m/s for 0.17 s are 5 cm; 1 px is about 0.4 cm here.
    assert rms(predicted) < 0.01
    assert rms(lagging) > 0.04
    assert rms(headings) < np.radians(2.5)
    # 1 where the covariance is right. Its straying is more than the simulation's, so it is below.
    assert 0.25 < np.mean(ratios) < 1.6


def test_the_covariance_is_right_for_data_as_the_model_has_them(rng: np.random.Generator) -> None:
    ratios = []
    options = replace(OPTIONS, speed_stray=0.05, turn_stray=0.05, speed_stray_mps=0.004)
    for _ in range(3):
        drive = LateDrive(rng, sources=("odometry",), duration_s=3.5, stray=0.1)
        for now, _, state in drive.driven(options):
            if now >= 1.0:
                ratios.append(nees(state, drive.at(now + drive.actuation_s)))
    assert 0.4 < np.mean(ratios) < 1.6


def test_late_sightings_cost_little() -> None:
    errors = {}
    for latency in (0.0, 0.2):
        drive = LateDrive(np.random.default_rng(5), latency_s=latency, sources=(), duration_s=5.0)
        errors[latency] = rms(
            [
                position_error(state, drive.at(now + drive.actuation_s))
                for now, _, state in drive.driven(OPTIONS)
                if now >= 2.0
            ]
        )
    assert errors[0.2] < 2.5 * errors[0.0] < 0.02


@pytest.mark.parametrize("sources", [("odometry",), ()], ids=["odometry", "image"])
def test_a_dropout_is_bridged_and_doubt_grows_in_it(
    rng: np.random.Generator, sources: tuple[str, ...]
) -> None:
    drive = LateDrive(rng, sources=sources, dark=((2.5, 3.5),), duration_s=4.5)
    doubt, errors = {}, {}
    for now, state_filter, state in drive.driven(OPTIONS):
        assert now < 1.5 or state_filter.ready
        if now >= 2.0:
            assert state.covariance is not None
            doubt[now] = float(np.sqrt(np.trace(state.covariance[:2, :2])))
            errors[now] = position_error(state, drive.at(now + drive.actuation_s))
    in_the_dark = [value for now, value in doubt.items() if 2.7 < now < 3.6]
    assert np.all(np.diff(in_the_dark) > 0)
    assert in_the_dark[-1] > 1.6 * doubt[min(doubt)]
    assert max(errors.values()) < 0.12  # of 30 cm driven unseen
    assert all(errors[now] < 4 * doubt[now] for now in errors)
    assert list(errors.values())[-1] < 0.02
    assert state_filter.counts.jumps == state_filter.counts.losses == 0


def test_the_order_of_arrival_does_not_matter(rng: np.random.Generator) -> None:
    drive = LateDrive(rng, duration_s=0.9)
    told = [(name, arguments) for _, name, arguments in drive.events()]
    told += [("sent", {"t": k * TICK, "command": drive.program(k * TICK)}) for k in range(27)]
    states: list[list[FloatArray]] = []
    for turn in range(6):
        state_filter = StateFilter(FLOOR, OPTIONS)
        order = range(len(told)) if turn == 0 else rng.permutation(len(told))
        for k in order:
            name, arguments = told[k]
            assert getattr(state_filter, name)(**arguments)
            if turn % 2 and rng.uniform() < 0.3:
                state_filter.predict(float(rng.uniform(0, 1)))  # asking changes nothing
        state = state_filter.predict(0.95)
        assert state.covariance is not None
        states.append([state.uv, np.array([state.theta, state.v, state.omega]), state.covariance])
    for answer in states[1:]:
        for one, other in zip(answer, states[0], strict=True):
            assert_allclose(one, other, rtol=0, atol=0)  # the very same numbers


def test_the_axle_is_told_where_the_mark_is_seen(rng: np.random.Generator) -> None:
    arm = (0.12, -0.05)
    drive = LateDrive(rng, arm_m=arm, sources=("odometry",), duration_s=3.5)
    errors: dict[bool, list[float]] = {True: [], False: []}
    events = drive.events()
    for known in (True, False):
        options = replace(OPTIONS, lever_arm_m=arm) if known else OPTIONS
        for now, _, state in drive.driven(options, events=events):
            if now >= 1.5:
                errors[known].append(position_error(state, drive.at(now + drive.actuation_s)))
    assert rms(errors[True]) < 0.012
    assert rms(errors[False]) > 0.1


def test_the_robots_clock_is_brought_to_the_cameras(rng: np.random.Generator) -> None:
    drive = LateDrive(rng, duration_s=3.0)
    events = [
        (t, what, told if what == "see" else {**told, "t": told["t"] + 0.4})
        for t, what, told in drive.events()
    ]
    errors = []
    for now, _, state in drive.driven(replace(OPTIONS, time_offset_s=0.4), events=events):
        if now >= 1.0:
            errors.append(position_error(state, drive.at(now + drive.actuation_s)))
    assert rms(errors) < 0.01


@pytest.mark.parametrize("sources", [("odometry",), ()], ids=["odometry", "image"])
def test_the_vehicles_own_scales_are_found(
    rng: np.random.Generator, sources: tuple[str, ...]
) -> None:
    drive = LateDrive(rng, sources=sources, scale_sigma=0.2, stray=0.02, duration_s=6.5)
    *_, (_, state_filter, _) = drive.driven(OPTIONS)
    assert_allclose(state_filter.scales, drive.scales, atol=0.04)


def test_a_command_takes_effect_after_its_delay_and_the_vehicle_follows_with_its_lag() -> None:
    delay, lag = 0.2, 0.25
    options = replace(OPTIONS, actuation_delay_s=delay, speed_lag_s=lag, turn_lag_s=lag)
    state_filter = StateFilter(FLOOR, options)
    state_filter.sent(-1.0, STOP)
    for k in range(31):
        state_filter.read(k * TICK, heading=0.4, speed=0.0, turn_rate=0.0)
        state_filter.see(k * TICK, ORIGIN)
    state_filter.sent(1.0, VelocityCommand(0.3, 0.0))
    state_filter.sent(1.3, VelocityCommand(0.0, 0.0))
    for t in (1.19, 1.25, 1.45, 1.6, 2.0):
        go, brake = max(0.0, t - 1.0 - delay), max(0.0, t - 1.3 - delay)
        speed = 0.3 * (np.exp(-brake / lag) - np.exp(-go / lag))
        way = 0.3 * (go - brake) - lag * speed  # what is told less what still lags
        state = state_filter.predict(t)
        assert state.v == pytest.approx(speed, abs=1e-3)
        xy = FLOOR.position(state.uv)
        assert_allclose(xy, way * np.array([np.cos(0.4), np.sin(0.4)]), atol=2e-3)


def test_sideways_driving_follows_its_command() -> None:
    """Crab-wise with a heading of 0: the mark moves along y; a slow robot so that the start finds its way."""
    state_filter = StateFilter(FLOOR, OPTIONS)
    corner = CAMERA.unproject(ORIGIN)
    state_filter.sent(-1.0, VelocityCommand(0.0, 0.0, 0.2))
    for k in range(60):
        t = k * TICK
        state_filter.read(t, heading=0.0, speed=0.0, turn_rate=0.0)
        state_filter.see(t, CAMERA.project(corner + (0.0, 0.2 * t)))
    state = state_filter.predict(2.2)
    assert state_filter.counts.sightings_refused == 0
    assert_allclose(state.lateral, 0.2, atol=0.02)
    assert_allclose(FLOOR.position(state.uv), [0.0, 0.44], atol=0.02)


def test_what_stands_stays_known_for_long() -> None:
    state_filter = StateFilter(FLOOR, OPTIONS)
    corner = CAMERA.unproject(ORIGIN)
    state_filter.sent(-1.0, VelocityCommand(0.2, 0.0))
    t = 0.0
    for k in range(30):
        t = k * TICK
        state_filter.see(t, CAMERA.project(corner + (0.2 * t, 0.0)))
    assert state_filter.ready
    state_filter.sent(t, STOP)
    for _ in range(120):
        t += 0.25
        state_filter.see(t, CAMERA.project(corner + (0.2 * 29 * TICK + 0.04, 0.0)))
    state = state_filter.predict(t)
    assert state_filter.ready
    assert abs(state.theta) < 0.05
    assert abs(state.v) < 0.01
    assert state.covariance is not None
    assert 0 < state.covariance[2, 2] < 0.1**2


def test_nothing_is_known_before_sightings_nor_long_after() -> None:
    state_filter = StateFilter(FLOOR, OPTIONS)
    state = state_filter.predict(0.0)
    assert np.isnan([*state.uv, state.theta, state.v, state.omega]).all()
    assert state.covariance is None
    assert state.seen_t == state_filter.seen_t == -inf
    assert "not been seen" in state_filter.trouble
    state_filter.read(0.0, heading=0.3, speed=0.0, turn_rate=0.0)
    state_filter.see(0.01, ORIGIN)
    assert state_filter.ready
    assert state_filter.trouble == ""
    assert_allclose(state_filter.predict(0.02).uv, ORIGIN, atol=0.5)
    assert np.isnan(state_filter.predict(500.0).theta)
    assert np.isnan(state_filter.predict(-0.5).theta)  # before all data
    assert state_filter.ready  # asking changes nothing
