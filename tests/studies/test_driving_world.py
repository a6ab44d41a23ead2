"""Which world a calibration is driven in, and that it is one the calibration could have come from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration import Calibration, calibrate
from airground.geometry import DivisionLens, n_error
from airground.sim import calibration_drive, demo_world
from airground.studies.driving_world import demo_driving_world, world_for, world_of_calibration


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    drive = calibration_drive(demo_world(), np.random.default_rng(0), duration_s=40.0)
    return calibrate(drive.tracks, drive.motion, image_size_px=(1280, 720), distortion="none")


def test_the_demos_calibration_is_driven_in_the_demos_world(calibration: Calibration) -> None:
    world, why = world_for(calibration, seed=0)
    assert (world.name, world.compass_bias_rad) == ("demo", 0.0)
    assert "warehouse" in why
    assert world.scene is not None
    assert [body.name for body in world.scene.bodies].count("cart") == 0  # nobody to run into


def test_another_zero_of_the_compass_is_taken_into_the_world(calibration: Calibration) -> None:
    """Headings are those of the calibration's frame: the world's compass must read so."""
    turned = replace(calibration, model=calibration.model.rotated(0.7))
    world, _ = world_for(turned, seed=0)
    assert world.name == "demo"
    # Its x axis has heading 0.7 in the old frame, so it reads 0.7 less.
    assert_allclose(world.compass_bias_rad, -0.7, atol=0.02)


def test_any_other_calibration_gets_a_world_of_its_own(calibration: Calibration) -> None:
    other = replace(calibration, model=type(calibration.model)(1.4 * calibration.model.g))
    world, why = world_for(other, seed=0)
    assert world.name == "calibration"
    assert "drawn from the calibration" in why
    assert world.scene is None
    size = replace(calibration, image_size_px=(1920, 1080))
    assert world_for(size, seed=0)[0].name == "calibration"


def test_its_truth_scatters_as_the_calibration_says(calibration: Calibration) -> None:
    draws = np.stack(
        [
            world_of_calibration(calibration, np.random.default_rng(k)).camera.g.ravel()
            for k in range(400)
        ]
    )
    off = draws - calibration.model.g.ravel()
    sigma = np.sqrt(np.diag(calibration.covariance))
    # A standard deviation of 400 draws is known to 3.5 %; the sign of G is the camera's, not the draw's.
    assert_allclose(off.std(axis=0) / sigma, 1.0, atol=0.2)
    assert n_error(calibration.model, draws[0].reshape(3, 2)) > 0


def test_a_lens_is_drawn_with_the_rest(calibration: Calibration) -> None:
    lens = DivisionLens(-1e-7, np.array([639.5, 359.5]))
    k1 = np.zeros(7)
    k1[6] = 1e-16
    other = replace(calibration, lens=lens, k1_covariance=k1)
    worlds = [world_of_calibration(other, np.random.default_rng(k)) for k in range(60)]
    coefficients = [w.lens.k1_per_px2 for w in worlds if w.lens is not None]
    assert len(coefficients) == 60
    assert_allclose(np.mean(coefficients), -1e-7, atol=5e-9)
    assert_allclose(np.std(coefficients), 1e-8, rtol=0.35)
    uv = np.array([200.0, 600.0])
    assert_allclose(worlds[0].distorted(worlds[0].undistorted(uv)), uv, atol=1e-6)


def test_the_robot_starts_in_view() -> None:
    world = demo_driving_world()
    assert world.camera.visible(np.array(world.start_m), 50.0)


def test_without_an_image_size_the_image_holds_what_is_asked_for(calibration: Calibration) -> None:
    unsized = replace(calibration, image_size_px=None)
    rng = np.random.default_rng(0)
    width, height = world_of_calibration(unsized, rng).camera.image_size_px
    far = np.array([[width + 300.0, height / 2]])
    wider = world_of_calibration(unsized, np.random.default_rng(0), far).camera.image_size_px
    assert wider[0] > width + 300
    assert wider[1] == height
