"""The rate of J along a motion, against the acceleration of a projected point."""

from __future__ import annotations

import numpy as np
from hypothesis import given

from airground import LimitedHomography
from scenes import Scene, generators, scenes


@given(scenes(square=False), generators())
def test_accelerations_in_the_image_are_those_of_the_projection(
    scene: Scene, rng: np.random.Generator
) -> None:
    model = LimitedHomography.from_homography(scene.G)
    xy, w, a = scene.ground(rng), scene.velocities(rng), scene.velocities(rng)
    uv, uv_dot = scene.project(xy), scene.push(xy, w)
    # Second derivative of the projection of xy + w t + a t^2 / 2, by central differences of its exact first derivative.
    dt = 1e-5 * float(scene.depth(xy)) / float(np.linalg.norm([w, a]))
    ahead = scene.push(xy + w * dt + a * dt**2 / 2, w + a * dt)
    behind = scene.push(xy - w * dt + a * dt**2 / 2, w - a * dt)
    want = (ahead - behind) / (2 * dt)
    found = model.jacobian(uv) @ a + model.jacobian_rate(uv, uv_dot) @ w
    size = np.linalg.norm(model.jacobian(uv) @ a) + np.linalg.norm(want)
    assert np.linalg.norm(found - want) < 1e-6 * size
