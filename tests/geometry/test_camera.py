"""Edges of the camera that g describes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground import LimitedHomography
from airground.errors import InputError, UndeterminedCameraError
from scenes import scene

VIEW = scene(tilt_deg=40, roll_deg=10, height=12)


def model() -> LimitedHomography:
    return LimitedHomography.from_homography(VIEW.G)


def test_by_hand_a_camera_that_looks_along_x_and_down() -> None:
    """f = 1000 px, 45 degrees, 10 m, x ahead, y to the left."""
    half = math.sqrt(0.5)
    # right = (0, -1, 0), down = (-half, 0, -half), forward = (half, 0, -half), camera at (0, 0, 10)
    G = np.diag([1000.0, 1000.0, 1.0]) @ [[0, -1, 0], [-half, 0, 10 * half], [half, 0, 10 * half]]
    camera = LimitedHomography.from_homography(G).camera((0.0, 0.0))
    assert_allclose(camera.focal_length_px, 1000)
    assert_allclose(camera.tilt_deg, 45)
    assert_allclose(camera.roll_deg, 0, atol=1e-9)
    assert_allclose(camera.height_m, 10)
    assert camera.handedness == "right"
    assert_allclose(camera.camera_from_ground[2], [half, 0, -half], atol=1e-12)


@pytest.mark.parametrize("roll", [-170.0, -90.0, -1.0, 1.0, 90.0, 180.0])
def test_roll_is_the_turn_of_up_from_minus_v_towards_u(roll: float) -> None:
    view = scene(tilt_deg=30, roll_deg=roll)
    found = LimitedHomography.from_homography(view.G).camera(view.principal_point)
    # A pole on the ground, seen where the optical axis meets it.
    xy = view.unproject(view.principal_point)
    top = view.world_from_ground @ [*xy, 1.0] + np.array([0.0, 0.0, 0.01])
    seen = view.K @ view.camera_from_world @ (top - view.centre)
    up = seen[:2] / seen[2] - view.principal_point
    assert_allclose(
        math.remainder(found.roll_rad - math.atan2(up[0], -up[1]), math.tau), 0, atol=1e-9
    )


def test_principal_point_is_our_own_copy() -> None:
    given = np.array(VIEW.principal_point)
    camera = model().camera(given)
    given[0] = -1.0
    assert camera.principal_point_px[0] == VIEW.principal_point[0]
    for array in (camera.principal_point_px, camera.camera_from_ground):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize("focal_length", [0.0, -900.0, np.nan, np.inf, 1e300, 1e-300])
def test_a_focal_length_is_positive(focal_length: float) -> None:
    with pytest.raises(InputError, match="focal_length must be positive") as caught:
        model().camera(VIEW.principal_point, focal_length=focal_length)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("point", [(1.0,), (1.0, 2.0, 3.0), (np.nan, 1.0), None, "middle"])
def test_wrong_points(point: Any) -> None:
    with pytest.raises(InputError, match="principal_point"):
        model().camera(point)
    if point is not None:
        with pytest.raises(InputError, match="ground_uv"):
            model().camera(VIEW.principal_point, ground_uv=point)


def test_a_point_on_the_horizon_is_not_ground() -> None:
    level = LimitedHomography(np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]))
    with pytest.raises(InputError, match="horizon") as caught:
        level.camera((0.0, 5.0), ground_uv=(3.0, 0.0))
    assert "\n" not in str(caught.value)


def test_messages_of_undetermined_cameras_are_one_line() -> None:
    view = scene(tilt_deg=0)
    with pytest.raises(UndeterminedCameraError) as caught:
        LimitedHomography.from_homography(view.G).camera(view.principal_point)
    assert "\n" not in str(caught.value)


def test_a_point_of_ground_beyond_the_horizon_would_turn_the_frame_over() -> None:
    """Why `ground_uv` is asked for: the side of the horizon decides on handedness."""
    steep = scene(tilt_deg=60, focal_length=600, height=5)
    sky = np.array(steep.principal_point) - [0, 600 / math.tan(math.radians(60)) + 50]
    found = LimitedHomography.from_homography(steep.G).camera(steep.principal_point, ground_uv=sky)
    assert found.handedness == "left"
    assert found.tilt_deg > 90
