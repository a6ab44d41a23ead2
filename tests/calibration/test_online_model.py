"""The sighting model of the recursive estimator, against the camera's own projection and against differences."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration.guidance_information import leg_information, velocity_weight
from airground.calibration.observability import relative_sigma
from airground.calibration.online_model import (
    ImageFrame,
    inverse_2x2,
    sighting,
    sighting_gradients,
    unproject,
)
from scenes import random_scene

if TYPE_CHECKING:
    from scenes import Array, Scene


def frame_of(scene: Scene, rng: np.random.Generator) -> tuple[ImageFrame, Array]:
    frame = ImageFrame(scene.pixels(rng), 1.0 / 300.0)
    return frame, frame.from_pixels(scene.g)


@pytest.mark.parametrize("trial", range(8))
def test_sightings_are_the_cameras(trial: int, rng: np.random.Generator) -> None:
    scene = random_scene(rng)
    frame, x = frame_of(scene, rng)
    origin = scene.unproject(frame.centre)
    xy = scene.ground(rng, (20,))
    seen = sighting(x, xy - origin) / frame.scale + frame.centre
    assert_allclose(seen, scene.project(xy), atol=1e-6)
    assert_allclose(unproject(x, frame.normalised(seen)), xy - origin, atol=1e-6 * scene.height)


@pytest.mark.parametrize("trial", range(4))
def test_gradients_are_differences(trial: int, rng: np.random.Generator) -> None:
    scene = random_scene(rng)
    frame, x = frame_of(scene, rng)
    P = scene.ground(rng, (10,)) - scene.unproject(frame.centre)
    c, by_g, by_point, nearer = sighting_gradients(x, P)
    assert (nearer > 0).all()
    assert_allclose(c, sighting(x, P), atol=1e-12)
    for k in range(6):
        h = 1e-6 * max(abs(x[k]), 1e-3)
        d = np.zeros(6)
        d[k] = h
        numeric = (sighting(x + d, P) - sighting(x - d, P)) / (2 * h)
        scale = np.abs(by_g[:, :, k]).max() + 1e-9
        assert_allclose(by_g[:, :, k] / scale, numeric / scale, atol=1e-5)
    for k in range(2):
        h = 1e-6 * scene.height
        step = np.zeros(2)
        step[k] = h
        numeric = (sighting(x, P + step) - sighting(x, P - step)) / (2 * h)
        assert_allclose(by_point[:, :, k], numeric, rtol=1e-5, atol=1e-6 / scene.height)


def test_behind_the_camera_and_beyond_the_horizon_is_nan(rng: np.random.Generator) -> None:
    scene = random_scene(rng, tilt_deg=(60.0, 70.0))
    frame = ImageFrame(np.asarray(scene.project(scene.ground(rng, (20,)).mean(axis=0))), 1 / 300)
    x = frame.from_pixels(scene.g)
    origin = scene.unproject(frame.centre)
    behind = 2 * scene.unproject(frame.centre) - scene.ground(rng, (1,)) * 0 - 1e3 * scene.height
    far = np.stack([behind[0], 2 * origin - behind[0]])
    ahead = scene.depth(far) > 0
    assert ahead.any()
    assert not ahead.all()
    assert np.isnan(sighting(x, far - origin)[~ahead]).all()
    horizon = np.cross(scene.g[:, 0], scene.g[:, 1])
    away = np.array(
        [
            frame.centre
            - 2 * (horizon @ [*frame.centre, 1.0]) * horizon[:2] / (horizon[:2] @ horizon[:2])
        ]
    )
    assert np.isnan(unproject(x, frame.normalised(away))).all()


def test_frames_keep_the_determinant(rng: np.random.Generator) -> None:
    scene = random_scene(rng)
    frame, x = frame_of(scene, rng)
    assert_allclose(frame.to_pixels(x), scene.g, rtol=1e-9, atol=1e-12)
    assert_allclose((frame.jacobian() @ x).reshape(3, 2), scene.g, rtol=1e-9, atol=1e-12)
    around = ImageFrame.around(scene.pixels(rng, (50,)))
    assert_allclose(around.to_pixels(around.from_pixels(scene.g)), scene.g, rtol=1e-8, atol=1e-12)


def test_inverses(rng: np.random.Generator) -> None:
    M = rng.normal(size=(7, 2, 2))
    assert_allclose(inverse_2x2(M) @ M, np.broadcast_to(np.eye(2), M.shape), atol=1e-9)


def test_information_of_a_leg_is_that_of_its_positions_eliminated(rng: np.random.Generator) -> None:
    """The recursion against one big least-squares problem, whose positions go by a Schur complement."""
    scene = random_scene(rng, tilt_deg=(20.0, 60.0))
    frame, x = frame_of(scene, rng)
    start = scene.unproject(scene.pixels(rng)) - scene.unproject(frame.centre)
    steps = 0.1 * scene.height * rng.normal(size=(3, 2))
    places, sigma, walk = 5, 0.01, 0.02 * scene.height**0.5
    told, _ = leg_information(x, start, steps, sigma=sigma, spacing_m=1e9, walk=walk, places=places)
    for step, information in zip(steps, told, strict=True):
        P = start + step * np.linspace(0, 1, places)[:, None]
        _, by_g, by_point, _ = sighting_gradients(x, P)
        rows = np.zeros((2 * places + 2 * (places - 1), 6 + 2 * places))
        for k in range(places):
            rows[2 * k : 2 * k + 2, :6] = by_g[k] / sigma
            rows[2 * k : 2 * k + 2, 6 + 2 * k : 8 + 2 * k] = by_point[k] / sigma
        s = walk * (np.linalg.norm(step) / (places - 1)) ** 0.5
        for k in range(places - 1):
            at = 2 * places + 2 * k
            rows[at : at + 2, 6 + 2 * k : 8 + 2 * k] = -np.eye(2) / s
            rows[at : at + 2, 8 + 2 * k : 10 + 2 * k] = np.eye(2) / s
        whole = rows.T @ rows
        schur = whole[:6, :6] - whole[:6, 6:] @ np.linalg.solve(whole[6:, 6:], whole[6:, :6])
        assert_allclose(information, schur, rtol=1e-6, atol=1e-8 * np.abs(schur).max())


def test_weights_give_the_stated_deviation(rng: np.random.Generator) -> None:
    scene = random_scene(rng)
    uv = scene.pixels(rng, (9,))
    root = rng.normal(size=(6, 6)) * np.abs(scene.g).ravel()[:, None] * 1e-3
    covariance = root @ root.T
    weight = velocity_weight(scene.g, uv).mean(axis=0)
    sigma = relative_sigma(scene.g, covariance, uv)
    assert_allclose(np.sqrt(np.trace(weight @ covariance)), sigma, rtol=1e-9)
