"""What a calibration says, against the scene that it came from."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from airground.calibration import Calibration, calibrate
from airground.calibration.inspection import inspect_calibration
from airground.errors import InputError, UndeterminedError
from airground.geometry import LimitedHomography
from drives import fit_drive, read, see
from scenes import scene

T = np.arange(0, 60, 1 / 30)
SCENE = scene(tilt_deg=62, roll_deg=5, height=6.0, focal_length=1100.0)


def exact(tilt_deg: float = 62, **options: float) -> Calibration:
    here = scene(tilt_deg=tilt_deg, height=6.0, focal_length=1100.0, **options)  # type: ignore[arg-type]
    drive = fit_drive(here)
    found = calibrate(
        see(here, drive, T),
        read(drive, np.arange(-1, 61, 0.05)),
        time_offset_s=0.0,
        image_size_px=here.image_size,
    )
    return dataclasses.replace(found, model=LimitedHomography(here.g))


def test_camera_is_the_scenes() -> None:
    found = inspect_calibration(exact(roll_deg=5)).camera
    assert found is not None
    assert found.camera.focal_length_px == pytest.approx(1100, rel=1e-9)
    assert found.camera.tilt_deg == pytest.approx(62, rel=1e-9)
    assert found.camera.roll_deg == pytest.approx(5, rel=1e-6)
    assert found.camera.height_m == pytest.approx(6, rel=1e-9)
    assert found.focal_length_sigma_px > 0
    assert found.height_sigma_m > 0


def test_camera_deviations_against_samples_of_g(rng: np.random.Generator) -> None:
    calibration = exact()
    small = dataclasses.replace(calibration, covariance=1e-4 * calibration.covariance)
    found = inspect_calibration(small).camera
    assert found is not None
    root = np.linalg.cholesky(small.covariance + 1e-22 * np.eye(6))
    principal = found.camera.principal_point_px
    drawn = [
        LimitedHomography(small.model.g + (root @ rng.normal(size=6)).reshape(3, 2)).camera(
            principal
        )
        for _ in range(3000)
    ]
    assert found.focal_length_sigma_px == pytest.approx(
        np.std([c.focal_length_px for c in drawn]), rel=0.08
    )
    assert found.tilt_sigma_rad == pytest.approx(np.std([c.tilt_rad for c in drawn]), rel=0.08)
    assert found.height_sigma_m == pytest.approx(np.std([c.height_m for c in drawn]), rel=0.08)


def test_horizon_is_where_the_camera_looks_level() -> None:
    inspection = inspect_calibration(exact())
    a, b, c = inspection.horizon
    # Level is 28 degrees above the axis of a camera tilted by 62.
    v = (720 - 1) / 2 - 1100 * math.tan(math.radians(28))
    assert a * 640 + b * v + c == pytest.approx(0, abs=1e-6)
    assert math.hypot(a, b) == pytest.approx(1)
    assert b > 0  # positive below
    assert not inspection.horizon_in_frame
    steep = inspect_calibration(exact(78.0))
    assert steep.horizon_in_frame
    assert len(steep.uv) < 81
    assert np.isfinite(steep.pixels_per_metre).all()


def test_scale_is_that_of_small_steps_on_the_ground() -> None:
    here = scene(tilt_deg=62, height=6.0, focal_length=1100.0)
    inspection = inspect_calibration(exact())
    headings = np.linspace(0, np.pi, 721)
    for uv, (least, most) in list(zip(inspection.uv, inspection.pixels_per_metre, strict=True))[
        ::17
    ]:
        xy = here.unproject(uv)
        steps = here.push(
            np.tile(xy, (721, 1)), np.column_stack([np.cos(headings), np.sin(headings)])
        )
        length = np.linalg.norm(steps, axis=1)
        assert least == pytest.approx(length.min(), rel=1e-4)
        assert most == pytest.approx(length.max(), rel=1e-4)


def test_nadir_says_why_there_is_no_camera_until_the_focal_length_is_given() -> None:
    calibration = exact(0.0)
    inspection = inspect_calibration(calibration)
    assert inspection.camera is None
    assert "focal length" in inspection.camera_problem
    known = inspect_calibration(calibration, focal_length_px=1100.0).camera
    assert known is not None
    assert known.camera.height_m == pytest.approx(6.0, rel=1e-6)


def test_a_focal_length_that_could_be_anything_is_not_printed(rng: np.random.Generator) -> None:
    # A ceiling camera a few degrees off nadir: g gives the height over the focal length, hardly either.
    here = scene(tilt_deg=2, height=4.0, focal_length=2000.0)
    drive = fit_drive(here)
    tracks = see(here, drive, T, noise=0.5, rng=rng)
    readings = read(
        drive, np.arange(-1, 61, 0.05), form="speed", speed_noise=0.05, heading_noise=0.03, rng=rng
    )
    found = calibrate(tracks, readings, image_size_px=here.image_size)
    inspection = inspect_calibration(found)
    assert inspection.camera is None
    assert "focal length" in inspection.camera_problem
    known = inspect_calibration(found, focal_length_px=2000.0).camera
    assert known is not None
    assert abs(known.camera.height_m - 4.0) < 3 * known.height_sigma_m


def test_without_an_image_size_the_driven_region_is_inspected_and_the_camera_is_not_guessed() -> (
    None
):
    calibration = dataclasses.replace(exact(), image_size_px=None)
    inspection = inspect_calibration(calibration)
    assert inspection.frame_px == calibration.fit.region_px
    assert inspection.camera is None
    assert "--image-size" in inspection.camera_problem
    nothing = dataclasses.replace(
        calibration, fit=dataclasses.replace(calibration.fit, region_px=None)
    )
    with pytest.raises(UndeterminedError, match="--image-size"):
        inspect_calibration(nothing)


def test_uncertainty_grows_away_from_where_the_robot_drove(rng: np.random.Generator) -> None:
    here = fit_drive(SCENE)
    corner = dataclasses.replace(here, size=(0.4 * here.size[0], 0.4 * here.size[1]))
    tracks = see(SCENE, corner, T, noise=0.5, rng=rng)
    readings = read(
        corner, np.arange(-1, 61, 0.05), form="speed", speed_noise=0.05, heading_noise=0.03, rng=rng
    )
    found = calibrate(tracks, readings, image_size_px=SCENE.image_size, speed_scale_sigma=0.0)
    inspection = inspect_calibration(found)
    distance = np.linalg.norm(inspection.uv - found.origin_px, axis=1)
    near, far = inspection.relative_sigma[distance < 200], inspection.relative_sigma[distance > 500]
    assert far.mean() > 2 * near.mean()


def test_an_image_of_the_sky() -> None:
    level = exact(tilt_deg=85)
    with pytest.raises(
        InputError, match=r"no ground in .* beyond the horizon; check the image's size"
    ):
        inspect_calibration(level, image_size_px=(1280, 100))
