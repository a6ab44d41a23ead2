"""Wrong data: refused and counted, never raised, and never the end of the filter."""

from __future__ import annotations

from math import inf, nan, pi
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.control import STOP, VelocityCommand
from airground.control.estimation.counts import StateCounts
from airground.control.estimation.options import StateOptions
from airground.control.estimation.state_filter import StateFilter
from airground.errors import InputError
from late_drive import FLOOR, ORIGIN, TICK, LateDrive, position_error

if TYPE_CHECKING:
    from late_drive import Event

OPTIONS = StateOptions()


def errors_of(
    drive: LateDrive, events: list[Event] | None = None, since: float = 1.5
) -> tuple[list[float], StateCounts]:
    errors, counts = [], StateCounts()
    for now, state_filter, state in drive.driven(OPTIONS, events=events):
        if now >= since:
            errors.append(position_error(state, drive.at(now + drive.actuation_s)))
        counts = state_filter.counts
    return errors, counts


def test_marks_elsewhere_are_refused_and_counted(rng: np.random.Generator) -> None:
    drive = LateDrive(rng, sources=("odometry",), duration_s=3.5)
    events, spoiled = drive.events(), 0
    for _, what, told in events:
        if what == "see" and told["t"] > 1.2 and rng.uniform() < 0.25:
            angle = rng.uniform(-pi, pi)
            told["uv"] = told["uv"] + 100 * np.array([np.cos(angle), np.sin(angle)])
            spoiled += 1
    errors, counts = errors_of(drive, events)
    assert max(errors) < 0.03
    assert abs(counts.sightings_refused - spoiled) <= 4  # the last may not have arrived
    assert counts.jumps == counts.losses == 0


def test_a_robot_carried_elsewhere_is_found_again(rng: np.random.Generator) -> None:
    drive = LateDrive(rng, duration_s=4.0)
    rows = drive.truth
    c, s = np.cos(1.0), np.sin(1.0)
    way = rows[200:, :2] - rows[200, :2]
    rows[200:, :2] = rows[200, :2] + (-0.9, 0.3) + way @ np.array([[c, s], [-s, c]])
    rows[200:, 2] += 1.0
    wrong, found, readiness = [], [], []
    for now, state_filter, state in drive.driven(OPTIONS):
        if 2.2 < now < 2.3:
            wrong.append(position_error(state, drive.at(now + drive.actuation_s)))
        if now > 3.0:
            readiness.append(state_filter.ready)
            found.append(position_error(state, drive.at(now + drive.actuation_s)))
    assert state_filter.counts.jumps == 1
    assert state_filter.counts.sightings_refused >= OPTIONS.jump_after
    assert state_filter.counts.readings_doubted > 0  # the compass was right
    assert all(readiness)
    assert max(found) < 0.04
    assert np.mean(wrong) > 0.3  # it takes some sightings to believe that


def test_slipping_wheels_do_not_carry_the_state_along(rng: np.random.Generator) -> None:
    drive = LateDrive(rng, duration_s=4.0)
    events = drive.events()
    for _, what, told in events:
        if what == "read" and 2.0 < told["t"] < 2.6:
            told["speed"] *= 4.0
    errors, counts = errors_of(drive, events)
    assert counts.readings_doubted >= 3
    assert max(errors) < 0.06  # the wheels make 55 cm more in that time
    assert errors[-1] < 0.02
    assert counts.jumps == 0


def test_a_blocked_robot_is_seen_to_stand(rng: np.random.Generator) -> None:
    """It is told to drive on, and nothing reads its wheels."""
    state_filter, drive = StateFilter(FLOOR, OPTIONS), LateDrive(rng, sources=(), duration_s=3.0)
    held = drive.mark(1.5)
    for k in range(90):
        now = k * TICK
        state_filter.sent(now, VelocityCommand(0.3, 0.45) if now > 1.5 else drive.program(now))
        state_filter.see(now, (held if now > 1.5 else drive.mark(now)) + rng.normal(0, 1, 2))
    state = state_filter.predict(now)
    assert state_filter.counts.jumps == state_filter.counts.losses == 0
    assert float(FLOOR.distance(state.uv, held)) < 0.04
    assert abs(state.v) < 0.15


def test_what_comes_too_late_or_from_a_wrong_clock_is_refused() -> None:
    state_filter = StateFilter(FLOOR, OPTIONS)
    assert state_filter.read(10.0, heading=0.1, speed=0.0)
    assert state_filter.see(10.0, ORIGIN)
    before = state_filter.predict(10.1)
    assert not state_filter.see(8.9, ORIGIN + 3)
    assert not state_filter.read(8.9, speed=0.1)
    assert not state_filter.see(1.7e9, ORIGIN)
    assert state_filter.counts == StateCounts(late=2, early=1)
    after = state_filter.predict(10.1)
    assert_allclose(after.uv, before.uv, atol=0)
    assert state_filter.see(9.1, ORIGIN)  # within the window


