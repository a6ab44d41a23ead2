"""The eight numbers: derivatives against differences, rules for covariances against samples moved by hand."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.vision.moving import small_motion as sm
from vision.moving.flight import camera, project

UV = np.array([[10.0, 20.0], [600.0, 300.0], [333.0, 111.0]])


def a_pair() -> tuple[np.ndarray, np.ndarray]:
    a = camera((900, 900), turn=0.4, tilt=0.3) @ np.linalg.inv(camera((950, 880), tilt=0.2))
    b = camera((800, 930), turn=-0.2, tilt=0.1) @ np.linalg.inv(camera((900, 900), tilt=0.3))
    return a, b


def test_difference_undoes_move(rng: np.random.Generator) -> None:
    H, _ = a_pair()
    delta = rng.normal(0, 1e-3, 8)
    assert_allclose(sm.difference(H, -7 * sm.move(H, delta)), delta, atol=1e-12)


def test_moved_by_is_the_derivative() -> None:
    step = 1e-7
    H = np.eye(3)
    for k in range(8):
        delta = step * np.eye(8)[k]
        numeric = (project(sm.move(H, delta), UV) - project(sm.move(H, -delta), UV)) / (2 * step)
        assert_allclose(sm.moved_by(UV)[..., k], numeric, rtol=1e-6, atol=1e-4)


def test_jacobian_is_the_derivative() -> None:
    H, _ = a_pair()
    for k in range(2):
        d = 1e-4 * np.eye(2)[k]
        numeric = (project(H, UV + d) - project(H, UV - d)) / 2e-4
        assert_allclose(sm.homography_jacobian(H, UV)[..., k], numeric, rtol=1e-6)


def test_points_of_a_homography_deviate_as_its_covariance_says(rng: np.random.Generator) -> None:
    H, _ = a_pair()
    root = rng.normal(0, 1e-4, (8, 8))
    moved = np.array([project(sm.move(H, root @ rng.normal(size=8)), UV) for _ in range(4000)])
    stated = sm.deviation(H, root @ root.T, UV)
    for k in range(len(UV)):
        assert_allclose(np.cov(moved[:, k].T), stated[k], rtol=0.1, atol=0.02 * stated[k].max())


@pytest.mark.parametrize("what", ["inverse", "product"])
def test_covariances_of_inverse_and_product(what: str, rng: np.random.Generator) -> None:
    A, B = a_pair()
    a, b = (1e-5 * rng.normal(size=(8, 8)) for _ in range(2))
    deltas = []
    for _ in range(2000):
        A_, B_ = sm.move(A, a @ rng.normal(size=8)), sm.move(B, b @ rng.normal(size=8))
        if what == "inverse":
            back, back_ = sm.relative(A, np.eye(3)), sm.relative(A_, np.eye(3))
            deltas.append(sm.difference(back, back_))
        else:
            deltas.append(sm.difference(A @ B, A_ @ B_))
    stated = sm.compose_covariance(a @ a.T, b @ b.T, B)
    if what == "inverse":
        stated = sm.invert_covariance(A, a @ a.T)
    root = np.linalg.inv(np.linalg.cholesky(stated))
    white = np.array(deltas) @ root.T
    assert_allclose(np.cov(white.T), np.eye(8), atol=0.2)
