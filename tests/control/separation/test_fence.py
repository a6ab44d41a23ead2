"""Clearances on the ground against shapely, and polygons mapped by a pinhole camera."""

from __future__ import annotations

import numpy as np
import pytest
import shapely  # type: ignore[import-untyped]
from numpy.testing import assert_allclose

from airground.control import Floor
from airground.control.separation.fence import Fence
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import SimCamera, demo_world

CAMERA = demo_world().camera
ORIGIN = np.array([640.0, 400.0])
AREA = np.array([[100.0, 700.0], [1180.0, 700.0], [1000.0, 220.0], [280.0, 220.0]])
NOTCHED = np.array([[100, 700], [600, 400], [1180, 700], [1000, 220], [280, 220.0]])
BOX = np.array([[500.0, 350.0], [640.0, 350.0], [640.0, 450.0], [500.0, 450.0]])
LATER = np.array([[620.0, 300.0], [820.0, 280.0], [820.0, 420.0], [600.0, 380.0]])  # overlaps BOX


@pytest.fixture
def floor() -> Floor:
    return Floor(LimitedHomography(CAMERA.g), ORIGIN)


def ground(uv: np.ndarray) -> shapely.Polygon:
    return shapely.Polygon(CAMERA.unproject(uv) - CAMERA.unproject(ORIGIN))


def signed(shape: shapely.Geometry, xy: np.ndarray) -> np.ndarray:
    points = shapely.points(xy)
    distance = shapely.distance(shape.boundary, points)
    return np.asarray(np.where(shapely.contains(shape, points), distance, -distance))


@pytest.mark.parametrize("area", [AREA, AREA[::-1], NOTCHED])
def test_clearance_is_the_distance_that_shapely_finds(
    floor: Floor, area: np.ndarray, rng: np.random.Generator
) -> None:
    fence = Fence(floor, (area,), (BOX, LATER))
    xy = rng.uniform([-4, -3], [4, 5], (500, 2))
    outer = signed(ground(area), xy)
    obstacles = signed(ground(BOX).union(ground(LATER)), xy)
    want = np.minimum(outer, -obstacles)
    assert (want > 0).any()
    assert (want < 0).any()
    assert_allclose(fence.clearance(xy), want, atol=1e-9)
    assert_allclose(fence.clearance(xy.reshape(5, 100, 2)), want.reshape(5, 100), atol=1e-9)
    distance, clear = fence.look(xy)
    assert_allclose(clear, want, atol=1e-9)
    edges = shapely.linestrings(fence.edges)
    assert_allclose(
        distance[:50], shapely.distance(edges, shapely.points(xy[:50])[:, None]), atol=1e-9
    )
    assert (fence.inside(xy, 0.2) == (want >= 0.2)).all()
    assert (fence.inside_image(floor.pixel(xy), 0.2) == (want >= 0.2)).all()
    for point, clearance in zip(xy[:100], want[:100], strict=True):
        nearest = fence.boundary(*point)
        assert nearest is not None
        assert nearest.clearance_m == pytest.approx(clearance, abs=1e-9)


def test_the_normal_is_the_gradient_and_leads_from_the_boundary(
    floor: Floor, rng: np.random.Generator
) -> None:
    fence = Fence(floor, (AREA,), (BOX,))
    step = 1e-6
    for xy in rng.uniform([-3, -2], [3, 4], (50, 2)):
        near = fence.boundary(*xy)
        assert near is not None
        slope = [
            (fence.clearance(xy + step * e) - fence.clearance(xy - step * e)) / (2 * step)
            for e in np.eye(2)
        ]
        assert_allclose(near.normal, slope, atol=1e-5)
        assert_allclose(xy - near.clearance_m * np.array(near.normal), near.xy, atol=1e-9)
    corner = CAMERA.unproject((AREA[0] + AREA[1]) / 2) - CAMERA.unproject(ORIGIN)
    on = fence.boundary(*corner)
    assert on is not None
    assert on.kind == "fence"
    assert fence.clearance(np.array(on.xy) + 0.01 * np.array(on.normal)) == pytest.approx(0.01)


