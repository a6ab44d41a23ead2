"""What g says about the camera, against the camera that g was made from."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground import LimitedHomography
from airground.errors import UndeterminedCameraError
from airground.geometry import PlaneCamera
from scenes import Scene, generators, scenes


def model_of(scene: Scene) -> LimitedHomography:
    return LimitedHomography.from_homography(scene.G)


def check(camera: PlaneCamera, scene: Scene, tolerance: float) -> None:
    assert camera.handedness == scene.handedness
    assert_allclose(camera.focal_length_px, scene.focal_length, rtol=tolerance)
    assert_allclose(camera.height_m, scene.height, rtol=tolerance)
    assert_allclose(camera.tilt_rad, scene.tilt, rtol=0, atol=tolerance)
    assert_allclose(camera.tilt_deg, math.degrees(camera.tilt_rad))
    assert_allclose(camera.roll_deg, math.degrees(camera.roll_rad))
    # Roll is a direction that is sin(tilt) long.
    turn = math.remainder(camera.roll_rad - scene.roll, 2 * math.pi)
    assert abs(turn) * math.sin(scene.tilt) < tolerance
    assert np.array_equal(camera.principal_point_px, scene.principal_point)
    assert camera.square_pixel_residual < tolerance


@given(scenes(min_tilt_deg=2.0))
def test_camera_is_the_one_that_took_the_picture(scene: Scene) -> None:
    # f^2 stands against the square of tan(tilt): at 2 degrees rounding is a thousandfold.
    check(model_of(scene).camera(scene.principal_point), scene, 1e-9)


@given(scenes(min_tilt_deg=2.0))
def test_camera_with_its_focal_length_known(scene: Scene) -> None:
    camera = model_of(scene).camera(scene.principal_point, focal_length=scene.focal_length)
    check(camera, scene, 1e-9)


@given(scenes(min_tilt_deg=2.0), generators())
def test_camera_does_not_depend_on_the_point_of_ground(
    scene: Scene, rng: np.random.Generator
) -> None:
    check(model_of(scene).camera(scene.principal_point, ground_uv=scene.pixels(rng)), scene, 1e-9)


@given(scenes(min_tilt_deg=2.0))
def test_camera_rotation_takes_ground_axes_to_camera_axes(scene: Scene) -> None:
    camera = model_of(scene).camera(scene.principal_point)
    frame = scene.world_from_ground
    x = frame[:, 0]
    y = frame[:, 1] if scene.handedness == "right" else -frame[:, 1]
    truth = scene.camera_from_world @ np.column_stack([x, y, [0.0, 0.0, 1.0]])
    R = camera.camera_from_ground
    assert_allclose(R, truth, rtol=0, atol=1e-8)
    assert_allclose(R.T @ R, np.eye(3), rtol=0, atol=1e-12)
    assert_allclose(np.linalg.det(R), 1.0)


@given(scenes(min_tilt_deg=2.0), st.floats(-3.0, 3.0))
def test_camera_does_not_depend_on_the_turn_of_the_ground(scene: Scene, angle: float) -> None:
    check(model_of(scene).rotated(angle).camera(scene.principal_point), scene, 1e-9)


@given(scenes(max_tilt_deg=0.0))
def test_at_nadir_g_gives_only_the_ratio_of_height_and_focal_length(scene: Scene) -> None:
    model = model_of(scene)
    with pytest.raises(UndeterminedCameraError, match="give the focal length") as caught:
        model.camera(scene.principal_point)
    assert caught.value.exit_code == 3
    for factor in (1.0, 2.0):
        camera = model.camera(scene.principal_point, focal_length=factor * scene.focal_length)
        assert_allclose(camera.height_m, factor * scene.height, rtol=1e-9)
        assert camera.tilt_deg < 1e-6
        assert math.isnan(camera.roll_rad)
        assert camera.handedness == scene.handedness
        assert camera.square_pixel_residual < 1e-9


@given(scenes(min_tilt_deg=10.0))
def test_a_wrong_principal_point_shows_in_the_residual(scene: Scene) -> None:
    u0, v0 = scene.principal_point
    # Sideways in the picture, across "up": along it, another tilt would explain it.
    side = 0.2 * scene.focal_length * np.array([math.cos(scene.roll), math.sin(scene.roll)])
    camera = model_of(scene).camera((u0 + side[0], v0 + side[1]))
    assert camera.square_pixel_residual > 1e-3


@given(scenes(min_tilt_deg=5.0), st.sampled_from([-1.0, 1.0]), st.floats(1.01, 3.0))
def test_a_principal_point_too_far_from_the_horizon_has_no_focal_length(
    scene: Scene, side: float, excess: float
) -> None:
    # g fixes the distance of the camera's centre from the horizon's line in the image: f / sin(tilt). A principal
    # point that is further from that line, on either side, leaves a negative square for f.
    up = np.array([math.sin(scene.roll), -math.cos(scene.roll)])
    horizon = scene.focal_length / math.tan(scene.tilt)
    away = horizon + side * excess * scene.focal_length / math.sin(scene.tilt)
    with pytest.raises(UndeterminedCameraError, match="give the principal point"):
        model_of(scene).camera(np.array(scene.principal_point) + away * up)


@given(scenes(min_tilt_deg=10.0))
def test_pixels_that_are_not_square_are_refused_or_show_in_the_residual(scene: Scene) -> None:
    assume(
        abs(math.sin(2 * scene.roll)) > 0.5
    )  # along the picture's axes, another tilt explains it
    model = LimitedHomography.from_homography(np.diag([1.0, 1.3, 1.0]) @ scene.G)
    middle = (scene.principal_point[0], 1.3 * scene.principal_point[1])
    try:
        camera = model.camera(middle)
    except UndeterminedCameraError:
        return
    assert camera.square_pixel_residual > 1e-3
