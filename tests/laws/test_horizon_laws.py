"""The horizon, the vanishing points on it, and the side of it where the ground is."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from numpy.testing import assert_allclose

from airground import LimitedHomography
from scenes import Scene, generators, scenes


def model_of(scene: Scene) -> LimitedHomography:
    return LimitedHomography.from_homography(scene.G)


@given(scenes(square=False))
def test_horizon_is_the_third_row_of_the_inverse_homography(scene: Scene) -> None:
    H3 = np.linalg.inv(scene.G1)[2]  # eq. 14 at unit determinant
    # In units in which the image is 1000 px wide, so that the three entries have like sizes.
    unit = np.array([1e3, 1e3, 1.0]) / np.linalg.norm(H3 * [1e3, 1e3, 1.0])
    assert_allclose(model_of(scene).horizon * unit, H3 * unit, rtol=0, atol=1e-10)


@given(scenes(min_tilt_deg=10.0), generators())
def test_horizon_is_where_level_rays_meet_the_image(scene: Scene, rng: np.random.Generator) -> None:
    # A ray that leaves the camera horizontally, within 60 degrees of its heading.
    angle = scene.heading + rng.uniform(-math.pi / 3, math.pi / 3)
    level = scene.K @ scene.camera_from_world @ [math.cos(angle), math.sin(angle), 0.0]
    n = model_of(scene).horizon
    assert abs(n @ level) < 1e-10 * float(np.linalg.norm(n * level))


@given(scenes(square=False), generators())
def test_vanishing_points_lie_on_the_horizon(scene: Scene, rng: np.random.Generator) -> None:
    model = model_of(scene)
    vp = model.vanishing_point(scene.velocities(rng, (20,)))
    terms = vp * model.horizon
    assert_allclose(terms.sum(-1) / np.abs(terms).max(-1).clip(1e-300), 0, atol=1e-9)


@given(scenes(), generators())
def test_vanishing_point_is_the_limit_of_far_points(scene: Scene, rng: np.random.Generator) -> None:
    xy, xy_dot = scene.ground(rng), scene.velocities(rng)
    heading = xy_dot / np.linalg.norm(xy_dot)
    vp = np.linalg.solve(scene.K, model_of(scene).vanishing_point(xy_dot))
    near = float(np.linalg.norm(scene.rays(xy)))
    for far in (1e2 * near, 1e4 * near, 1e6 * near):
        ray = scene.rays(xy + far * heading)
        sine = np.linalg.norm(np.cross(ray, vp)) / np.linalg.norm(ray) / np.linalg.norm(vp)
        assert sine <= near / (far - near) + 1e-9  # triangle: camera, near point, far point


@given(scenes(), generators())
def test_vanishing_point_of_motion_ahead_is_where_pixels_head_for(
    scene: Scene, rng: np.random.Generator
) -> None:
    model, xy, xy_dot = model_of(scene), scene.ground(rng), scene.velocities(rng)
    uv, uv_dot = scene.project(xy), scene.push(xy, xy_dot)
    u, v, w = model.vanishing_point(xy_dot)
    toward = np.array([u - uv[0] * w, v - uv[1] * w])  # (vp - uv) times w
    across = uv_dot[0] * toward[1] - uv_dot[1] * toward[0]
    assert abs(across) < 1e-9 * np.linalg.norm(uv_dot) * np.linalg.norm(toward)


@given(scenes(square=False), generators())
def test_nearness_over_visible_ground_tells_handedness(
    scene: Scene, rng: np.random.Generator
) -> None:
    sign = np.sign(model_of(scene).nearness(scene.pixels(rng, (50,))))
    assert (sign == (-1.0 if scene.handedness == "right" else 1.0)).all()


@given(scenes(min_tilt_deg=30.0), generators())
def test_beyond_the_horizon_the_nearness_changes_sign(
    scene: Scene, rng: np.random.Generator
) -> None:
    model, ground = model_of(scene), scene.pixels(rng, (20,))
    # Rays up by 1 to 20 degrees, not further than 80 degrees from the optical axis.
    up = rng.uniform(np.radians(1), np.radians(20), 20)
    angle = scene.heading + rng.uniform(-0.3, 0.3, 20)
    rays = np.stack([np.cos(up) * np.cos(angle), np.cos(up) * np.sin(angle), np.sin(up)], axis=-1)
    p = rays @ scene.camera_from_world.T
    ahead = p[:, 2] > 0.05
    p = p[ahead] @ scene.K.T
    sky = p[:, :2] / p[:, 2:]
    assert model.same_side(ground, ground[0]).all()
    assert not model.same_side(sky, ground[0]).any()
    assert (np.sign(model.nearness(sky)) == -np.sign(model.nearness(ground[0]))).all()


@given(scenes(max_tilt_deg=0.0))
def test_at_nadir_the_horizon_is_the_line_at_infinity(scene: Scene) -> None:
    n = model_of(scene).horizon
    reach = np.abs(n[:2]) * max(scene.image_size)
    assert (reach < 1e-12 * abs(n[2])).all()
