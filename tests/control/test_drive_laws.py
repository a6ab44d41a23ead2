"""Closing a gap, rounding a corner, and what limits leave of a command."""

from __future__ import annotations

from math import pi, tan

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import Limits, RobotState
from airground.control.drive_laws import closing_rate, corner_speed, steered, turn_reach, wrapped
from airground.control.goals.arrival import Arrival


def test_closing_a_gap_brakes_evenly_and_ends_at_rest() -> None:
    gap, dt, speeds = 2.0, 1e-3, []
    while gap > 1e-4:
        speeds.append(closing_rate(gap, 1.5, 0.5, 0.4))
        gap -= speeds[-1] * dt
    braking = -np.diff(speeds) / dt
    assert max(speeds) == 0.5
    assert braking.min() >= 0
    assert braking.max() <= 0.4 + 1e-3
    assert closing_rate(0.0, 1.5, 0.5, 0.4) == closing_rate(-1.0, 1.5, 0.5, 0.4) == 0.0


def test_a_corner_is_rounded_within_limits() -> None:
    limits = Limits(speed_mps=5.0, turn_rate_radps=2.0, lateral_acceleration_mps2=1.0)
    for turn in (0.3, 1.0, 2.0, 3.0):
        out = (3 * np.cos(turn), 3 * np.sin(turn))
        v = corner_speed(limits, 0.2, (0.5, 0.0), out)
        radius = 0.2 / tan(turn / 2)
        assert_allclose(max(v / radius / 2.0, v * v / radius / 1.0), 1.0)
    assert corner_speed(limits, 0.2, (1.0, 0.0), (2.0, 0.0)) == 5.0
    assert corner_speed(limits, 0.2, (1.0, 0.0), (0.0, 0.0)) == 5.0
    assert corner_speed(limits, 0.2, (1.0, 0.0), (-1.0, 0.0)) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("now", "wanted", "after"),
    [
        (0.2, 0.5, 0.25),
        (0.2, 0.0, 0.12),
        (0.2, 0.19, 0.19),
        (-0.2, 0.5, -0.12),
        (-0.04, 0.5, 0.025),  # 0.05 s to stand, 0.05 s to gain
        (0.04, -0.2, -0.025),
        (0.48, 9.0, 0.5),
        (-0.18, -9.0, -0.2),
    ],
)
def test_speed_is_lost_faster_than_gained(now: float, wanted: float, after: float) -> None:
    state = RobotState(0.0, np.zeros(2), 0.0, v=now)
    assert_allclose(steered(Limits(), wanted, 0.0, state, 0.1)[0], after)


def test_turn_rates_fit_the_speed() -> None:
    limits = Limits(turn_radius_m=0.5)
    assert turn_reach(limits, 0.0) == 0.0
    assert_allclose([turn_reach(limits, v) for v in (0.2, -0.2, 2.0)], [0.4, 0.4, 0.5])
    state = RobotState(0.0, np.zeros(2), 0.0, v=0.0, omega=-1.0)
    assert_allclose(steered(Limits(), 0.0, 3.0, state, 0.1)[1], -0.6)


def test_angles_wrap() -> None:
    for angle, same in ((pi + 0.1, 0.1 - pi), (-pi - 0.1, pi - 0.1), (7 * pi + 0.1, 0.1 - pi)):
        assert_allclose(wrapped(angle), same)


def test_arrival_asks_no_more_than_is_known() -> None:
    arrival = Arrival(2.0, 0.01)
    here = np.zeros(2)
    sharp = RobotState(0.0, here, 0.0)
    for error, grade in ((0.005, "there"), (0.008, "near"), (0.015, "between"), (0.03, "away")):
        assert arrival.grade(0.0, error, sharp, (error, 0.0)) == grade
    assert arrival.grade(3.0, 0.001, sharp, (0.001, 0.0)) == "between"
    covariance = np.diag([0.02**2, 0.002**2, 1.0, 1.0, 1.0])
    vague = RobotState(0.0, here, 0.0, covariance=covariance)
    assert arrival.grade(0.0, 0.018, vague, (0.018, 0.0)) == "there"
    assert arrival.grade(0.0, 0.018, vague, (0.0, 0.018)) == "between"
    assert arrival.grade(0.0, 0.09, vague, (0.09, 0.0)) == "between"
    assert arrival.grade(0.0, 0.11, vague, (0.11, 0.0)) == "away"
    useless = RobotState(0.0, here, 0.0, covariance=np.full((5, 5), np.nan))
    assert arrival.grade(0.0, 0.03, useless, (0.03, 0.0)) == "away"
