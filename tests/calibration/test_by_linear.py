"""The linear method's own: how it finds the clocks' offset, and what it says of its uncertainty."""

from __future__ import annotations

from functools import partial

import numpy as np

from airground.calibration import calibrate as calibrate_by
from airground.calibration.clock import ClockFit, find_offset
from airground.calibration.correspondences import pair_recordings
from airground.geometry import velocity_map_error
from drives import Drive, fit_drive, read, see
from scenes import random_scene, scene

calibrate = partial(calibrate_by, method="linear")
T = np.arange(0, 60, 1 / 30)
READINGS = np.arange(-1.5, 62, 0.05)
SCENE = scene(tilt_deg=40, handedness="right")
DRIVE = fit_drive(SCENE)


def test_random_cameras(rng: np.random.Generator) -> None:
    for _ in range(10):
        here = random_scene(rng, tilt_deg=(0, 65))
        drive = fit_drive(here)
        tracks = see(here, drive, T, noise=0.2, rng=rng)
        result = calibrate(tracks, read(drive, READINGS), speed_scale_sigma=0.0)
        error = velocity_map_error(here.g, result.model, tracks.uv)
        assert error < 0.03
        assert abs(result.time_offset_s) < 0.02


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
