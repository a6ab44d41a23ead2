"""Projection in normalised pixels: against the camera's own homography, derivatives by complex steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.calibration.trajectory.view import View, project, project_with_derivatives
from arcs import pixels
from scenes import generators, scene, scenes

if TYPE_CHECKING:
    from scenes import Array, Scene

BENDS = st.sampled_from([0.0, -0.06, 0.02])
STEP = 1e-30


def seen(camera: Scene, rng: np.random.Generator, count: int = 30) -> tuple[View, Array, Array]:
    """A view of some ground, the ground relative to what lies under its middle, and its pixels."""
    xy = camera.ground(rng, (count,))
    uv = camera.project(xy)
    view = View.around(uv)
    return view, xy - camera.unproject(view.middle), uv


def lies_on_ground(camera: Scene, view: View) -> bool:
    """The middle of points at the horizon may itself lie beyond it for nobody, but near it for some."""
    return bool(camera.sees_ground(view.middle))


@given(scenes(square=False), generators())
def test_g_goes_to_normalised_pixels_and_back(camera: Scene, rng: np.random.Generator) -> None:
    view, _, uv = seen(camera, rng)
    s = 1 / np.sqrt(np.mean((uv - uv.mean(axis=0)) ** 2))
    T = np.diag([s, s, 1.0])
    T[:2, 2] = -s * uv.mean(axis=0)
    assert_allclose(view.matrix, T, rtol=1e-9, atol=1e-12)
    full = T @ camera.G
    full = full / np.cbrt(np.linalg.det(full))  # unit determinant, by the full homography
    g_T = view.to_normal(camera.g)
    assert_allclose(g_T, full[:, :2], rtol=1e-9, atol=1e-9 * np.abs(full[:, :2]).max())
    back = view.to_px(g_T)
    assert_allclose(back, camera.g, rtol=1e-9, atol=1e-11 * np.abs(camera.g).max())
    by_column = np.stack([view.to_px(e.reshape(3, 2)).ravel() for e in np.eye(6)], axis=1)
    assert_allclose(view.px_from_normal, by_column, rtol=1e-12, atol=0)


@given(scenes(square=False), generators())
def test_projection_is_that_of_the_camera(camera: Scene, rng: np.random.Generator) -> None:
    view, xy, uv = seen(camera, rng)
    if lies_on_ground(camera, view):
        size = max(camera.image_size)
        assert_allclose(project(view, view.to_normal(camera.g), 0.0, xy), uv, atol=1e-6 * size)


@given(scenes(), generators(), BENDS)
def test_through_a_lens_the_pinhole_is_seen_undistorted(
    camera: Scene, rng: np.random.Generator, bend: float
) -> None:
    view, xy, uv = seen(camera, rng)
    if not lies_on_ground(camera, view):
        return
    raw = project(view, view.to_normal(camera.g), bend, xy)
    d = raw - view.center
    undistorted = view.center + d / (1 + bend * view.scale**2 * np.sum(d**2, axis=1))[:, None]
    known = np.isfinite(raw).all(axis=1)
    assert known.sum() >= len(uv) // 2  # the rest is beyond the reach of a pincushion
    assert_allclose(undistorted[known], uv[known], atol=1e-6 * max(camera.image_size))
    lens = view.lens(bend)
    assert (lens is None) == (bend == 0.0)


@pytest.mark.parametrize("handedness", ["right", "left"])
@pytest.mark.parametrize("bend", [0.0, -0.07, 0.02])
@pytest.mark.parametrize("tilt_deg", [0.0, 35.0, 70.0])
def test_derivatives(
    handedness: str, bend: float, tilt_deg: float, rng: np.random.Generator
) -> None:
    camera = scene(tilt_deg=tilt_deg, roll_deg=7.0, heading_deg=50.0, handedness=handedness)
    view, xy, _ = seen(camera, rng)
    g_T = view.to_normal(camera.g)
    n_3 = np.cross(g_T[:, 0], g_T[:, 1])[2]
    assert (n_3 > 0) == (handedness == "left")  # both signs are met
    found = project_with_derivatives(view, g_T, bend, xy, lens_too=True)
    assert_allclose(found.uv, project(view, g_T, bend, xy), rtol=1e-13)
    assert_allclose(found.uv, pixels(g_T, view, bend, xy), rtol=1e-9)
    by_xy = [pixels(g_T, view, bend, xy + 1j * STEP * e).imag / STEP for e in np.eye(2)]
    assert_allclose(found.by_xy, np.stack(by_xy, axis=2), rtol=1e-8, atol=1e-8 * _size(by_xy))
    by_g = [
        pixels(g_T + 1j * STEP * e.reshape(3, 2), view, bend, xy).imag / STEP for e in np.eye(6)
    ]
    assert_allclose(found.by_g, np.stack(by_g, axis=2), rtol=1e-8, atol=1e-8 * _size(by_g))
    by_bend = pixels(g_T, view, bend + 1j * STEP, xy).imag / STEP
    assert found.by_bend is not None
    assert_allclose(found.by_bend, by_bend, rtol=1e-8, atol=1e-8 * _size([by_bend]))
    assert project_with_derivatives(view, g_T, bend, xy).by_bend is None


def _size(values: list[Array]) -> float:
    return float(np.abs(values).max())


@pytest.mark.parametrize("handedness", ["right", "left"])
def test_what_is_behind_the_camera_is_not_seen(handedness: str, rng: np.random.Generator) -> None:
    camera = scene(tilt_deg=60.0, handedness=handedness, heading_deg=-20.0, frame_heading_deg=33.0)
    view, _, _ = seen(camera, rng)
    xy = rng.uniform(-100.0, 100.0, (500, 2))
    ahead = camera.depth(xy) > 0
    assert 50 < ahead.sum() < 450
    uv = project(view, view.to_normal(camera.g), 0.0, xy - camera.unproject(view.middle))
    assert (np.isfinite(uv).all(axis=1) == ahead).all()
    assert np.isnan(uv[~ahead]).all()
    found = project_with_derivatives(
        view, view.to_normal(camera.g), 0.0, xy - camera.unproject(view.middle)
    )
    assert np.isnan(found.uv[~ahead]).all()


def test_the_lens_s_centre_is_the_middle_of_the_sightings_unless_given() -> None:
    uv = np.array([[0.0, 0.0], [100.0, 0.0], [10.0, 50.0]])
    assert_allclose(View.around(uv).center, [50.0, 25.0])
    assert_allclose(View.around(uv, np.array([3.0, 4.0])).center, [3.0, 4.0])
    assert_allclose(View.around(uv).middle, uv.mean(axis=0))
