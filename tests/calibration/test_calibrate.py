"""From recordings to a calibration, by both methods: clocks, verdicts, errors."""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np
import pytest

from airground.calibration import Motion, calibrate
from airground.errors import InputError, UnobservableMotionError
from airground.geometry import n_error, velocity_map_error
from drives import Drive, fit_drive, read, see
from scenes import scene

T = np.arange(0, 60, 1 / 30)
READINGS = np.arange(-1.5, 62, 0.05)
SCENE = scene(tilt_deg=40, handedness="right")
DRIVE = fit_drive(SCENE)

Method = Literal["trajectory", "linear"]


@pytest.fixture(params=["trajectory", "linear"])
def method(request: pytest.FixtureRequest) -> Method:
    """Every test here is of both."""
    found: Method = request.param
    return found


@pytest.mark.parametrize("form", ["velocity", "speed", "distance"])
def test_clean_recordings_give_the_truth(form: str, method: Method) -> None:
    result = calibrate(
        see(SCENE, DRIVE, T), read(DRIVE, READINGS, form=form), time_offset_s=0.0, method=method
    )
    assert n_error(SCENE.g, result.model) < 3e-3
    assert velocity_map_error(SCENE.g, result.model, SCENE.project(DRIVE.xy(T))) < 5e-3
    assert result.observability.verdict == "ok"


@pytest.mark.parametrize("handedness", ["right", "left"])
def test_both_handednesses(handedness: str, method: Method) -> None:
    here = dataclasses.replace(SCENE, handedness=handedness)
    drive = fit_drive(here)
    result = calibrate(see(here, drive, T), read(drive, READINGS), time_offset_s=0.0, method=method)
    assert n_error(here.g, result.model) < 3e-3


@pytest.mark.parametrize("offset", [-0.63, -0.05, 0.12, 0.8])
def test_the_clocks_offset_is_found(
    offset: float, rng: np.random.Generator, method: Method
) -> None:
    tracks = see(SCENE, DRIVE, T, noise=0.3, rng=rng)
    motion = read(DRIVE, READINGS, offset=offset, speed_noise=0.05, heading_noise=0.03, rng=rng)
    result = calibrate(tracks, motion, method=method)
    assert result.time_offset_s == pytest.approx(offset, abs=0.02)
    assert 0 < result.time_offset_sigma_s < 0.05


def test_a_given_offset_is_kept(method: Method) -> None:
    result = calibrate(
        see(SCENE, DRIVE, T), read(DRIVE, READINGS, offset=0.25), time_offset_s=0.25, method=method
    )
    assert (result.time_offset_s, result.time_offset_sigma_s) == (0.25, 0.0)


def test_a_wrong_speed_scale_moves_g_by_what_the_prior_says(method: Method) -> None:
    tracks, motion = see(SCENE, DRIVE, T), read(DRIVE, READINGS)
    assert motion.xy_dot is not None
    fast = Motion.from_rows(motion.t, ["robot"] * len(motion), xy_dot=1.06 * motion.xy_dot)
    a = calibrate(tracks, motion, time_offset_s=0.0, method=method).model.g
    b = calibrate(tracks, fast, time_offset_s=0.0, method=method).model.g
    # As a map of velocities: an entry of g that is nearly zero has few digits of its own.
    assert velocity_map_error(1.06 ** (-1 / 3) * a, b, tracks.uv) < 1e-8


def test_a_straight_drive_is_refused(rng: np.random.Generator, method: Method) -> None:
    straight = Drive(DRIVE.centre, (DRIVE.size[0], 0.0), 40.0)
    tracks = see(SCENE, straight, T, noise=0.3, rng=rng)
    motion = read(straight, READINGS, form="speed", speed_noise=0.05, heading_noise=0.02, rng=rng)
    with pytest.raises(UnobservableMotionError, match="drive also at about") as caught:
        calibrate(tracks, motion, method=method)
    assert caught.value.rank < 5
    assert "\n" not in str(caught.value)


def test_motion_of_another_drive_is_refused(rng: np.random.Generator, method: Method) -> None:
    stranger = Drive((0.0, 0.0), (5.0, 3.0), 23.0, ratio=3)
    with pytest.raises(UnobservableMotionError, match="do not follow|explain only|uncertain by"):
        calibrate(see(SCENE, DRIVE, T, noise=0.3, rng=rng), read(stranger, READINGS), method=method)


def test_recordings_of_different_days_are_refused(method: Method) -> None:
    with pytest.raises(
        InputError, match=r"no sightings of robot fall between its readings: tracks 0\.\.59"
    ):
        calibrate(see(SCENE, DRIVE, T), read(DRIVE, READINGS, offset=5000.0), method=method)


def test_a_handful_of_sightings_is_refused(method: Method) -> None:
    with pytest.raises(UnobservableMotionError, match="motion samples|drive also at about"):
        calibrate(see(SCENE, DRIVE, T[:5]), read(DRIVE, READINGS), time_offset_s=0.0, method=method)


@pytest.mark.parametrize(
    "wrong",
    [
        {"time_offset_s": float("nan")},
        {"speed_scale_sigma": -1.0},
        {"speed_scale_sigma": 1.1},
        {"method": "magic"},
        {"distortion": "fisheye"},
        {"method": "linear", "distortion": "division"},
    ],
)
def test_wrong_options_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError):
        calibrate(see(SCENE, DRIVE, T), read(DRIVE, READINGS), **wrong)  # type: ignore[arg-type]


def test_the_same_recordings_give_the_same_bits(rng: np.random.Generator, method: Method) -> None:
    tracks = see(SCENE, DRIVE, T, noise=0.5, rng=rng)
    motion = read(DRIVE, READINGS)
    a, b = calibrate(tracks, motion, method=method), calibrate(tracks, motion, method=method)
    assert (a.model.g == b.model.g).all()
    assert (a.covariance == b.covariance).all()
