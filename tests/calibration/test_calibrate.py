"""From recordings to a calibration: clocks, uncertainty, verdicts."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from airground.calibration import Motion, calibrate
from airground.calibration.clock import ClockFit, find_offset
from airground.calibration.correspondences import pair_recordings
from airground.errors import InputError, UnobservableMotionError
from airground.geometry import n_error, velocity_map_error
from drives import Drive, fit_drive, read, see
from scenes import random_scene, scene

T = np.arange(0, 60, 1 / 30)
READINGS = np.arange(-1.5, 62, 0.05)
SCENE = scene(tilt_deg=40, handedness="right")
DRIVE = fit_drive(SCENE)


@pytest.mark.parametrize("form", ["velocity", "speed", "distance"])
def test_clean_recordings_give_the_truth(form: str) -> None:
    result = calibrate(see(SCENE, DRIVE, T), read(DRIVE, READINGS, form=form), time_offset_s=0.0)
    assert n_error(SCENE.g, result.model) < 3e-3
    assert velocity_map_error(SCENE.g, result.model, SCENE.project(DRIVE.xy(T))) < 5e-3
    assert result.observability.verdict == "ok"


@pytest.mark.parametrize("handedness", ["right", "left"])
def test_both_handednesses(handedness: str) -> None:
    here = dataclasses.replace(SCENE, handedness=handedness)
    drive = fit_drive(here)
    result = calibrate(see(here, drive, T), read(drive, READINGS), time_offset_s=0.0)
    assert n_error(here.g, result.model) < 3e-3


def test_random_cameras(rng: np.random.Generator) -> None:
    for _ in range(10):
        here = random_scene(rng, tilt_deg=(0, 65))
        drive = fit_drive(here)
        tracks = see(here, drive, T, noise=0.2, rng=rng)
        result = calibrate(tracks, read(drive, READINGS), speed_scale_sigma=0.0)
        error = velocity_map_error(here.g, result.model, tracks.uv)
        assert error < 0.03
        assert result.time_offset_s == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("offset", [-0.63, -0.05, 0.12, 0.8])
def test_the_clocks_offset_is_found(offset: float, rng: np.random.Generator) -> None:
    tracks = see(SCENE, DRIVE, T, noise=0.3, rng=rng)
    motion = read(DRIVE, READINGS, offset=offset, speed_noise=0.05, heading_noise=0.03, rng=rng)
    result = calibrate(tracks, motion)
    assert result.time_offset_s == pytest.approx(offset, abs=0.02)
    assert 0 < result.time_offset_sigma_s < 0.05


def test_a_given_offset_is_kept() -> None:
    result = calibrate(see(SCENE, DRIVE, T), read(DRIVE, READINGS, offset=0.25), time_offset_s=0.25)
    assert (result.time_offset_s, result.time_offset_sigma_s) == (0.25, 0.0)


def test_an_offset_beyond_the_reach_of_the_search_is_not_made_up() -> None:
    pairing = pair_recordings(see(SCENE, DRIVE, T), read(DRIVE, READINGS, offset=1.1))
    assert find_offset(pairing) == ClockFit(0.0, found=False)


def test_an_offset_that_is_assumed_widens_the_covariance_and_is_said() -> None:
    slow = Drive(DRIVE.centre, DRIVE.size, 4000.0, ratio=2)
    t = np.arange(0, 4000, 20.0)  # nothing changes within a second
    tracks, motion = see(SCENE, slow, t), read(slow, np.arange(0, 4000, 20.0), offset=1.1)
    notes: list[str] = []
    assumed = calibrate(tracks, motion, note=notes.append)
    given = calibrate(tracks, motion, time_offset_s=0.0)
    assert assumed.time_offset_s == 0.0
    assert assumed.time_offset_sigma_s > 0
    assert any("offset" in note for note in notes)
    assert np.trace(assumed.covariance) > np.trace(given.covariance)


def test_the_speed_scale_prior_widens_the_covariance_along_g() -> None:
    tracks, motion = see(SCENE, DRIVE, T), read(DRIVE, READINGS)
    sharp = calibrate(tracks, motion, time_offset_s=0.0, speed_scale_sigma=0.0)
    wide = calibrate(tracks, motion, time_offset_s=0.0, speed_scale_sigma=0.03)
    added = wide.covariance - sharp.covariance
    g = sharp.model.g.ravel()
    np.testing.assert_allclose(
        added, 0.01**2 * np.outer(g, g), rtol=1e-6, atol=1e-9 * np.abs(added).max()
    )


def test_a_wrong_speed_scale_moves_g_by_what_the_prior_says() -> None:
    tracks, motion = see(SCENE, DRIVE, T), read(DRIVE, READINGS)
    assert motion.xy_dot is not None
    fast = Motion.from_rows(motion.t, ["robot"] * len(motion), xy_dot=1.06 * motion.xy_dot)
    a = calibrate(tracks, motion, time_offset_s=0.0).model.g
    b = calibrate(tracks, fast, time_offset_s=0.0).model.g
    # As a map of velocities: an entry of g that is nearly zero has few digits of its own.
    assert velocity_map_error(1.06 ** (-1 / 3) * a, b, tracks.uv) < 1e-8


def test_stated_deviation_covers_the_error(rng: np.random.Generator) -> None:
    """Over noisy drives, the velocity map's error is what relative_sigma says, within a factor of two."""
    ratios = []
    for _ in range(25):
        tracks = see(SCENE, DRIVE, T, noise=0.5, rng=rng)
        motion = read(DRIVE, READINGS, form="speed", speed_noise=0.1, heading_noise=0.05, rng=rng)
        result = calibrate(tracks, motion, speed_scale_sigma=0.0)
        ratios.append(
            velocity_map_error(SCENE.g, result.model, tracks.uv)
            / result.observability.relative_sigma
        )
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 2.0


