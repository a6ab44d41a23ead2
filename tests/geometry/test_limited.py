"""Edges of the limited homography, and OpenCV's opinion."""

from __future__ import annotations

import dataclasses
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground import LimitedHomography
from airground.errors import InputError
from scenes import random_scene

G_LEVEL = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
"""Its horizon is the line v = 0, exactly."""


def test_g_is_our_own_copy() -> None:
    given = np.array([[60.0, 5.0], [-4.0, 50.0], [0.001, 0.02]])
    model = LimitedHomography(given)
    given[0, 0] = 99.0
    assert model.g[0, 0] == 60.0
    with pytest.raises(ValueError, match="read-only"):
        model.g[0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.g = given  # type: ignore[misc]


def test_the_homography_given_is_left_alone() -> None:
    given = np.diag([2.0, 3.0, -1.0])
    LimitedHomography.from_homography(given)
    assert np.array_equal(given, np.diag([2.0, 3.0, -1.0]))


def test_g_is_taken_as_it_is() -> None:
    """Its scale is the metric: the constructor must not touch it."""
    given = np.array([[3.0, 0.0], [0.0, 3.0], [0.0, 0.1]])
    assert np.array_equal(LimitedHomography(given).g, given)


@pytest.mark.parametrize("shape", [(), (6,), (2, 3), (3, 3), (1, 3, 2)])
def test_wrong_shapes(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=r"g must have shape \(3, 2\)") as caught:
        LimitedHomography(np.ones(shape))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_finite(bad: float) -> None:
    with pytest.raises(InputError, match="g has NaN or infinite entries"):
        LimitedHomography(np.array([[1.0, 0.0], [0.0, bad], [0.0, 0.0]]))


@pytest.mark.parametrize(
    "g",
    [
        np.zeros((3, 2)),
        np.array([[1.0, 2.0], [3.0, 6.0], [0.1, 0.2]]),
        np.array([[1.0, 0.0], [3.0, 0.0], [0.1, 0.0]]),
        np.outer([-900.3, 17.7, 1e-3], [0.7, -0.1]),  # parallel up to rounding
    ],
)
def test_parallel_columns(g: np.ndarray) -> None:
    with pytest.raises(InputError, match="parallel") as caught:
        LimitedHomography(g)
    assert "\n" not in str(caught.value)


def test_a_camera_that_looks_straight_down_has_a_third_row_of_nought() -> None:
    model = LimitedHomography(np.array([[50.0, 0.0], [0.0, -50.0], [0.0, 0.0]]))
    assert_allclose(model.image_velocity([3.0, 4.0], [1.0, 0.0]), [-125000.0, 0.0])


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), np.ones((3, 3)), np.ones((3, 2)), "text"])
def test_from_homography_refuses(matrix: Any) -> None:
    with pytest.raises(InputError) as caught:
        LimitedHomography.from_homography(matrix)
    assert "\n" not in str(caught.value)


def test_repr_reads_back() -> None:
    model = LimitedHomography(np.array([[60.0, 5.5], [-4.0, 50.0], [0.001, 0.02]]))
    again = eval(repr(model), {"LimitedHomography": _from_list})
    assert_allclose(again.g, model.g)


def _from_list(rows: list[list[float]]) -> LimitedHomography:
    return LimitedHomography(np.array(rows))


def test_on_the_horizon() -> None:
    model = LimitedHomography(G_LEVEL)
    assert model.nearness([7.0, 0.0]) == 0
    assert model.image_velocity([7.0, 0.0], [3.0, 4.0]).tolist() == [0.0, 0.0]
    assert np.isnan(model.ground_velocity([7.0, 0.0], [3.0, 4.0])).all()
    assert not model.same_side([7.0, 0.0], [7.0, 5.0])
    assert np.isnan(model.ground_position([7.0, 0.0], [7.0, 5.0])).all()
    assert model.pixels_per_metre([7.0, 0.0]).tolist() == [0.0, 0.0]


def test_a_ground_point_on_the_horizon_has_no_side() -> None:
    assert not LimitedHomography(G_LEVEL).same_side([7.0, 5.0], [7.0, 0.0])


@pytest.mark.parametrize("method", ["image_from_ground", "ground_from_image"])
def test_an_origin_on_the_horizon_is_refused(method: str) -> None:
    with pytest.raises(InputError, match="origin_uv lies on the horizon; choose") as caught:
        getattr(LimitedHomography(G_LEVEL), method)((7.0, 0.0))
    assert "\n" not in str(caught.value)


