"""The quick uncertainty of a calibration against the calibration's own, and against chance."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration.lens_uncertainty import raw_relative_sigma
from airground.control import Floor
from airground.control.safety.calibration_sigma import CalibrationSigma
from airground.errors import InputError
from airground.geometry import LimitedHomography, velocity
from airground.geometry.arrays import FloatArray
from airground.sim import demo_world

G = LimitedHomography(demo_world().camera.g)
FLOOR = Floor(G, np.array([640.0, 400.0]))
UV = np.array([[640.0, 400.0], [10.0, 700.0], [1270.0, 20.0], [300.0, -60.0], [-500.0, 2000.0]])


def some_covariance(rng: np.random.Generator) -> FloatArray:
    spread = 0.01 * np.abs(G.g).ravel() * rng.normal(size=(6, 6))
    return np.asarray(spread.T @ spread)


def test_it_is_that_of_the_calibration(rng: np.random.Generator) -> None:
    covariance = some_covariance(rng)
    quick = CalibrationSigma(FLOOR, covariance)
    slow = raw_relative_sigma(G.g, covariance, None, None, uv=UV)
    assert_allclose([quick.at(u, v) for u, v in UV], slow, rtol=1e-8)


def test_it_is_the_spread_of_ground_velocities(rng: np.random.Generator) -> None:
    covariance = some_covariance(rng) * 0.01
    uv, count = UV[1], 4000
    g = rng.multivariate_normal(G.g.ravel(), covariance, count).reshape(-1, 3, 2)
    angle = rng.uniform(0, 2 * np.pi, count)
    w = np.column_stack([np.cos(angle), np.sin(angle)])
    off = velocity.ground_velocity(g, uv, G.image_velocity(uv, w)) - w
    spread = np.sqrt(np.mean(np.sum(off**2, axis=1)))
    # A root mean square of 4000 has 1 to 2 %; four of those.
    assert CalibrationSigma(FLOOR, covariance).at(*uv) == pytest.approx(spread, rel=0.07)


def test_it_is_exact_without_uncertainty_and_nothing_on_the_horizon() -> None:
    exact = CalibrationSigma(FLOOR, np.zeros((6, 6)))
    assert exact.at(100.0, 200.0) == 0.0
    assert np.isnan(exact.at(np.nan, 3.0))
    n = G.horizon
    near = CalibrationSigma(FLOOR, np.diag(G.g.ravel() ** 2) * 1e-4)
    assert near.at(0.0, -n[2] / n[1]) > 1e6
    assert near.at(640.0, 0.0) > near.at(640.0, 700.0)  # towards the horizon


def test_what_is_no_covariance_is_refused() -> None:
    lopsided = np.eye(6)
    lopsided[0, 1] = 0.5
    for wrong, word in (
        (lopsided, "symmetric"),
        (np.eye(6) - 0.5, "eigenvalue"),
        (np.full((6, 6), np.nan), "NaN"),
        (np.eye(5), "shape"),
    ):
        with pytest.raises(InputError, match=word):
            CalibrationSigma(FLOOR, wrong)