def test_a_straight_drive_is_refused(rng: np.random.Generator) -> None:
    straight = Drive(DRIVE.centre, (DRIVE.size[0], 0.0), 40.0)
    tracks = see(SCENE, straight, T, noise=0.3, rng=rng)
    motion = read(straight, READINGS, form="speed", speed_noise=0.05, heading_noise=0.02, rng=rng)
    with pytest.raises(UnobservableMotionError, match="drive also at about") as caught:
        calibrate(tracks, motion)
    assert caught.value.rank < 5
    assert "\n" not in str(caught.value)


def test_motion_of_another_drive_is_refused(rng: np.random.Generator) -> None:
    stranger = Drive((0.0, 0.0), (5.0, 3.0), 23.0, ratio=3)
    with pytest.raises(UnobservableMotionError, match="do not follow|explain only|uncertain by"):
        calibrate(see(SCENE, DRIVE, T, noise=0.3, rng=rng), read(stranger, READINGS))


def test_recordings_of_different_days_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"no sightings of robot fall between its readings: tracks 0\.\.59"
    ):
        calibrate(see(SCENE, DRIVE, T), read(DRIVE, READINGS, offset=5000.0))


def test_a_handful_of_sightings_is_refused() -> None:
    with pytest.raises(UnobservableMotionError, match="motion samples"):
        calibrate(see(SCENE, DRIVE, T[:5]), read(DRIVE, READINGS), time_offset_s=0.0)


@pytest.mark.parametrize(
    "wrong",
    [{"time_offset_s": float("nan")}, {"speed_scale_sigma": -1.0}, {"method": "trajectory"}],
)
def test_wrong_options_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError):
        calibrate(see(SCENE, DRIVE, T), read(DRIVE, READINGS), **wrong)  # type: ignore[arg-type]


def test_the_same_recordings_give_the_same_bits(rng: np.random.Generator) -> None:
    tracks = see(SCENE, DRIVE, T, noise=0.5, rng=rng)
    motion = read(DRIVE, READINGS)
    a, b = calibrate(tracks, motion), calibrate(tracks, motion)
    assert (a.model.g == b.model.g).all()
    assert (a.covariance == b.covariance).all()