def test_unusable_data_are_refused_and_counted() -> None:
    state_filter = StateFilter(FLOOR, OPTIONS)
    above = np.array([640.0, -2000.0])
    refused = [
        state_filter.see(0.0, (nan, 3.0)),
        state_filter.see(0.0, (inf, 3.0)),
        state_filter.see(nan, ORIGIN),
        state_filter.see(0.0, above),
        state_filter.see(0.0, ORIGIN, [[1.0, 0.0], [0.0, -1.0]]),
        state_filter.see(0.0, ORIGIN, [[1.0, 2.0], [2.0, 1.0]]),
        state_filter.see(0.0, ORIGIN, [[nan, 0.0], [0.0, 1.0]]),
        state_filter.see(0.0, ORIGIN, 1e30 * np.eye(2)),
        state_filter.read(0.0, heading=nan),
        state_filter.read(inf, speed=0.1),
        state_filter.read(0.0, speed=1e9),
        state_filter.read(0.0, turn_rate=-inf),
        state_filter.sent(0.0, VelocityCommand(nan, 0.0)),
        state_filter.sent(0.0, VelocityCommand(0.0, 1e9)),
        state_filter.sent(nan, STOP),
    ]
    assert refused == [False] * 15
    assert state_filter.counts == StateCounts(unusable=15)
    assert state_filter.read(0.0)  # nothing at all is no fault
    assert not state_filter.read(0.0, heading=0.2, speed=nan)  # but the heading is taken
    assert state_filter.see(0.01, ORIGIN)
    assert state_filter.ready
    assert state_filter.counts == StateCounts(unusable=16)


def test_wrong_shapes_and_times_are_the_callers_fault() -> None:
    state_filter = StateFilter(FLOOR, OPTIONS)
    with pytest.raises(InputError, match=r"uv must have shape \(2,\)"):
        state_filter.see(0.0, [1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="covariance must have shape"):
        state_filter.see(0.0, ORIGIN, [1.0, 2.0])
    for t in (nan, inf):
        with pytest.raises(InputError, match="t must be a finite time"):
            state_filter.predict(t)


def test_memory_is_bounded() -> None:
    state_filter = StateFilter(FLOOR, OPTIONS)
    for k in range(3000):  # nobody asks
        state_filter.read(k * 0.01, speed=0.0)
        state_filter.sent(k * 0.01, STOP)
    history = state_filter._history
    state_filter.predict(30.0)
    assert len(history._data) <= 102
    assert len(history.commands) <= 110
    alone = StateFilter(FLOOR, OPTIONS)
    for k in range(9000):
        alone.sent(k * 0.05, STOP)
    assert len(alone._history.commands) <= 2001


TIMES = st.floats(0, 3) | st.sampled_from([0.0, 0.5, 0.55, 1.0, -4.0, 40.0, 1e9, nan])
PIXELS = st.tuples(st.floats(100, 1200), st.floats(250, 700)) | st.tuples(st.floats(), st.floats())
VALUES = st.floats(-1, 1) | st.floats()
CALLS = st.one_of(
    st.tuples(st.just("see"), TIMES, PIXELS),
    st.tuples(st.just("near"), TIMES, st.floats(-3, 3)),
    st.tuples(st.just("heading"), TIMES, VALUES),
    st.tuples(st.just("speed"), TIMES, VALUES),
    st.tuples(st.just("turn_rate"), TIMES, VALUES),
    st.tuples(st.just("sent"), TIMES, st.tuples(VALUES, VALUES, VALUES)),
    st.tuples(st.just("predict"), st.floats(-1, 6), st.none()),
)


@given(st.lists(CALLS, max_size=40), st.booleans())
def test_any_data_give_a_state_or_say_that_there_is_none(
    calls: list[tuple[str, float, object]], arm: bool
) -> None:
    options = StateOptions(lever_arm_m=(0.1, 0.05) if arm else (0.0, 0.0))
    state_filter = StateFilter(FLOOR, options)
    state_filter.read(0.0, heading=0.3)
    state_filter.see(0.0, ORIGIN)
    for name, t, value in [*calls, ("predict", 3.0, None)]:
        if name == "see":
            state_filter.see(t, value)  # type: ignore[arg-type]
        elif name == "near":
            state_filter.see(t, ORIGIN + value)
        elif name == "sent":
            state_filter.sent(t, VelocityCommand(*value))  # type: ignore[misc]
        elif name != "predict":
            state_filter.read(t, **{name: value})  # type: ignore[arg-type]
        else:
            state = state_filter.predict(t)
            numbers = [*state.uv, state.theta, state.v, state.omega, state.lateral]
            if np.isfinite(numbers).all():
                assert state.covariance is not None
            else:  # told by theta, which every controller looks at
                assert np.isnan(state.theta)
            if state.covariance is not None:
                assert np.isfinite(state.covariance).all()
                least = np.linalg.eigvalsh(state.covariance)[0]
                assert least >= -1e-9 * np.trace(state.covariance)
    assert state_filter.ready == (state_filter.trouble == "")
