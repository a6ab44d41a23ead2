"""The laws of estimation.md for displacements of any length: no derivative, no approximation."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from numpy.testing import assert_allclose

from airground import LimitedHomography
from scenes import Array, Scene, generators, scenes


def homogeneous(uv: Array) -> Array:
    return np.concatenate([uv, np.ones((*uv.shape[:-1], 1))], axis=-1)


@given(scenes(square=False), generators())
def test_chords_pass_through_the_vanishing_point_of_their_displacement(
    scene: Scene, rng: np.random.Generator
) -> None:
    g = LimitedHomography.from_homography(scene.G).g
    xy_i, xy_j = scene.ground(rng, (20,)), scene.ground(rng, (20,))
    c_i, c_j = homogeneous(scene.project(xy_i)), homogeneous(scene.project(xy_j))
    chord, goal = np.cross(c_i, c_j), (xy_j - xy_i) @ g.T
    unit = np.linalg.norm(chord, axis=-1) * np.linalg.norm(goal, axis=-1)
    residual = np.sum(chord * goal, axis=-1) / unit
    assert_allclose(residual, 0, atol=1e-10)
    # The same with the displacement turned by a radian is not zero: the test can fail.
    turn = np.array([[np.cos(1), -np.sin(1)], [np.sin(1), np.cos(1)]])
    turned = np.sum(chord * ((xy_j - xy_i) @ turn.T @ g.T), axis=-1) / unit
    assert np.abs(turned).max() > 1e-8


@given(scenes(square=False), generators())
def test_a_finite_move_adds_g_d_to_the_scaled_image_point(
    scene: Scene, rng: np.random.Generator
) -> None:
    model = LimitedHomography.from_homography(scene.G)
    xy_i, xy_j = scene.ground(rng, (20,)), scene.ground(rng, (20,))
    uv_i, uv_j = scene.project(xy_i), scene.project(xy_j)
    predicted = (
        homogeneous(uv_i) / model.nearness(uv_i)[:, None] + (xy_j - xy_i) @ model.g.T
    )  # ~ c_j
    moved = predicted[:, :2] / predicted[:, 2:]
    assert_allclose(moved, uv_j, rtol=0, atol=1e-8 * max(scene.image_size))
    # And its scale is that of c_j / (n.c_j): depth adds up along the way.
    assert_allclose(predicted[:, 2], 1 / model.nearness(uv_j), rtol=1e-9)


@given(scenes(square=False), generators())
def test_nearness_is_the_inverse_of_the_depth(scene: Scene, rng: np.random.Generator) -> None:
    model, xy = LimitedHomography.from_homography(scene.G), scene.ground(rng, (20,))
    product = model.nearness(scene.project(xy)) * scene.depth(xy)
    assert_allclose(product, product[0], rtol=1e-9)
