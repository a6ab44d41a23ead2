"""The full homography: unit determinant, and the origin that velocities cannot see."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from airground import LimitedHomography
from airground.geometry import Collineation, unit_determinant
from scenes import Scene, generators, scenes

exponents = st.floats(-60.0, 60.0)
signs = st.sampled_from([1.0, -1.0])


def by_entry_size(actual: NDArray[Any], desired: NDArray[Any]) -> None:
    """Compare matrices whose rows have different units, row by row; at nadir the last is nought."""
    rows = np.abs(desired).max(axis=-1, keepdims=True)
    unit = np.maximum(rows, 1e-4 * rows.max())
    assert_allclose(actual / unit, desired / unit, rtol=0, atol=1e-9)


@given(scenes(square=False), exponents, signs)
def test_unit_determinant_for_any_scale_and_sign(
    scene: Scene, exponent: float, sign: float
) -> None:
    scaled = unit_determinant(sign * 10.0**exponent * scene.G)
    assert_allclose(np.linalg.det(scaled), 1.0, rtol=1e-9)
    by_entry_size(scaled, scene.G1)  # one real scale, so the same matrix from all


@given(scenes(square=False), exponents, signs)
def test_g_does_not_depend_on_the_scale_of_the_homography(
    scene: Scene, exponent: float, sign: float
) -> None:
    g = LimitedHomography.from_homography(sign * 10.0**exponent * scene.G).g
    by_entry_size(g, scene.g)


@given(scenes(square=False), generators())
def test_moving_the_ground_origin_leaves_g_alone(scene: Scene, rng: np.random.Generator) -> None:
    shift = np.eye(3)
    shift[:2, 2] = scene.height * rng.normal(size=2)
    by_entry_size(LimitedHomography.from_homography(scene.G @ shift).g, scene.g)


@given(scenes(square=False), generators())
def test_choosing_the_origin_gives_the_true_homography(
    scene: Scene, rng: np.random.Generator
) -> None:
    xy0 = scene.ground(rng)
    shift = np.eye(3)
    shift[:2, 2] = xy0  # the true G, its ground moved so that xy0 is (0, 0)
    truth = scene.G1 @ shift
    model = LimitedHomography.from_homography(scene.G)
    origin_uv = scene.project(xy0)
    G = model.image_from_ground(origin_uv)
    assert_allclose(np.linalg.det(G), 1.0, rtol=1e-9)
    assert np.array_equal(G[:, :2], model.g)
    by_entry_size(G, truth)
    by_entry_size(model.ground_from_image(origin_uv), np.linalg.inv(truth))
    by_entry_size(LimitedHomography.from_homography(G).g, model.g)  # and back


@given(scenes(square=False), generators())
def test_collineation_is_the_projection(scene: Scene, rng: np.random.Generator) -> None:
    image_from_ground = Collineation(scene.G)
    xy = scene.ground(rng, (20,))
    uv = scene.project(xy)
    assert_allclose(image_from_ground.apply(xy), uv, atol=1e-8 * max(scene.image_size))
    back = image_from_ground.inverse().apply(uv)
    depth = np.linalg.norm(scene.rays(xy), axis=-1, keepdims=True)
    assert_allclose((back - xy) / depth, np.zeros_like(xy), atol=1e-8)


@given(scenes(), generators())
def test_collineations_compose_and_cancel(scene: Scene, rng: np.random.Generator) -> None:
    turn = np.array([[0.6, -0.8, 3.0], [0.8, 0.6, -5.0], [0.0, 0.0, 1.0]])
    image_from_ground, ground_from_map = Collineation(scene.G), Collineation(-7 * turn)
    xy = scene.ground(rng, (5,))
    on_map = ground_from_map.inverse().apply(xy)
    image_from_map = image_from_ground @ ground_from_map
    assert_allclose(
        image_from_map.apply(on_map), scene.project(xy), atol=1e-7 * max(scene.image_size)
    )
    nothing = image_from_ground.inverse() @ image_from_ground
    by_entry_size(nothing.matrix, np.eye(3))


@given(scenes(), generators())
def test_collineation_jacobian_is_the_derivative(scene: Scene, rng: np.random.Generator) -> None:
    xy = scene.ground(rng, (5,))
    columns = [scene.push(xy, np.broadcast_to(axis, xy.shape)) for axis in np.eye(2)]
    want = np.stack(columns, axis=-1)
    unit = np.linalg.norm(want, axis=(-2, -1), keepdims=True)
    J = Collineation(scene.G).jacobian(xy)
    assert_allclose(J / unit, want / unit, rtol=0, atol=1e-9)


@given(scenes(), generators())
def test_collineation_jacobian_and_eq_15_agree(scene: Scene, rng: np.random.Generator) -> None:
    xy = scene.ground(rng, (5,))
    model = LimitedHomography.from_homography(scene.G)
    want = model.jacobian(scene.project(xy))
    unit = np.linalg.norm(want, axis=(-2, -1), keepdims=True)
    assert_allclose(Collineation(scene.G).jacobian(xy) / unit, want / unit, rtol=0, atol=1e-9)
