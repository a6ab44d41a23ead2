"""One API for one point and for many: leading axes broadcast, as a plain loop would have it."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from airground import LimitedHomography
from airground.geometry import Collineation, n_error, unit_determinant
from airground.geometry import velocity as v
from airground.geometry.arrays import homogeneous, points
from scenes import Array, random_scene

if TYPE_CHECKING:
    from collections.abc import Callable

SHAPES = [(), (1,), (3, 1, 2, 1), (0,)]

# Pairs that broadcast, the second not always the smaller.
PAIRS = [
    ((), ()),
    ((), (1,)),
    ((1,), ()),
    ((3, 1, 2, 1), (3, 1, 2, 1)),
    ((3, 1, 2, 1), ()),
    ((), (3, 1, 2, 1)),
    ((3, 1, 2, 1), (1,)),
    ((2, 4), (3, 1, 2, 1)),
    ((3, 1), (4,)),
]


def loop(
    function: Callable[..., NDArray[Any]], args: list[Array], cores: list[int]
) -> NDArray[Any]:
    """Call for one element at a time; `cores` are the numbers of axes that belong to an element."""
    lead = np.broadcast_shapes(
        *(a.shape[: a.ndim - core] for a, core in zip(args, cores, strict=True))
    )
    full = [
        np.broadcast_to(a, lead + a.shape[a.ndim - core :])
        for a, core in zip(args, cores, strict=True)
    ]
    rows = [np.asarray(function(*(a[k] for a in full))) for k in np.ndindex(*lead)]
    return np.array(rows).reshape(lead + rows[0].shape)


def same(function: Callable[..., NDArray[Any]], args: list[Array], cores: list[int]) -> None:
    got, want = np.asarray(function(*args)), loop(function, args, cores)
    assert got.shape == want.shape
    assert got.dtype == want.dtype
    assert_allclose(got, want, rtol=1e-12, atol=1e-12 * float(np.abs(want).max()))


@pytest.fixture
def model(rng: np.random.Generator) -> LimitedHomography:
    return LimitedHomography.from_homography(random_scene(rng, tilt_deg=(40.0, 60.0)).G)


def some(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    return rng.uniform(0.0, 900.0, (*shape, 2))


ONE_POINT: list[Callable[[LimitedHomography], Callable[..., Array]]] = [
    lambda m: m.jacobian,
    lambda m: m.pixels_per_metre,
    lambda m: m.nearness,
    lambda m: m.vanishing_point,
    lambda m: Collineation(m.image_from_ground((400.0, 300.0))).apply,
    lambda m: Collineation(m.image_from_ground((400.0, 300.0))).jacobian,
    lambda _: homogeneous,
]


@pytest.mark.parametrize("shape", SHAPES[:3])
@pytest.mark.parametrize("which", range(len(ONE_POINT)))
def test_one_argument(
    which: int, shape: tuple[int, ...], model: LimitedHomography, rng: np.random.Generator
) -> None:
    same(ONE_POINT[which](model), [some(rng, shape)], [1])


@pytest.mark.parametrize("shape", SHAPES[:3])
def test_positions_with_one_origin(
    shape: tuple[int, ...], model: LimitedHomography, rng: np.random.Generator
) -> None:
    origin = (640.0, 700.0)
    uv = some(rng, shape)
    same(lambda p: np.nan_to_num(model.ground_position(p, origin), nan=1e9), [uv], [1])
    same(lambda p: np.nan_to_num(model.image_position(p, origin), nan=1e9), [uv - 450.0], [1])


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("name", ["image_velocity", "ground_velocity"])
def test_velocities(
    name: str,
    pair: tuple[tuple[int, ...], tuple[int, ...]],
    model: LimitedHomography,
    rng: np.random.Generator,
) -> None:
    same(getattr(model, name), [some(rng, pair[0]), some(rng, pair[1])], [1, 1])


@pytest.mark.parametrize("pair", PAIRS)
def test_same_side(
    pair: tuple[tuple[int, ...], tuple[int, ...]],
    model: LimitedHomography,
    rng: np.random.Generator,
) -> None:
    # Points on both sides of the horizon, so that the answer is not all True.
    vp = model.vanishing_point([1.0, 0.0])
    middle = vp[:2] / vp[2]
    uv = [middle + rng.normal(size=(*shape, 2)) * 3000 for shape in pair]
    same(model.same_side, uv, [1, 1])


@pytest.mark.parametrize("shapes", list(product(SHAPES[:3], repeat=2)))
@pytest.mark.parametrize("name", ["nearness", "velocity_jacobian"])
def test_batches_of_g_with_points(
    name: str, shapes: tuple[tuple[int, ...], tuple[int, ...]], rng: np.random.Generator
) -> None:
    g = rng.normal(size=(*shapes[0], 3, 2)) * [[50.0], [50.0], [0.05]]
    same(getattr(v, name), [g, some(rng, shapes[1])], [2, 1])


@pytest.mark.parametrize("shapes", [*product(SHAPES[:3], repeat=3), ((3, 1), (4,), (2, 1, 1))])
@pytest.mark.parametrize("name", ["image_velocity", "ground_velocity", "image_velocity_gradient"])
def test_batches_of_g_with_points_and_velocities(
    name: str, shapes: tuple[tuple[int, ...], ...], rng: np.random.Generator
) -> None:
    g = rng.normal(size=(*shapes[0], 3, 2)) * [[50.0], [50.0], [0.05]]
    same(getattr(v, name), [g, some(rng, shapes[1]), some(rng, shapes[2])], [2, 1, 1])


@pytest.mark.parametrize("shape", SHAPES[:3])
def test_batches_of_g(shape: tuple[int, ...], rng: np.random.Generator) -> None:
    same(v.horizon_line, [rng.normal(size=(*shape, 3, 2))], [2])
    same(unit_determinant, [rng.normal(size=(*shape, 3, 3))], [2])


@pytest.mark.parametrize("pair", PAIRS)
def test_n_error_of_batches(
    pair: tuple[tuple[int, ...], tuple[int, ...]], rng: np.random.Generator
) -> None:
    same(n_error, [rng.normal(size=(*shape, 3, 2)) for shape in pair], [2, 2])


def test_no_points_are_no_error(model: LimitedHomography) -> None:
    none = np.empty((0, 2))
    assert model.image_velocity(none, none).shape == (0, 2)
    assert model.ground_velocity(none, none).shape == (0, 2)
    assert model.jacobian(none).shape == (0, 2, 2)
    assert model.pixels_per_metre(none).shape == (0, 2)
    assert model.nearness(none).shape == (0,)
    assert model.same_side(none, (1.0, 2.0)).shape == (0,)
    assert model.vanishing_point(none).shape == (0, 3)
    assert model.ground_position(none, (600.0, 700.0)).shape == (0, 2)
    assert v.image_velocity_gradient(model.g, none, none).shape == (0, 2, 6)
    assert unit_determinant(np.empty((0, 3, 3))).shape == (0, 3, 3)


def test_lists_and_integers_are_as_good_as_arrays(model: LimitedHomography) -> None:
    assert_allclose(
        model.image_velocity([3, 4], [[1, 0], [0, 1]]),
        model.image_velocity(np.array([3.0, 4.0]), np.eye(2)),
    )
    assert points([1, 2], "uv").dtype == np.float64


def test_inputs_are_not_written_to(model: LimitedHomography, rng: np.random.Generator) -> None:
    uv, xy_dot = some(rng, (4,)), some(rng, (4,))
    before = uv.copy(), xy_dot.copy()
    for array in (uv, xy_dot):
        array.flags.writeable = False
    model.image_velocity(uv, xy_dot)
    model.ground_velocity(uv, xy_dot)
    model.ground_position(uv, uv[0])
    v.image_velocity_gradient(model.g, uv, xy_dot)
    assert np.array_equal(before[0], uv)
    assert np.array_equal(before[1], xy_dot)
