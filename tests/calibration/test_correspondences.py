"""From recordings to samples: windows, gaps, several targets."""

from __future__ import annotations

import numpy as np
import pytest

from airground.calibration import Motion, Tracks
from airground.calibration.correspondences import pair_recordings
from airground.errors import InputError
from airground.geometry import LimitedHomography
from drives import fit_drive, read, see
from scenes import scene

SCENE = scene(tilt_deg=35)
DRIVE = fit_drive(SCENE)
T = np.arange(0, 40, 1 / 30)
TRUTH = LimitedHomography.from_homography(SCENE.G)


@pytest.mark.parametrize("form", ["velocity", "speed", "distance"])
def test_samples_satisfy_eq_15(form: str) -> None:
    data = pair_recordings(
        see(SCENE, DRIVE, T), read(DRIVE, np.arange(-0.5, 41, 0.05), form=form)
    ).at_offset(0.0)
    predicted = TRUTH.image_velocity(data.samples.uv, data.samples.xy_dot)
    error = np.linalg.norm(predicted - data.samples.uv_dot, axis=1)
    # What is left is the change of J within a window, and the readings' interpolation.
    assert np.median(error / np.linalg.norm(predicted, axis=1)) < 2e-3
    assert data.sightings == {"robot": len(T)}


def test_the_offset_is_added_to_the_tracks_clock() -> None:
    tracks = see(SCENE, DRIVE, T)
    motion = read(DRIVE, np.arange(-1, 42, 0.05), offset=0.4)
    right = pair_recordings(tracks, motion).at_offset(0.4)
    predicted = TRUTH.image_velocity(right.samples.uv, right.samples.xy_dot)
    error = np.linalg.norm(predicted - right.samples.uv_dot, axis=1) / np.linalg.norm(
        predicted, axis=1
    )
    assert np.median(error) < 2e-3


def test_windows_over_a_gap_of_the_readings_are_left_out() -> None:
    readings = np.concatenate([np.arange(0, 10, 0.05), np.arange(13, 41, 0.05)])
    data = pair_recordings(see(SCENE, DRIVE, T), read(DRIVE, readings)).at_offset(0.0)
    predicted = TRUTH.image_velocity(data.samples.uv, data.samples.xy_dot)
    error = np.linalg.norm(predicted - data.samples.uv_dot, axis=1) / np.linalg.norm(
        predicted, axis=1
    )
    assert error.max() < 0.05
    assert data.sightings["robot"] < len(T) - 80


def test_several_targets_and_third_parties() -> None:
    other = fit_drive(SCENE, period=25.0, ratio=3)
    a, b = see(SCENE, DRIVE, T, target="a"), see(SCENE, other, T, target="b")
    cart = see(SCENE, DRIVE, T + 3, target="cart")
    tracks = Tracks.from_rows(
        np.concatenate([a.t, b.t, cart.t]),
        ["a"] * len(a) + ["b"] * len(b) + ["cart"] * len(cart),
        np.concatenate([a.uv, b.uv, cart.uv]),
    )
    ra, rb = (read(d, np.arange(-0.5, 41, 0.05), target=n) for d, n in ((DRIVE, "a"), (other, "b")))
    assert ra.xy_dot is not None
    assert rb.xy_dot is not None
    motion = Motion.from_rows(
        np.concatenate([ra.t, rb.t]),
        ["a"] * len(ra) + ["b"] * len(rb),
        xy_dot=np.concatenate([ra.xy_dot, rb.xy_dot]),
    )
    pairing = pair_recordings(tracks, motion)
    assert pairing.targets == ("a", "b")
    data = pairing.at_offset(0.0)
    assert set(data.target_index.tolist()) == {0, 1}
    assert set(data.sightings) == {"a", "b"}


def test_no_common_target_is_an_error_that_names_them() -> None:
    with pytest.raises(
        InputError, match=r"no target is in both tracks \(robot\) and motion \(rover\)"
    ):
        pair_recordings(see(SCENE, DRIVE, T), read(DRIVE, T, target="rover"))
