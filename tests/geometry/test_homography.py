"""Edges of plane collineations, and OpenCV's opinion."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.geometry import Collineation, unit_determinant
from scenes import random_scene


def test_apply_is_opencvs_perspective_transform(rng: np.random.Generator) -> None:
    for _ in range(20):
        scene = random_scene(rng, square=False)
        xy = scene.ground(rng, (50,))
        want = cv2.perspectiveTransform(xy[None], scene.G)[0]
        assert_allclose(Collineation(scene.G).apply(xy), want, atol=1e-8 * max(scene.image_size))


def test_the_matrix_has_determinant_one_and_is_our_own() -> None:
    given = np.diag([2.0, 2.0, -2.0])
    map_from_plan = Collineation(given)
    given[0, 0] = 99.0
    assert_allclose(map_from_plan.matrix, np.diag([-1.0, -1.0, 1.0]))
    with pytest.raises(ValueError, match="read-only"):
        map_from_plan.matrix[0, 0] = 1.0


SINGULAR: dict[str, Any] = {
    "nought": np.zeros((3, 3)),
    "a zero row": [[1, 0, 0], [0, 1, 0], [0, 0, 0]],
    "a zero column": [[1, 0, 5], [0, 0, 3], [0, 0, 1]],
    "parallel columns": [[1, 2, 5], [3, 6, 3], [0.1, 0.2, 1]],
    "equal rows": [[1, 2, 3], [1, 2, 3], [0, 0, 1]],
    "pixels and metres": np.outer([900.0, 500.0, 1.0], [1.0, 2.0, 1e3]) + np.diag([1e-12, 0, 0]),
}


@pytest.mark.parametrize("name", SINGULAR)
def test_a_singular_homography_is_refused(name: str) -> None:
    for build in (unit_determinant, Collineation):
        with pytest.raises(InputError, match="singular") as caught:
            build(np.array(SINGULAR[name], dtype=np.float64))
        assert "\n" not in str(caught.value)


def test_one_singular_homography_in_a_batch_is_refused() -> None:
    with pytest.raises(InputError, match="singular"):
        unit_determinant(np.stack([np.eye(3), np.zeros((3, 3))]))


def test_a_camera_in_the_ground_plane_is_refused(rng: np.random.Generator) -> None:
    scene = random_scene(rng)
    flat = scene.G.copy()
    flat[:, 2] = flat[:, :2] @ [3.0, -2.0]  # the origin of the ground seen edge on
    with pytest.raises(InputError, match="singular: the camera's centre lies in the ground plane"):
        unit_determinant(flat)


@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (3, 2), (3, 3, 2)])
def test_wrong_shapes(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=r"a homography has shape \(\.\.\., 3, 3\)"):
        unit_determinant(np.ones(shape))
    with pytest.raises(InputError, match=r"matrix must have shape \(3, 3\)"):
        Collineation(np.ones(shape))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_not_finite(bad: float) -> None:
    matrix = np.eye(3)
    matrix[1, 1] = bad
    with pytest.raises(InputError, match="NaN or infinite"):
        unit_determinant(matrix)
    with pytest.raises(InputError, match="matrix has NaN or infinite entries"):
        Collineation(matrix)


def test_not_numbers() -> None:
    with pytest.raises(InputError, match="a homography must be an array of numbers"):
        unit_determinant([["a"] * 3] * 3)


def test_points_that_go_to_infinity_are_nan() -> None:
    flip = Collineation(np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]))  # (1/x, y/x)
    mapped = flip.apply([[0.0, 5.0], [2.0, 4.0]])
    assert np.isnan(mapped[0]).all()
    assert_allclose(mapped[1], [0.5, 2.0])
    assert np.isnan(flip.jacobian([0.0, 5.0])).all()


def test_unknown_points_stay_unknown() -> None:
    assert np.isnan(Collineation(np.eye(3)).apply([np.nan, 1.0])).any()


def test_very_large_and_small_scales() -> None:
    for scale in (1e-100, 1e100, -1e100):
        assert_allclose(unit_determinant(scale * np.eye(3)), np.eye(3))
