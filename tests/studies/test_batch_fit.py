"""Many whole drives at once are the whole drives one by one, and stand where the sum of squares is least."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration.trajectory.view import View, project
from airground.geometry import n_error
from airground.geometry.arrays import FloatArray
from airground.studies.batch_fit import Drives, fit_drives, start_positions
from airground.studies.simulation import PAPER, run_trials
from airground.studies.whole_drive import whole_drive_block, whole_drive_trial

NORMAL = View(np.zeros(2), 1.0, np.zeros(2))
SIGMA, SIGMA_M = 0.01, 0.03


def scene(rng: np.random.Generator, drives: int, noise: float) -> tuple[FloatArray, Drives]:
    """g (M, 3, 2) in normalised pixels, and noisy drives of 9 points in circles about the origin."""
    g = np.array([[1.0, 0.2], [-0.1, 0.9], [0.1, 0.2]]) + rng.normal(0, 0.05, (drives, 3, 2))
    angle = np.linspace(0, 6, 9)
    xy = np.column_stack([np.cos(angle), np.sin(angle)]) + rng.normal(0, 0.1, (drives, 9, 2))
    x = np.stack([project(NORMAL, one, 0.0, p) for one, p in zip(g, xy, strict=True)])
    x += noise * rng.normal(0, SIGMA, x.shape)
    moved = np.diff(xy, axis=1) + noise * rng.normal(0, SIGMA_M, (drives, 8, 2))
    return g, Drives(x, moved, np.full(drives, SIGMA), SIGMA_M)


def cost(drives: Drives, k: int, g: FloatArray, xy: FloatArray) -> float:
    """Sum of squares of one drive, by the calibrator's own projection."""
    seen = np.sum((drives.x[k] - project(NORMAL, g, 0.0, xy)) ** 2) / drives.sigma[k] ** 2
    return float(seen + np.sum((np.diff(xy, axis=0) - drives.moved[k]) ** 2) / drives.sigma_m**2)


def test_trials_at_once_are_trials_one_by_one() -> None:
    trials = run_trials(trials=12, seed=2)
    block = whole_drive_block(trials.samples, trials.g_hat, PAPER)
    for k, (samples, g) in enumerate(zip(trials.samples, trials.g_hat, strict=True)):
        single, uv_dot = whole_drive_trial(samples, g, PAPER)
        assert float(n_error(single, block.g_hat[k])) < 3e-4  # it stops a little earlier
        assert_allclose(block.uv_dot[k], uv_dot, atol=5e-3)


def test_without_noise_the_truth_is_found(rng: np.random.Generator) -> None:
    g, drives = scene(rng, 6, 0.0)
    fit = fit_drives(drives, g + rng.normal(0, 0.03, g.shape))
    assert_allclose(fit.g, g, atol=1e-5)
    assert_allclose(fit.cost, 0.0, atol=1e-6)


def test_the_sum_of_squares_is_least(rng: np.random.Generator) -> None:
    g, drives = scene(rng, 4, 1.0)
    fit = fit_drives(drives, g)
    h = 1e-4
    for k in range(4):
        least = cost(drives, k, fit.g[k], fit.xy[k])
        assert fit.cost[k] == pytest.approx(least, rel=1e-9)
        for of_g, unknown in ((True, fit.g[k]), (False, fit.xy[k])):
            for place in np.ndindex(unknown.shape):
                aside = []
                for sign in (-1, 1):
                    moved = unknown.copy()
                    moved[place] += sign * h
                    pair = (moved, fit.xy[k]) if of_g else (fit.g[k], moved)
                    aside.append(cost(drives, k, *pair))
                curvature = (aside[0] + aside[1] - 2 * least) / h**2
                slope = (aside[1] - aside[0]) / (2 * h)
                assert curvature > 0
                assert slope**2 / curvature < 1e-4  # of a unit of the cost


def test_no_drive_depends_on_the_others(rng: np.random.Generator) -> None:
    g, drives = scene(rng, 5, 1.0)
    together = fit_drives(drives, g)
    for k in range(5):
        alone = fit_drives(drives.take(np.array([k])), g[k : k + 1])
        assert_allclose(alone.g[0], together.g[k], rtol=1e-9)


def test_a_start_behind_the_camera_is_given_up(rng: np.random.Generator) -> None:
    g, drives = scene(rng, 3, 1.0)
    start = g.copy()
    start[1, 2] = (40.0, -30.0)  # the horizon passes between the points
    fit = fit_drives(drives, start)
    assert not fit.cost[1] < 1e3
    assert (fit.cost[[0, 2]] < 60).all()


def test_positions_start_where_the_sightings_are(rng: np.random.Generator) -> None:
    g, drives = scene(rng, 3, 0.0)
    xy = start_positions(drives, g)
    seen = np.stack([project(NORMAL, one, 0.0, p) for one, p in zip(g, xy, strict=True)])
    assert_allclose(seen, drives.x, atol=1e-9)
