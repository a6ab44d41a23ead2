"""Parts of the linear method."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground import MotionSamples
from airground.calibration.linear import linear_system, normalizer, null_vector, scale_by_speed
from airground.errors import UnobservableMotionError


def test_normalizer_brings_pixels_to_mean_nought_and_spread_one(rng: np.random.Generator) -> None:
    uv = rng.uniform(300, 900, (40, 2))
    T = normalizer(uv)
    moved = np.concatenate([uv, np.ones((40, 1))], axis=1) @ T.T
    assert_allclose(moved[:, :2].mean(axis=0), 0, atol=1e-12)
    assert_allclose((moved[:, :2] ** 2).mean(), 1)
    assert T[0, 0] == T[1, 1]  # a similarity: the two axes alike
    assert_allclose(moved[:, 2], 1)


@pytest.mark.parametrize("uv", [np.empty((0, 2)), np.ones((1, 2)), np.ones((4, 2))])
def test_normalizer_of_one_place_is_regular(uv: np.ndarray) -> None:
    assert np.linalg.matrix_rank(normalizer(uv), tol=0) == 3
    assert np.isfinite(normalizer(uv)).all()


@pytest.mark.parametrize("count", [1, 3, 5, 6, 7, 200])
def test_null_vector_is_the_svds(count: int, rng: np.random.Generator) -> None:
    A = rng.normal(size=(count, 6))
    g_hat, singular = null_vector(A)
    want = np.linalg.svd(A, compute_uv=False)
    assert singular.shape == (6,)
    assert_allclose(singular[: len(want)], want)
    assert_allclose(singular[len(want) :], 0)
    assert_allclose(np.linalg.norm(g_hat), 1)
    assert_allclose(np.linalg.norm(A @ g_hat.ravel()), singular[5], atol=1e-12)


def test_system_has_one_row_for_each_sample(rng: np.random.Generator) -> None:
    samples = MotionSamples(*rng.normal(size=(3, 9, 2)))
    A, _ = linear_system(samples)
    assert A.shape == (9, 6)


def test_scale_and_sign_come_from_the_image_velocities(rng: np.random.Generator) -> None:
    g = np.array([[60.0, 5.0], [-4.0, 50.0], [0.001, 0.02]])
    u, v = uv = rng.uniform(0, 500, (2, 9))
    xy_dot = rng.normal(size=(9, 2))
    n = np.cross(g[:, 0], g[:, 1])
    h = xy_dot @ g.T
    uv_dot = ((n[0] * u + n[1] * v + n[2]) * (h[:, :2].T - uv * h[:, 2])).T
    samples = MotionSamples(uv.T, uv_dot, xy_dot)
    for scale in (1.0, -1.0, 0.01, -250.0):
        assert_allclose(scale_by_speed(scale * g, samples), g, rtol=1e-9)


def test_an_image_that_stands_still_has_no_scale() -> None:
    samples = MotionSamples(np.ones((3, 2)), np.zeros((3, 2)), np.ones((3, 2)))
    with pytest.raises(UnobservableMotionError, match="do not follow") as caught:
        scale_by_speed(np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]), samples)
    assert "\n" not in str(caught.value)
