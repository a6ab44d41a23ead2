"""Whatever is asked for: within the limits, reached within the accelerations, and on the curve where that can be."""

from __future__ import annotations

import sys
from math import hypot

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from airground.control import STOP, Limits, VelocityCommand
from airground.control.safety.limits import limited
from limits_judge import breaches, jumps

HUGE = sys.float_info.max
anything = st.floats(-3.0, 3.0) | st.sampled_from([0.0, 1e-320, -1e-300, HUGE, -HUGE, 0.2, -0.2])
positive = st.floats(0.05, 3.0)
ticks = st.floats(1e-6, 0.25)


@st.composite
def some_limits(draw: st.DrawFn) -> Limits:
    return Limits(
        speed_mps=draw(positive),
        reverse_mps=draw(st.just(0.0) | st.floats(0.01, 1.0)),
        turn_rate_radps=draw(positive),
        acceleration_mps2=draw(positive),
        deceleration_mps2=draw(positive),
        turn_acceleration_radps2=draw(st.floats(0.1, 10.0)),
        lateral_acceleration_mps2=draw(st.floats(0.05, 2.0)),
        turn_radius_m=draw(st.just(0.0) | st.floats(0.05, 2.0)),
    )


@given(
    some_limits(),
    st.lists(st.tuples(anything, anything, ticks), min_size=1, max_size=30),
    st.booleans(),
)
@example(Limits(turn_radius_m=0.5), [(0.5, 1.0, 0.1)] * 20 + [(-0.2, 0.4, 0.1)] * 12, False)
@example(Limits(), [(0.5, 0.0, 0.1)] * 12 + [(0.0, 1.5, 0.1)] * 8, False)
@example(Limits(turn_acceleration_radps2=10.0), [(0.3, 0.6, 0.1)] * 5, True)  # on a diagonal
@example(  # slows down faster than it can straighten out
    Limits(turn_radius_m=0.5, turn_acceleration_radps2=0.1),
    [(0.5, 1.0, 0.25)] * 45 + [(0.01, 0.0, 0.25)] * 20,
    False,
)
@example(  # speeds up faster than it can straighten out
    Limits(lateral_acceleration_mps2=0.1, turn_acceleration_radps2=0.1),
    [(0.1, 1.0, 0.25)] * 45 + [(0.5, 0.0, 0.25)] * 10,
    False,
)
def test_every_sequence_stays_within_all_limits(
    limits: Limits, asked: list[tuple[float, float, float]], sideways: bool
) -> None:
    before = STOP
    for v, omega, dt in asked:
        command = VelocityCommand(v, omega, omega / 2 if sideways else 0.0)
        now = limited(command, before, dt, limits)
        assert breaches(now, limits) == []
        assert jumps(before, now, dt, limits) == []
        if not sideways:
            assert now.lateral == 0
        before = now
    for _ in range(260):  # 65 s: 3 m/s at 0.05 m/s^2 take 60 s
        now = limited(STOP, before, 0.25, limits)
        assert jumps(before, now, 0.25, limits) == []
        assert now.v * before.omega == pytest.approx(before.v * now.omega, abs=1e-9)  # same curve
        before = now
        if now.at_rest:
            break
    assert before.at_rest


@given(some_limits(), anything, anything)
def test_a_command_that_holds_is_reached(limits: Limits, v: float, omega: float) -> None:
    before, steps = STOP, []
    for _ in range(300):  # 75 s, see above
        now = limited(VelocityCommand(v, omega), before, 0.25, limits)
        steps.append(hypot(now.v - before.v, now.omega - before.omega))
        before = now
    assert steps[-1] < 1e-12
    allowed = VelocityCommand(v, omega)
    if breaches(allowed, limits) == []:
        assert (before.v, before.omega) == pytest.approx((v, omega), abs=1e-9)


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ((1.0, 1.0), (0.5, 0.5)),  # speed
        ((-0.4, 1.0), (-0.2, 0.5)),  # reverse
        ((0.2, 3.0), (0.1, 1.5)),  # turn rate
        ((0.5, 1.5), (0.5 * (0.5 / 0.75) ** 0.5, 1.5 * (0.5 / 0.75) ** 0.5)),  # v omega to 0.5
        ((0.0, 9.0), (0.0, 1.5)),
        ((0.3, 0.5), (0.3, 0.5)),
    ],
)
def test_limits_keep_the_curve(asked: tuple[float, float], expected: tuple[float, float]) -> None:
    limits = Limits(lateral_acceleration_mps2=0.5)
    now = STOP
    for _ in range(60):
        before, now = now, limited(VelocityCommand(*asked), now, 0.05, limits)
        assert now.v * asked[1] == pytest.approx(now.omega * asked[0], abs=1e-12)
        assert before == STOP or abs(now.v) >= abs(before.v)
    assert (now.v, now.omega) == pytest.approx(expected)


def test_from_rest_the_slower_of_both_sets_the_pace() -> None:
    limits = Limits(acceleration_mps2=0.5, turn_acceleration_radps2=1.0)
    now = limited(VelocityCommand(0.5, 1.0), STOP, 0.1, limits)
    assert (now.v, now.omega) == pytest.approx((0.05, 0.1))
    tight = limited(VelocityCommand(0.5, 1.5), STOP, 0.1, limits)
    assert (tight.v, tight.omega) == pytest.approx((0.1 / 3, 0.1))


def test_who_may_not_reverse_still_turns_and_who_cannot_turn_tightly_turns_wider() -> None:
    forward = Limits(reverse_mps=0.0)
    assert limited(VelocityCommand(-1.0, 0.3), STOP, 0.25, forward) == VelocityCommand(0.0, 0.3)
    wide = Limits(turn_radius_m=1.0)
    now = STOP
    for _ in range(40):
        now = limited(VelocityCommand(0.3, 1.0), now, 0.05, wide)
    assert (now.v, now.omega) == pytest.approx((0.3, 0.3))
    assert limited(VelocityCommand(0.0, 1.0), STOP, 0.05, wide).at_rest
