"""Metric positions once an origin is chosen, and the turn of the ground frame."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground import LimitedHomography
from scenes import Scene, generators, scenes


def model_of(scene: Scene) -> LimitedHomography:
    return LimitedHomography.from_homography(scene.G)


def far(scene: Scene, *xy: np.ndarray) -> float:
    """The longest ray, as the unit of error on the ground."""
    return max(float(np.linalg.norm(scene.rays(p), axis=-1).max()) for p in xy)


@given(scenes(square=False), generators())
def test_ground_position_is_where_the_ray_meets_the_ground(
    scene: Scene, rng: np.random.Generator
) -> None:
    origin, uv = scene.pixels(rng), scene.pixels(rng, (20,))
    xy = model_of(scene).ground_position(uv, origin)
    want = scene.unproject(uv) - scene.unproject(origin)
    assert_allclose(xy, want, rtol=0, atol=1e-8 * far(scene, scene.unproject(uv)))


@given(scenes(square=False), generators())
def test_distances_on_the_ground_are_true_whatever_the_origin(
    scene: Scene, rng: np.random.Generator
) -> None:
    model, uv = model_of(scene), scene.pixels(rng, (8,))
    truth = scene.unproject(uv)
    want = np.linalg.norm(truth[:, None] - truth[None], axis=-1)
    for origin in scene.pixels(rng, (2,)):
        xy = model.ground_position(uv, origin)
        got = np.linalg.norm(xy[:, None] - xy[None], axis=-1)
        assert_allclose(got, want, rtol=0, atol=1e-8 * far(scene, truth))


@given(scenes(square=False), generators())
def test_image_position_undoes_ground_position(scene: Scene, rng: np.random.Generator) -> None:
    model, origin, uv = model_of(scene), scene.pixels(rng), scene.pixels(rng, (20,))
    back = model.image_position(model.ground_position(uv, origin), origin)
    assert_allclose(back, uv, rtol=0, atol=1e-7 * max(scene.image_size))


@given(scenes(square=False), generators())
def test_image_position_is_the_projection(scene: Scene, rng: np.random.Generator) -> None:
    xy0, xy = scene.ground(rng), scene.ground(rng, (20,))
    uv = model_of(scene).image_position(xy - xy0, scene.project(xy0))
    assert_allclose(uv, scene.project(xy), rtol=0, atol=1e-7 * max(scene.image_size))


@given(scenes(min_tilt_deg=20.0), generators())
def test_ground_behind_the_camera_has_no_image(scene: Scene, rng: np.random.Generator) -> None:
    xy0 = scene.ground(rng)
    # From the foot backwards, beyond where the optical axis' normal plane meets the ground.
    foot = -scene.world_from_ground[:2, 2] @ scene.world_from_ground[:2, :2]
    gaze = np.array([math.cos(scene.heading), math.sin(scene.heading)])
    gaze = gaze @ scene.world_from_ground[:2, :2]
    limit = scene.height / math.tan(scene.tilt)
    behind = foot - np.outer([1.1, 2.0, 50.0], gaze) * limit
    before = foot - np.outer([0.0, 0.5, 0.9], gaze) * limit
    assert (scene.depth(behind) < 0).all()
    assert (scene.depth(before) > 0).all()
    model, origin = model_of(scene), scene.project(xy0)
    assert np.isnan(model.image_position(behind - xy0, origin)).all()
    assert np.isfinite(model.image_position(before - xy0, origin)).all()


@given(scenes(min_tilt_deg=30.0), generators())
def test_pixels_beyond_the_horizon_are_no_ground(scene: Scene, rng: np.random.Generator) -> None:
    model, origin = model_of(scene), scene.pixels(rng)
    up = rng.uniform(np.radians(1), np.radians(20), 10)
    rays = np.stack(
        [np.cos(up) * np.cos(scene.heading), np.cos(up) * np.sin(scene.heading), np.sin(up)],
        axis=-1,
    )
    p = rays @ scene.camera_from_world.T @ scene.K.T
    sky = p[:, :2] / p[:, 2:]
    both = np.vstack([sky, scene.pixels(rng, (3,))])
    known = np.isfinite(model.ground_position(both, origin)).all(axis=-1)
    assert known.tolist() == [False] * 10 + [True] * 3


@given(scenes(), generators(), st.floats(-10.0, 10.0))
def test_rotated_turns_the_ground_and_not_the_image(
    scene: Scene, rng: np.random.Generator, angle: float
) -> None:
    model, turned = model_of(scene), model_of(scene).rotated(angle)
    uv, xy_dot = scene.pixels(rng, (10,)), scene.velocities(rng, (10,))
    # The same motion has its heading less by `angle` in the new frame.
    speed = np.linalg.norm(xy_dot, axis=-1)
    heading = np.arctan2(xy_dot[:, 1], xy_dot[:, 0]) - angle
    seen_there = np.stack([speed * np.cos(heading), speed * np.sin(heading)], axis=-1)
    want = model.image_velocity(uv, xy_dot)
    unit = np.linalg.norm(want, axis=-1, keepdims=True)
    assert_allclose(turned.image_velocity(uv, seen_there) / unit, want / unit, rtol=0, atol=1e-9)
    assert_allclose(turned.nearness(uv), model.nearness(uv), rtol=1e-9)
    back = turned.rotated(-angle).g
    assert_allclose(back, model.g, rtol=0, atol=1e-12 * np.abs(model.g).max())


@given(scenes(), st.floats(-3.0, 3.0))
def test_rotated_frame_has_its_x_axis_at_the_angle(scene: Scene, angle: float) -> None:
    model = model_of(scene)
    vp = model.rotated(angle).vanishing_point([1.0, 0.0])
    want = model.vanishing_point([math.cos(angle), math.sin(angle)])
    assert_allclose(vp, want, rtol=0, atol=1e-12 * np.abs(model.g).max())
