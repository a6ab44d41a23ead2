"""The Cramer-Rao bound against an estimator that reaches it, written here and with another model of the camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.geometry import n_error
from airground.sim import SegmentDrive
from airground.studies.bound import drive_bound
from airground.studies.paper_camera import camera_at
from airground.studies.simulation import PAPER


def project(x: np.ndarray) -> np.ndarray:
    """All end points, by a full homography G of eight unknowns: no g, no origin."""
    G = np.append(x[:8], 1.0).reshape(3, 3)
    xy = np.vstack([[0.0, 0.0], np.cumsum(x[8:].reshape(8, 2), axis=0)])
    w = np.column_stack([xy, np.ones(9)]) @ G.T
    return np.asarray(w[:, :2] / w[:, 2:])


def test_least_squares_over_the_whole_drive_reaches_the_bound() -> None:
    drive = SegmentDrive()
    camera = PAPER.camera()
    small = 1e-3  # of the paper's noise, so that everything is linear
    sigma_px, sigma_m = small * 5 / np.sqrt(3), small * 0.012 * drive.duration_s / np.sqrt(3)
    G = camera.image_from_ground
    truth = np.concatenate([(G / G[2, 2]).ravel()[:8], np.diff(drive.corners, axis=0).ravel()])
    assert_allclose(project(truth), camera.project(drive.corners), atol=1e-9)

    def residual(x: np.ndarray, uv: np.ndarray, steps: np.ndarray) -> np.ndarray:
        return np.concatenate([(project(x) - uv).ravel() / sigma_px, (x[8:] - steps) / sigma_m])

    rng = np.random.default_rng(0)
    scale = np.abs(truth) + 1e-6
    n = []
    for _ in range(400):
        uv = project(truth) + rng.normal(0, sigma_px, (9, 2))
        steps = truth[8:] + rng.normal(0, sigma_m, 16)
        x = truth.copy()
        for _ in range(3):
            J = np.column_stack(
                [
                    (residual(x + h, uv, steps) - residual(x - h, uv, steps)) / (2e-6 * scale[k])
                    for k, h in enumerate(np.diag(1e-6 * scale))
                ]
            )
            x = x - np.linalg.lstsq(J * scale, residual(x, uv, steps), rcond=None)[0] * scale
        M = np.append(x[:8], 1.0).reshape(3, 3)
        n.append(n_error(camera.g, M[:, :2] / np.cbrt(np.linalg.det(M))))
    rms = float(np.sqrt(np.mean(np.square(n))))
    bound = drive_bound(replace(PAPER, pixel_bound_px=5 * small, speed_bound=0.1 * small)).n_rms
    assert rms == pytest.approx(bound, rel=0.08)


def test_the_papers_bound() -> None:
    bound = drive_bound()
    assert bound.n_rms == pytest.approx(0.0620, abs=5e-4)
    assert_allclose(bound.covariance, bound.covariance.T, rtol=1e-9)
    assert (np.linalg.eigvalsh(bound.covariance[:4, :4]) > 0).all()


def test_the_bound_is_proportional_to_the_noise() -> None:
    half = drive_bound(replace(PAPER, pixel_bound_px=2.5, speed_bound=0.05))
    assert half.n_rms == pytest.approx(drive_bound().n_rms / 2, rel=1e-6)


def test_the_origin_says_nothing_about_g() -> None:
    """The start's image point is a nuisance of its own, so a camera that is only moved gives the same kind of bound."""
    bound = drive_bound(replace(PAPER, shift_px=(60.0, 0.0)))
    assert_allclose(bound.g, camera_at(np.array([10.0, 10.0])).g, rtol=1e-9)
    assert 0.05 < bound.n_rms < 0.08