def test_an_origin_on_the_horizon_but_for_rounding_is_refused(rng: np.random.Generator) -> None:
    for _ in range(50):
        model = LimitedHomography.from_homography(random_scene(rng, tilt_deg=(30, 75)).G)
        u, v, w = model.vanishing_point(rng.normal(size=2))
        with pytest.raises(InputError, match="horizon"):
            model.image_from_ground((u / w, v / w))


@pytest.mark.parametrize("origin", [(1.0,), (1.0, 2.0, 3.0), [(1.0, 2.0)], (np.nan, 1.0), None])
def test_an_origin_is_one_known_point(origin: Any) -> None:
    with pytest.raises(InputError, match="origin_uv"):
        LimitedHomography(G_LEVEL).image_from_ground(origin)


def test_unknown_points_stay_unknown() -> None:
    model = LimitedHomography(G_LEVEL)
    nowhere = [[np.nan, 1.0], [2.0, 3.0]]
    assert np.isnan(model.ground_position(nowhere, (1.0, 5.0))).any(axis=1).tolist() == [
        True,
        False,
    ]
    assert np.isnan(model.image_velocity(nowhere, [1.0, 0.0])).any(axis=1).tolist() == [True, False]
    assert model.same_side(nowhere, (1.0, 5.0)).tolist() == [False, True]


@pytest.mark.parametrize(
    ("method", "args"),
    [
        ("image_velocity", ([1.0, 2.0, 3.0], [1.0, 2.0])),
        ("image_velocity", ([1.0, 2.0], [1.0])),
        ("ground_velocity", ([1.0, 2.0], 5.0)),
        ("jacobian", ([1.0],)),
        ("nearness", (3.0,)),
        ("vanishing_point", ([1.0, 2.0, 0.0],)),
        ("ground_position", ([1.0, 2.0, 1.0], [1.0, 5.0])),
        ("image_position", ([1.0, 2.0, 1.0], [1.0, 5.0])),
    ],
)
def test_points_with_other_than_two_coordinates(method: str, args: tuple[Any, ...]) -> None:
    with pytest.raises(InputError, match="two entries on its last axis"):
        getattr(LimitedHomography(G_LEVEL), method)(*args)


def test_positions_are_opencvs(rng: np.random.Generator) -> None:
    """cv2.projectPoints knows nothing of planes: rotation vector, translation, K."""
    for _ in range(20):
        scene = random_scene(rng)
        xy = scene.ground(rng, (30,))
        origin = xy[0]
        world = np.concatenate([xy, np.ones((30, 1))], axis=1) @ scene.world_from_ground.T
        R = scene.camera_from_world
        seen, _ = cv2.projectPoints(
            world, cv2.Rodrigues(R)[0], -R @ scene.centre, scene.K, np.zeros(5)
        )
        uv = seen[:, 0, :]
        model = LimitedHomography.from_homography(scene.G)
        atol = 1e-6 * max(scene.image_size)
        assert_allclose(model.image_position(xy - origin, uv[0]), uv, rtol=0, atol=atol)
        ground = cv2.perspectiveTransform(uv[None], model.ground_from_image(uv[0]))[0]
        far = np.linalg.norm(scene.rays(xy), axis=-1).max()
        assert_allclose(ground, xy - origin, rtol=0, atol=1e-8 * far)


def test_g_of_opencvs_homography_from_points(rng: np.random.Generator) -> None:
    for _ in range(20):
        scene = random_scene(rng)
        corner = np.array([[0.1, 0.1], [0.9, 0.15], [0.85, 0.9], [0.12, 0.8]])
        middle = np.array(scene.principal_point)
        uv = middle + (corner - 0.5) * 100
        xy = scene.unproject(uv)
        # Single precision inside: about 1e-5.
        G = cv2.getPerspectiveTransform(xy.astype(np.float32), uv.astype(np.float32))
        got = LimitedHomography.from_homography(G).image_velocity(middle, np.eye(2))
        want = scene.push(scene.unproject(np.broadcast_to(middle, (2, 2))), np.eye(2))
        assert_allclose(got, want, atol=1e-3 * np.abs(want).max())


@pytest.mark.parametrize("factor", [1e100, 1e-100])
def test_g_in_impossible_units(factor: float) -> None:
    g = factor * np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 1e-3]])
    with pytest.raises(InputError, match="check the units"):
        LimitedHomography(g)
