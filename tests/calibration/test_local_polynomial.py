"""Sliding parabolas against NumPy's own least squares."""

from __future__ import annotations

import numpy as np
import pytest

from airground.calibration.local_polynomial import noise_level, windows


@pytest.mark.parametrize("count", [2, 3, 4, 5, 8, 21])
def test_fit_is_least_squares(count: int, rng: np.random.Generator) -> None:
    t = 1e5 + np.cumsum(rng.uniform(0.02, 0.05, 60))  # uneven, far from zero
    y = 1e4 + rng.normal(size=(60, 2)) * 50
    first = np.array([0, 7, 60 - count])
    w = windows(t, first, count)
    at = w.centre + rng.uniform(-0.02, 0.02, 3)
    position, velocity = w.fit(t, y, at)
    degree = 2 if count >= 5 else 1
    for k, start in enumerate(first):
        rows = slice(start, start + count)
        for axis in (0, 1):
            oracle = np.polynomial.Polynomial.fit(t[rows] - at[k], y[rows, axis], degree)
            assert position[k, axis] == pytest.approx(oracle(0.0), rel=1e-10)
            assert velocity[k, axis] == pytest.approx(oracle.deriv()(0.0), rel=1e-7, abs=1e-6)


def test_velocity_gain_is_the_spread_of_the_fit(rng: np.random.Generator) -> None:
    t = np.cumsum(rng.uniform(0.02, 0.05, 9))
    w = windows(t, np.array([0]), 9)
    at = t[1:2]
    noisy = [w.fit(t, rng.normal(size=(9, 2)), at)[1][0] for _ in range(4000)]
    assert w.velocity_gain(at)[0] == pytest.approx(
        np.std(noisy), rel=0.05
    )  # 8000 draws: 0.8 % deviation


def test_noise_level_is_the_noise_put_in(rng: np.random.Generator) -> None:
    t = np.arange(0, 40, 0.05)
    smooth = np.column_stack([300 * np.sin(t / 3), 200 * np.cos(t / 4)])
    assert noise_level(smooth) < 0.01
    assert noise_level(smooth + rng.normal(0, 0.5, smooth.shape)) == pytest.approx(0.5, rel=0.15)


def test_noise_level_of_a_target_that_stands_and_moves_in_whole_pixels(
    rng: np.random.Generator,
) -> None:
    moving = np.round(np.column_stack([np.arange(300) * 3.3, np.arange(300) * 1.7]))
    standing = np.tile(moving[-1], (3000, 1))
    # Rounding has a deviation of 0.29 px; three differences of it are not white, hence the wide bounds.
    assert 0.15 < noise_level(np.concatenate([moving, standing])) < 0.5


def test_too_few_points_show_no_noise() -> None:
    assert np.isnan(noise_level(np.zeros((7, 2))))


def test_rows_covered() -> None:
    w = windows(np.arange(20.0), np.array([0, 2, 12]), 4)
    assert w.rows_covered(20) == 6 + 4
