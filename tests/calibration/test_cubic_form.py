"""Eq. 15 as a polynomial, against eq. 15 as it stands."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from numpy.testing import assert_allclose

from airground.calibration.cubic_form import (
    FEATURES,
    coefficient_gradient,
    coefficients,
    features,
)
from scenes import generators


def table(uv: np.ndarray, xy_dot: np.ndarray) -> np.ndarray:
    F = np.empty((FEATURES, len(uv)))
    F[:2] = xy_dot.T
    features(uv[:, 0], uv[:, 1], F)
    return F


@given(rng=generators())
def test_features_times_coefficients_are_the_image_velocity(rng: np.random.Generator) -> None:
    g, uv, xy_dot = rng.normal(size=(4, 3, 2)), rng.normal(size=(7, 2)), rng.normal(size=(7, 2))
    got = coefficients(g.reshape(4, 6)).reshape(4, 2, FEATURES) @ table(uv, xy_dot)
    for each, matrix in zip(got, g, strict=True):
        n = np.cross(matrix[:, 0], matrix[:, 1])
        nc = uv @ n[:2] + n[2]
        way = xy_dot @ matrix.T
        want = nc * (way[:, :2] - uv * way[:, 2:]).T
        assert_allclose(each, want, atol=1e-12 * max(1, np.abs(g).max() ** 3))


@given(rng=generators())
def test_gradient_is_the_derivative(rng: np.random.Generator) -> None:
    g = rng.normal(size=(3, 6))
    step = 1e-6
    for entry in range(6):
        away = step * np.eye(6)[entry]
        numeric = (coefficients(g + away) - coefficients(g - away)) / (2 * step)
        assert_allclose(coefficient_gradient(g)[:, entry], numeric, atol=1e-7)


@given(rng=generators())
def test_coefficients_are_cubic(rng: np.random.Generator) -> None:
    g = rng.normal(size=(3, 6))
    assert_allclose(coefficients(-2 * g), -8 * coefficients(g), atol=1e-12)
    by_gradient = (g[:, None, :] @ coefficient_gradient(g))[:, 0]  # Euler
    assert_allclose(by_gradient, 3 * coefficients(g), atol=1e-12)
