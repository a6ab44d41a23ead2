"""The simulated camera against OpenCV, finite differences and the package's own geometry."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import SimCamera

SIZE = (1280, 720)


@dataclass(frozen=True)
class Pose:
    f: float
    tilt: float
    roll: float
    heading: float
    height: float

    def camera(self) -> SimCamera:
        return SimCamera.looking_down(
            focal_length_px=self.f,
            tilt_rad=self.tilt,
            roll_rad=self.roll,
            heading_rad=self.heading,
            height_m=self.height,
            image_size_px=SIZE,
        )


poses = st.builds(
    Pose,
    f=st.floats(300, 3000),
    tilt=st.floats(0.05, 1.2),
    roll=st.floats(-3, 3),
    heading=st.floats(-3.1, 3.1),
    height=st.floats(0.5, 100),
)


def rotation(axis: str, angle: float) -> np.ndarray:
    vector = np.array({"x": [1.0, 0, 0], "y": [0, 1.0, 0], "z": [0, 0, 1.0]}[axis]) * angle
    return np.asarray(cv2.Rodrigues(vector)[0])


def seen_ground(camera: SimCamera, rng: np.random.Generator, count: int = 40) -> np.ndarray:
    """Ground points in view, not near the horizon."""
    uv = rng.uniform([0, 0], np.array(SIZE) - 1.0, (4 * count, 2))
    xy = camera.unproject(uv)
    xy = xy[np.isfinite(xy).all(axis=1)]
    middle = camera.unproject(np.array([639.5, 359.5]))
    near = np.linalg.norm(xy, axis=1) < 20 * np.linalg.norm(middle) + 20
    return np.asarray(xy[near][:count])


@given(poses)
def test_projection_is_opencvs(pose: Pose) -> None:
    camera = pose.camera()
    xy = seen_ground(camera, np.random.default_rng(0))
    # Built another way: from a camera that looks straight down with -v to the north, tilted about its own axes.
    down = np.diag([1.0, -1.0, -1.0])
    R = (
        rotation("z", pose.roll)
        @ rotation("x", -pose.tilt)
        @ down
        @ rotation("z", np.pi / 2 - pose.heading)
    )
    t = -R @ np.array([0.0, 0.0, pose.height])
    K = np.array([[pose.f, 0, 639.5], [0, pose.f, 359.5], [0, 0, 1]])
    expected = cv2.projectPoints(
        np.column_stack([xy, np.zeros(len(xy))]), cv2.Rodrigues(R)[0], t, K, None
    )[0].reshape(-1, 2)
    assert len(xy) > 5
    assert_allclose(camera.project(xy), expected, rtol=1e-6, atol=1e-5)


@given(poses)
def test_velocity_is_the_derivative_of_projection(pose: Pose) -> None:
    camera = pose.camera()
    rng = np.random.default_rng(1)
    xy = seen_ground(camera, rng)
    xy_dot = rng.normal(size=xy.shape)
    h = 1e-6 * pose.height
    numeric = (camera.project(xy + h * xy_dot) - camera.project(xy - h * xy_dot)) / (2 * h)
    analytic = camera.project_velocity(xy, xy_dot)
    assert_allclose(analytic, numeric, rtol=1e-4, atol=1e-5 * np.abs(analytic).max())


@given(poses)
def test_eq_15_by_the_packages_geometry_is_the_cameras_own_velocity(pose: Pose) -> None:
    camera = pose.camera()
    rng = np.random.default_rng(2)
    xy = seen_ground(camera, rng)
    xy_dot = rng.normal(size=xy.shape)
    by_g = LimitedHomography(camera.g).image_velocity(camera.project(xy), xy_dot)
    truth = camera.project_velocity(xy, xy_dot)
    assert_allclose(by_g, truth, rtol=1e-6, atol=1e-7 * np.abs(truth).max())


@given(poses, st.sampled_from([1.0, -1.0, 3e-4, -700.0]), st.booleans())
def test_g_is_eq_21_at_any_scale_sign_and_handedness(
    pose: Pose, scale: float, mirrored: bool
) -> None:
    G = scale * pose.camera().image_from_ground
    if mirrored:
        G = G[:, [1, 0, 2]]
    camera = SimCamera(G, SIZE)
    assert_allclose(camera.g, LimitedHomography.from_homography(G).g, rtol=1e-9)
    H3 = np.cross(camera.g[:, 0], camera.g[:, 1])
    assert np.sign(H3 @ [639.5, 359.5, 1.0]) == (1 if mirrored else -1)  # estimation.md, sign


@given(poses)
def test_g_tells_the_camera_that_it_was_built_from(pose: Pose) -> None:
    found = LimitedHomography(pose.camera().g).camera((639.5, 359.5))
    assert found.focal_length_px == pytest.approx(pose.f, rel=1e-6)
    assert found.tilt_rad == pytest.approx(pose.tilt, abs=1e-7)
    assert found.height_m == pytest.approx(pose.height, rel=1e-6)
    assert np.cos(found.roll_rad - pose.roll) == pytest.approx(1.0, abs=1e-12)


@given(poses)
def test_the_optical_axis_meets_the_ground_ahead(pose: Pose) -> None:
    xy = pose.camera().unproject(np.array([639.5, 359.5]))
    ahead = pose.height * np.tan(pose.tilt) * np.array([np.cos(pose.heading), np.sin(pose.heading)])
    assert_allclose(xy, ahead, rtol=1e-8, atol=1e-9 * pose.height)


def test_at_nadir_minus_v_points_along_the_heading() -> None:
    camera = Pose(500.0, 0.0, 0.0, np.pi / 2, 2.0).camera()
    assert_allclose(camera.project([[0.0, 0.0], [0.4, 0.0], [0.0, 0.4]])[0], [639.5, 359.5])
    assert_allclose(camera.project([0.4, 0.0]), [739.5, 359.5])  # x to the right
    assert_allclose(camera.project([0.0, 0.4]), [639.5, 259.5])  # y up in the image: -v


def test_what_is_behind_the_camera_has_no_image() -> None:
    camera = Pose(900.0, 1.0, 0.0, 0.0, 3.0).camera()  # looks along x
    behind, ahead = np.array([-3.0, 0.0]), np.array([4.0, 0.0])
    assert np.isnan(camera.project(behind)).all()
    assert np.isnan(camera.project_velocity(behind, [1.0, 0.0])).all()
    assert camera.visible([behind, ahead]).tolist() == [False, True]
    assert np.isnan(camera.unproject([639.5, -2000.0])).all()  # sky


@pytest.mark.parametrize("scale", [-1.0, 40.0, -2e-5])
def test_the_sign_and_scale_of_the_matrix_do_not_matter(scale: float) -> None:
    camera = Pose(900.0, 1.0, 0.2, 0.0, 3.0).camera()
    other = SimCamera(scale * camera.image_from_ground, SIZE)
    xy = np.array([[4.0, 0.3], [5.0, -1.0], [-3.0, 0.0]])  # the last one is behind
    assert_allclose(other.project(xy), camera.project(xy), rtol=1e-12)
    assert_allclose(other.project_velocity(xy, xy), camera.project_velocity(xy, xy), rtol=1e-9)
    assert other.visible(xy).tolist() == camera.visible(xy).tolist() == [True, True, False]


def test_visible_ends_at_the_border_of_the_image() -> None:
    camera = Pose(900.0, 0.3, 0.1, 0.0, 3.0).camera()
    uv = np.array([[-0.49, 10], [-0.51, 10], [1279.49, 10], [1279.51, 10], [5, 719.6], [5, 719.4]])
    xy = camera.unproject(uv)
    assert camera.visible(xy).tolist() == [True, False, True, False, False, True]
    assert not camera.visible(xy, margin_px=20).any()
    assert camera.visible(camera.unproject([640.0, 30.0]), margin_px=20)


@pytest.mark.parametrize("shape", [(2,), (1, 2), (3, 1, 2), (0, 2)])
def test_leading_axes_broadcast(shape: tuple[int, ...], rng: np.random.Generator) -> None:
    camera = Pose(900.0, 0.6, 0.1, 0.2, 3.0).camera()
    xy = rng.uniform(1, 2, shape)
    assert camera.project(xy).shape == shape
    assert camera.project_velocity(xy, [0.1, 0.2]).shape == shape
    assert camera.visible(xy).shape == shape[:-1]
    assert_allclose(camera.unproject(camera.project(xy)), xy, rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"focal_length_px": 0.0}, "positive"),
        ({"height_m": -1.0}, "positive"),
        ({"tilt_rad": 1.6}, "tilt_rad"),
        ({"tilt_rad": float("nan")}, "tilt_rad"),
        ({"image_size_px": (0, 10)}, "image_size_px"),
    ],
)
def test_impossible_cameras_are_refused(change: dict[str, object], message: str) -> None:
    good = {
        "focal_length_px": 900.0,
        "tilt_rad": 0.5,
        "height_m": 3.0,
        "image_size_px": SIZE,
    }
    with pytest.raises(InputError, match=message):
        SimCamera.looking_down(**{**good, **change})  # type: ignore[arg-type]


def test_a_camera_in_the_ground_or_level_is_refused() -> None:
    with pytest.raises(InputError, match="singular"):
        SimCamera(np.zeros((3, 3)), SIZE)
    K = np.array([[900, 0, 639.5], [0, 900, 359.5], [0, 0, 1]])
    level = K @ np.array([[0, -1, 0], [0, 0, 2.0], [1, 0, 0]])  # looks along x from 2 m
    with pytest.raises(InputError, match="horizon"):
        SimCamera(level, SIZE)


def test_the_matrix_is_our_own() -> None:
    G = Pose(900.0, 0.6, 0.1, 0.2, 3.0).camera().image_from_ground.copy()
    camera = SimCamera(G, SIZE)
    G[:] = 0
    assert camera.image_from_ground.any()
    with pytest.raises(ValueError, match="read-only"):
        camera.image_from_ground[0, 0] = 1
