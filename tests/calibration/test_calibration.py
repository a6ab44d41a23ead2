"""The calibration's own velocities and their covariance."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from airground.calibration import Calibration, calibrate
from airground.errors import InputError
from airground.geometry import LimitedHomography
from drives import fit_drive, read, see
from scenes import Scene, scene

T = np.arange(0, 60, 1 / 30)


def make(here: Scene) -> Calibration:
    drive = fit_drive(here)
    return calibrate(see(here, drive, T), read(drive, np.arange(-1, 61, 0.05)), time_offset_s=0.0)


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return make(scene(tilt_deg=50))


def test_covariance_of_velocities_against_samples_of_g(
    calibration: Calibration, rng: np.random.Generator
) -> None:
    uv, uv_dot = calibration.origin_px + [40.0, 30.0], np.array([50.0, -20.0])
    _, covariance = calibration.ground_velocity(uv, uv_dot)
    root = np.linalg.cholesky(calibration.covariance + 1e-18 * np.eye(6))
    drawn = calibration.model.g + (0.1 * rng.normal(size=(20000, 6)) @ root.T).reshape(-1, 3, 2)
    sampled = np.array([LimitedHomography(g).ground_velocity(uv, uv_dot) for g in drawn])
    np.testing.assert_allclose(
        np.cov(sampled.T), 0.01 * covariance, rtol=0.05, atol=1e-4 * np.abs(covariance).max()
    )


@pytest.mark.parametrize("shape", [(), (1,), (3, 1, 2, 1)])
def test_leading_axes_broadcast(
    calibration: Calibration, shape: tuple[int, ...], rng: np.random.Generator
) -> None:
    uv = calibration.origin_px + rng.uniform(-20, 20, (*shape, 2))
    uv_dot = rng.uniform(-20, 20, 2)
    xy_dot, covariance = calibration.ground_velocity(uv, uv_dot)
    assert xy_dot.shape == (*shape, 2)
    assert covariance.shape == (*shape, 2, 2)
    one, one_covariance = calibration.ground_velocity(uv.reshape(-1, 2)[0], uv_dot)
    np.testing.assert_allclose(xy_dot.reshape(-1, 2)[0], one, rtol=1e-12)
    np.testing.assert_allclose(covariance.reshape(-1, 2, 2)[0], one_covariance, rtol=1e-9)
    many, _ = calibration.ground_velocity(uv.reshape(-1, 2)[0], np.broadcast_to(uv_dot, (4, 2)))
    assert many.shape == (4, 2)


def test_nothing_is_said_beyond_the_horizon(calibration: Calibration) -> None:
    n = calibration.model.horizon
    foot = -n[2] * n[:2] / (n[:2] @ n[:2])
    beyond = foot + 0.1 * (foot - calibration.origin_px)
    xy_dot, covariance = calibration.ground_velocity(beyond, [1.0, 1.0])
    assert np.isnan(xy_dot).all()
    assert np.isnan(covariance).all()
    assert not calibration.is_ground(beyond)
    assert calibration.is_ground(calibration.origin_px)


def test_arrays_are_our_own_copies(calibration: Calibration) -> None:
    given = np.array(calibration.covariance)
    mine = dataclasses.replace(calibration, covariance=given)
    given[:] = 0
    assert (mine.covariance == calibration.covariance).all()
    with pytest.raises(ValueError, match="read-only"):
        mine.covariance[0, 0] = 1.0


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("covariance", np.eye(5)),
        ("covariance", np.triu(np.ones((6, 6)))),
        ("covariance", np.full((6, 6), np.nan)),
        ("origin_px", [1.0, 2.0, 3.0]),
        ("image_size_px", (0, 720)),
    ],
)
def test_nonsense_is_refused(calibration: Calibration, field: str, value: object) -> None:
    with pytest.raises(InputError):
        dataclasses.replace(calibration, **{field: value})  # type: ignore[arg-type]
