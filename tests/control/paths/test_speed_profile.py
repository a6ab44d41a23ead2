"""Speeds along a path against linear programs, a solver of its own, and differences of the answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import linprog  # type: ignore[import-untyped,unused-ignore]

from airground.control import Limits
from airground.control.paths.speed_profile import speed_profile, travel_times, turn_time
from airground.errors import InputError
from airground.geometry.arrays import FloatArray

LIMITS = Limits(speed_mps=0.8)
FREE_TURN = replace(LIMITS, turn_acceleration_radps2=1e6)


def road(rng: np.random.Generator, count: int = 200) -> tuple[FloatArray, FloatArray]:
    """Arc length, unevenly sampled, and a smooth curvature of both signs."""
    s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 0.03, count - 1))])
    waves = [a * np.sin(k * s + p) for a, k, p in rng.uniform([0.5, 1, 0], [2, 4, 6], (3, 3))]
    return s, np.sum(waves, axis=0)


def within(
    s: FloatArray, kappa: FloatArray, v: FloatArray, limits: Limits, tol: float = 1e-6
) -> None:
    """Judge by plain differences: nothing of the profile's own formulas."""
    h, x = np.diff(s), v**2
    a = np.diff(x) / (2 * h)
    assert v.max() <= limits.speed_mps * (1 + tol)
    assert a.max() <= limits.acceleration_mps2 * (1 + tol)
    assert a.min() >= -limits.deceleration_mps2 * (1 + tol)
    assert (np.abs(kappa) * v).max() <= limits.turn_rate_radps * (1 + tol)
    assert (np.abs(kappa) * x).max() <= limits.lateral_acceleration_mps2 * (1 + tol)
    dt = 2 * h / (v[1:] + v[:-1])
    alpha = np.diff(kappa * v) / dt
    assert np.abs(alpha).max() <= limits.turn_acceleration_radps2 * (1.001 + tol)


@pytest.mark.parametrize("closed", [False, True])
def test_without_turn_acceleration_it_is_the_largest_of_all(
    rng: np.random.Generator, closed: bool
) -> None:
    s, kappa = road(rng)
    if closed:
        kappa[-1] = kappa[0]
    v = speed_profile(s, kappa, FREE_TURN, closed=closed)
    # Linear in x = v^2: the largest sum is the pointwise largest, as all bounds are upper ones.
    h, n = np.diff(s), len(s)
    rows = np.zeros((2 * (n - 1), n))
    for i in range(n - 1):
        rows[i, i : i + 2] = [-1, 1]
        rows[n - 1 + i, i : i + 2] = [1, -1]
    rates = np.concatenate([2 * h * LIMITS.acceleration_mps2, 2 * h * LIMITS.deceleration_mps2])
    top = np.minimum(
        LIMITS.speed_mps**2,
        np.minimum((LIMITS.turn_rate_radps / kappa) ** 2, np.abs(1.0 / kappa)),
    )
    ends = np.zeros((1, n))
    if closed:
        ends[0, 0], ends[0, -1] = 1, -1
    else:
        top[[0, -1]] = 0
    best = linprog(
        -np.ones(n),
        rows,
        rates,
        A_eq=ends if closed else None,
        b_eq=[0.0] if closed else None,
        bounds=np.column_stack([np.zeros(n), top]),
    )
    assert_allclose(v**2, best.x, atol=1e-7)


def test_with_turn_acceleration_it_is_the_fastest_up_to_a_little(rng: np.random.Generator) -> None:
    """Time is convex in x: minimised by linear programs in turn, each around the last answer."""
    s, kappa = road(rng, 120)
    limits = replace(LIMITS, turn_acceleration_radps2=0.8)
    v = speed_profile(s, kappa, limits)
    within(s, kappa, v, limits)
    assert travel_times(s, v)[-1] > 1.01 * travel_times(s, speed_profile(s, kappa, LIMITS))[-1]
    h, n = np.diff(s), len(s)
    rate, middle = np.diff(kappa) / h, (kappa[1:] + kappa[:-1]) / 2
    rows, bounds = [], []
    for i in range(n - 1):
        row = np.zeros((6, n))
        row[0, i : i + 2], row[1, i : i + 2] = [-1, 1], [1, -1]
        turning = np.array([-middle[i] + rate[i] * h[i], middle[i] + rate[i] * h[i]])
        row[2, i : i + 2], row[3, i : i + 2] = turning, -turning
        rows.append(row[:4])
        alpha = 2 * h[i] * limits.turn_acceleration_radps2
        bounds += [2 * h[i] * limits.acceleration_mps2, 2 * h[i] * limits.deceleration_mps2]
        bounds += [alpha, alpha]
    top = np.minimum(0.64, np.minimum((1.5 / kappa) ** 2, np.abs(1 / kappa)))
    top[[0, -1]] = 0
    x = np.maximum(v**2, 1e-3)
    for _ in range(6):
        best = linprog(
            -(x**-1.5), np.concatenate(rows), bounds, bounds=np.column_stack([0 * top, top])
        )
        x = np.maximum(0.5 * x + 0.5 * best.x, 1e-4)
    fastest = float(np.sum(2 * h / (np.sqrt(best.x[1:]) + np.sqrt(best.x[:-1]))))
    assert travel_times(s, v)[-1] <= 1.02 * fastest