def test_straight_lines_in_the_image_are_the_boundary(floor: Floor) -> None:
    fence = Fence(floor, (AREA,))
    share = np.linspace(0, 1, 30)[:, None]
    side = AREA[1] + share * (AREA[2] - AREA[1])
    assert_allclose(fence.clearance(floor.position(side)), 0.0, atol=1e-9)


def test_two_areas_that_overlap_are_one(floor: Floor) -> None:
    left, right = AREA.copy(), AREA.copy()
    left[1:3, 0] = 700.0
    right[[0, 3], 0] = 600.0
    fence = Fence(floor, (left, right))
    middle = floor.position([650.0, 450.0])
    assert fence.clearance(middle) == pytest.approx(
        float(signed(ground(left).union(ground(right)), middle[None])[0])
    )
    assert fence.clearance(middle) > 0.5


def test_without_a_fence_the_visible_ground_is_left(floor: Floor) -> None:
    fence = Fence(floor)
    assert fence.inside_image([[640.0, 400.0], [640.0, -2000.0], [np.nan, 1.0]]).tolist() == [
        True,
        False,
        False,
    ]
    # the camera's foot is 3 m below it; visible is what is in front of the image plane's trace
    axis = CAMERA.unproject([640.0, 300.0]) - CAMERA.unproject([640.0, 600.0])
    axis /= np.hypot(*axis)
    near = fence.boundary(0.0, 0.0)
    assert near is not None
    assert near.kind == "view"
    back = np.array(near.xy) - 1e-6 * np.array(near.normal)
    assert np.isnan(floor.pixel(back)).all()
    assert np.isfinite(floor.pixel(np.array(near.xy) + 1e-6 * np.array(near.normal))).all()
    down = SimCamera.looking_down(
        focal_length_px=900.0, tilt_rad=0.0, height_m=3.0, image_size_px=(1280, 720)
    )
    everywhere = Fence(Floor(LimitedHomography(down.g), ORIGIN))
    assert everywhere.boundary(3.0, 4.0) is None
    assert everywhere.clearance([3.0, 4.0]) == np.inf


@pytest.mark.parametrize(
    ("ring", "match"),
    [
        (BOX[:2], "2 different corners"),
        (np.vstack([BOX[:2], BOX[:1]]), "2 different corners"),
        (BOX[[0, 2, 1, 3]], "crosses"),
        (np.array([[0.0, 0.0], [np.nan, 1.0], [2.0, 0.0]]), "NaN"),
        (np.array([[500.0, 300.0], [600.0, 300.0], [550.0, -900.0]]), "horizon"),
        (np.array([[500.0, 300.0], [600.0, 300.0], [700.0, 300.0]]), "crosses|area"),
        (np.zeros((0, 2)), "0 different corners"),
        (np.zeros((3, 3)), "shape"),
    ],
)
def test_bad_polygons_are_refused(floor: Floor, ring: np.ndarray, match: str) -> None:
    for kind in ("stay_inside", "keep_out"):
        with pytest.raises(InputError, match=rf"{kind}\[0\].*({match})"):
            Fence(floor, **{kind: (ring,)})


def test_a_closing_point_is_no_corner_and_arrays_are_copied(floor: Floor) -> None:
    ring = np.vstack([AREA, AREA[:1]])
    fence = Fence(floor, (ring,))
    ring[:] = 0.0
    assert_allclose(fence.stay_inside[0], AREA)


def test_obstacles_that_leave_nothing_are_refused(floor: Floor) -> None:
    with pytest.raises(InputError, match="covers all"):
        Fence(floor, (BOX,), (AREA,))


def test_nan_has_no_clearance(floor: Floor) -> None:
    fence = Fence(floor, (AREA,), (BOX,))
    assert np.isnan(fence.clearance([np.nan, 0.0]))
    near = fence.boundary(np.nan, 0.0)
    assert near is not None
    assert np.isnan(near.clearance_m)
    assert not fence.inside([np.nan, 0.0])
