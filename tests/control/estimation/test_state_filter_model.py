"""The filter's steps against finite differences, fine integration, and the textbook's matrices."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import VelocityCommand
from airground.control.estimation.model import Gaussian, moved, place, propagate
from airground.control.estimation.options import StateOptions
from airground.control.estimation.readings import correct
from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.unicycle import arc

OPTIONS = StateOptions(lever_arm_m=(0.1, 0.04))
PIECES = [
    (0.013, VelocityCommand(0.4, -0.3)),
    (0.02, VelocityCommand(0.1, 0.9)),
    (0.03, VelocityCommand(0.5, 1.4)),
]
UNKNOWN: list[tuple[float, VelocityCommand | None]] = [(0.05, None)]


def belief(rng: np.random.Generator) -> Gaussian:
    A = rng.normal(0, 0.1, (8, 8))
    mean = (0.3, -0.2, 0.7, 0.25, 0.5, 0.1, -0.08, 0.05, 0.0)
    return Gaussian(mean, A @ A.T + 0.01 * np.eye(8))


@pytest.mark.parametrize("pieces", [PIECES, UNKNOWN], ids=["commands", "unknown"])
def test_the_covariance_moves_with_the_derivative_of_the_mean(
    rng: np.random.Generator, pieces: list[tuple[float, VelocityCommand | None]]
) -> None:
    one = belief(rng)
    other = Gaussian(one.mean, np.zeros((8, 8)))
    after = propagate(one, pieces, OPTIONS)
    noise = propagate(other, pieces, OPTIONS).covariance
    assert_allclose(noise, np.diag(np.diag(noise)))
    assert (np.diag(noise) > 0).all()
    assert after.mean == moved(one.mean, pieces, OPTIONS)
    h, columns = 1e-6, []
    for k in range(8):
        ends = [
            moved(tuple(x + s * h * (i == k) for i, x in enumerate(one.mean)), pieces, OPTIONS)
            for s in (1, -1)
        ]
        columns.append((np.array(ends[0][:8]) - ends[1][:8]) / (2 * h))
    F = np.column_stack(columns)
    # The chord's shortening by the turn, of second order, is left out of the derivative.
    assert_allclose(after.covariance - noise, F @ one.covariance @ F.T, atol=2e-5)


def test_the_mean_moves_as_a_finely_integrated_vehicle(rng: np.random.Generator) -> None:
    one = belief(rng)
    x, y, theta, v, w, a, b, *_ = one.mean
    xy = np.array([x, y])
    for duration, command in PIECES:
        for _ in range(1000):
            h = duration / 1000
            xy = xy + arc(theta, v, w, h)
            theta += w * h
            v += h / OPTIONS.speed_lag_s * ((1 + a) * command.v - v)
            w += h / OPTIONS.turn_lag_s * ((1 + b) * command.omega - w)
    after = moved(one.mean, PIECES, OPTIONS)
    assert_allclose(after[:5], [*xy, theta, v, w], atol=3e-5)


def test_a_vehicle_without_lag_does_at_once_what_it_is_told(rng: np.random.Generator) -> None:
    options = replace(OPTIONS, speed_lag_s=0.0, turn_lag_s=0.0)
    one = belief(rng)
    after = moved(one.mean, PIECES, options)
    assert_allclose(after[3:5], [0.5 * 1.1, 1.4 * 0.92], rtol=2e-3)
    turn = sum(dt * command.omega for dt, command in PIECES) * 0.92
    assert_allclose(after[2], 0.7 + turn, rtol=1e-9)
    assert np.isfinite(propagate(one, PIECES, options).covariance).all()


def textbook(
    one: Gaussian, H: FloatArray, residual: FloatArray, R: FloatArray
) -> tuple[FloatArray, FloatArray]:
    P = one.covariance
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    I_KH = np.eye(8) - K @ H
    return np.array(one.mean[:8]) + K @ residual, I_KH @ P @ I_KH.T + K @ R @ K.T  # Joseph's form


def test_a_sighting_corrects_as_the_textbook_says(rng: np.random.Generator) -> None:
    one, R = belief(rng), np.array([[4e-3, 1e-3], [1e-3, 2e-3]])

    def mark(mean: FloatArray) -> FloatArray:
        c, s = np.cos(mean[2]), np.sin(mean[2])
        forward, left = OPTIONS.lever_arm_m
        arm = np.array([forward * c - left * s, forward * s + left * c])
        return np.asarray(mean[:2] + arm)

    mean = np.array(one.mean[:8])
    H = np.column_stack([(mark(mean + 1e-6 * e) - mark(mean - 1e-6 * e)) / 2e-6 for e in np.eye(8)])
    seen = np.array([0.5, 0.1])
    residual = seen - mark(mean)
    distance, after = place(one, (0.5, 0.1), (R[0, 0], R[0, 1], R[1, 1]), OPTIONS)
    wanted_mean, wanted = textbook(one, H, residual, R)
    assert_allclose(after.mean[:8], wanted_mean, rtol=1e-6)
    assert_allclose(after.covariance, wanted, atol=1e-8)
    S = H @ one.covariance @ H.T + R
    assert distance == pytest.approx(np.sqrt(residual @ np.linalg.solve(S, residual)), rel=1e-6)


@pytest.mark.parametrize(
    "read",
    [(0.9, 0.3, 0.4), (inf, 0.3, inf), (0.6, inf, 0.7), (0.8 + 6 * pi, 0.2, inf)],
    ids=["all", "speed", "heading and turn", "wrapped"],
)
def test_readings_correct_as_the_textbook_says(
    rng: np.random.Generator, read: tuple[float, float, float]
) -> None:
    one = belief(rng)
    mean = np.array(one.mean[:8])

    def expected(mean: FloatArray) -> FloatArray:
        return np.array([mean[2] + mean[7], mean[3] / (1 + mean[5]), mean[4] / (1 + mean[6])])

    used = [k for k in range(3) if read[k] < inf]
    H = np.column_stack(
        [(expected(mean + 1e-6 * e) - expected(mean - 1e-6 * e)) / 2e-6 for e in np.eye(8)]
    )[used]
    residual = np.array(read)[used] - expected(mean)[used]
    if 0 in used:
        residual[0] = np.angle(np.exp(1j * residual[0]))
    v, w = (max(abs(value), abs(e)) for value, e in zip(read[1:], expected(mean)[1:], strict=True))
    R = np.diag([0.05**2, 0.01**2 + (0.1 * v) ** 2, 0.03**2 + (0.1 * w) ** 2])
    after, refused = correct(one, read, OPTIONS)
    assert refused == 0
    wanted_mean, wanted = textbook(one, H, residual, R[np.ix_(used, used)])
    assert_allclose(after.mean[:8], wanted_mean, rtol=1e-6)
    assert_allclose(after.covariance, wanted, atol=1e-8)


def test_a_reading_pulls_the_less_the_further_off_it_is(rng: np.random.Generator) -> None:
    one = Gaussian(belief(rng).mean, 1e-3 * np.eye(8))
    shifts = []
    for speed in (0.25, 0.3, 0.6, 1.2, 4.0):
        after, doubted = correct(one, (0.8, speed, 0.6), OPTIONS)
        shifts.append(after.mean[3] - one.mean[3])
        assert doubted == (speed > 0.5)
        alone, _ = correct(one, (0.8, inf, 0.6), OPTIONS)
        if speed > 0.5:  # the others count as ever
            assert_allclose(after.mean[2], alone.mean[2])
            assert_allclose(after.mean[4], alone.mean[4])
    assert 0 < shifts[-1] < shifts[-2] < shifts[-3]
    assert 0 < shifts[0] < shifts[1]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"sighting_sigma_px": 0.0}, "sighting_sigma_px must be positive"),
        ({"speed_lag_s": -0.1}, "speed_lag_s must be 0 or more"),
        ({"window_s": float("nan")}, "window_s"),
        ({"jump_after": inf}, "jump_after"),
        ({"time_offset_s": inf}, "time_offset_s"),
        ({"lever_arm_m": (0.1, float("nan"))}, "lever_arm_m"),
        ({"lever_arm_m": (0.1,)}, "lever_arm_m"),
        ({"start_sigma_rad": 0.7}, "start_sigma_rad must be below lost_rad"),
    ],
)
def test_options_are_checked(wrong: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        StateOptions(**wrong)  # type: ignore[arg-type]