@pytest.mark.parametrize("closed", [False, True])
def test_all_limits_hold(rng: np.random.Generator, closed: bool) -> None:
    for alpha in (0.3, 1.0, 4.0):
        limits = replace(LIMITS, turn_acceleration_radps2=alpha)
        s, kappa = road(rng, 150)
        if closed:
            kappa = 2 * np.sin(2 * np.pi * 3 * s / s[-1]) + 0.4
        v = speed_profile(s, kappa, limits, closed=closed)
        within(s, kappa, v, limits)
        assert (v[1:-1] > 0).all()
        assert closed == (v[0] > 0) == (v[-1] > 0)
        if closed:
            assert v[0] == pytest.approx(v[-1], rel=1e-9)
            turned = np.r_[kappa[60:-1], kappa[:61]]
            lengths = np.concatenate([[0.0], np.cumsum(np.r_[np.diff(s)[60:], np.diff(s)[:60]])])
            again = speed_profile(lengths, turned, limits, closed=True)
            assert_allclose(
                again, np.r_[v[60:-1], v[:61]], rtol=2e-2
            )  # where it starts is no matter


def test_a_straight_line_is_a_trapezoid() -> None:
    s = np.linspace(0, 4, 401)
    v = speed_profile(s, 0 * s, LIMITS)
    assert_allclose(v, np.sqrt(np.minimum(0.64, np.minimum(2 * 0.5 * s, 2 * 0.8 * (4 - s)))))
    times = travel_times(s, v)
    ramps = 0.8 / 0.5 + 0.8 / 0.8
    assert times[-1] == pytest.approx(ramps + (4 - 0.64 / 1.0 - 0.64 / 1.6) / 0.8, rel=1e-3)


def test_wishes_reverse_and_ends() -> None:
    s = np.linspace(0, 4, 101)
    wish = np.where(s > 2, 0.3, np.nan)
    v = speed_profile(s, 0 * s, LIMITS, wanted_mps=wish, start_mps=np.inf, end_mps=np.inf)
    assert v[0] == 0.8
    assert (v[s > 2] == 0.3).all()
    assert speed_profile(s, 0 * s, LIMITS, direction=-1).max() == LIMITS.reverse_mps
    assert speed_profile(s, 0 * s, LIMITS, wanted_mps=0.1).max() == 0.1
    late = speed_profile(s[:3], [0, 0, 0], LIMITS, start_mps=np.inf)
    assert late[0] == pytest.approx(np.sqrt(2 * 0.8 * s[2]))  # lowered: it must stop


@pytest.mark.parametrize(
    ("s", "kappa", "wish"),
    [([0, 0], [0, 0], None), ([0], [0], None), ([0, 1], [0], None), ([0, 1], [0, np.nan], None)]
    + [([0, 1], [0, 0], 0.0), ([0, 1], [0, 0], [1.0] * 3)],
)
def test_what_does_not_fit_is_refused(s: list[float], kappa: list[float], wish: object) -> None:
    with pytest.raises(InputError):
        speed_profile(s, kappa, LIMITS, wanted_mps=wish)  # type: ignore[arg-type]


@pytest.mark.parametrize("angle", [0.1, -1.0, 3.0])
def test_turns_on_the_spot_take_what_simulation_takes(angle: float) -> None:
    dt, omega, turned, t = 1e-4, 0.0, 0.0, 0.0
    while turned < abs(angle) - 1e-9 and t < 10:
        left = abs(angle) - turned
        brake = omega**2 / (2 * LIMITS.turn_acceleration_radps2) >= left
        step = LIMITS.turn_acceleration_radps2 * dt
        omega = max(omega - step, 1e-3) if brake else min(omega + step, LIMITS.turn_rate_radps)
        turned, t = turned + omega * dt, t + dt
    assert turn_time(angle, LIMITS) == pytest.approx(t, abs=0.03)
