"""The linear method on real cars under real cameras, against surveyed ground points; skipped where there are none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from airground.calibration import calibrate, measure_speeds
from airground.errors import UnobservableMotionError
from airground.geometry import align_rotation, n_error, velocity_map_error
from airground.records import read_motion, read_tracks
from vehicles import read_speed

GOOD = ["cpm_lab/vehicle_3_a", "cpm_lab/single_vehicle_manual_driving", "efs_traffic/all_drives"]
STRAIGHT = ["efs_traffic/klinikum_01_marktkauf_straight", "efs_traffic/stadtmitte_12_audi_straight"]


@pytest.mark.parametrize("name", GOOD)
def test_calibration_against_surveyed_points(recordings: Path, name: str) -> None:
    folder = recordings / name
    tracks, motion = read_tracks(folder / "tracks.csv"), read_motion(folder / "motion.csv")
    truth = np.array(json.loads((folder / "truth.json").read_text())["g"])
    result = calibrate(tracks, motion, method="linear")
    aligned, _ = align_rotation(truth, result.model)
    assert n_error(truth, aligned) < 0.06
    # n hardly sees the perspective, so the velocities are held to the truth as well, within what is stated.
    error = velocity_map_error(truth, aligned, tracks.uv)
    assert error < 0.06
    assert error < 3 * result.observability.relative_sigma
    assert result.observability.verdict == "ok"


@pytest.mark.parametrize("name", GOOD)
def test_speeds_against_the_vehicle_s_own(recordings: Path, name: str) -> None:
    folder = recordings / name
    tracks, motion = read_tracks(folder / "tracks.csv"), read_motion(folder / "motion.csv")
    result = calibrate(tracks, motion, method="linear")
    speeds = measure_speeds(result, tracks)
    error, size = [], []
    for k, target in enumerate(speeds.targets):
        mine = speeds.target_index == k
        own = read_speed(motion, target, speeds.t[mine] + result.time_offset_s)
        known = np.isfinite(own)
        error.append((speeds.speed[mine] - own)[known])
        size.append(own[known])
    errors, sizes = np.concatenate(error), np.concatenate(size)
    assert np.sqrt(np.mean(errors**2)) < 0.10 * np.sqrt(np.mean(sizes**2))
    assert abs(np.mean(errors)) < 0.01 * np.mean(sizes)


@pytest.mark.parametrize("name", ["fvessel_two_ships", *STRAIGHT])
def test_motion_that_does_not_determine_g_is_refused(recordings: Path, name: str) -> None:
    folder = recordings / name
    tracks, motion = read_tracks(folder / "tracks.csv"), read_motion(folder / "motion.csv")
    with pytest.raises(UnobservableMotionError, match="drive also at about") as caught:
        calibrate(tracks, motion, method="linear")
    assert caught.value.rank < 5
    assert 1 <= len(caught.value.headings_deg) <= 2


@pytest.mark.parametrize(
    "name",
    [
        "audi_08_klinikum_right",
        "audi_09_marktkauf_left",
        "marktkauf_07_stadtmitte_left",
        "stadtmitte_11_marktkauf_right_02",
    ],
)
def test_one_turn_of_a_car_is_never_confidently_wrong(recordings: Path, name: str) -> None:
    folder = recordings / "efs_traffic" / name
    tracks, motion = read_tracks(folder / "tracks.csv"), read_motion(folder / "motion.csv")
    truth = np.array(json.loads((folder / "truth.json").read_text())["g"])
    try:
        result = calibrate(tracks, motion, method="linear")
    except UnobservableMotionError:
        return
    aligned, _ = align_rotation(truth, result.model)
    assert velocity_map_error(truth, aligned, tracks.uv) < 3 * result.observability.relative_sigma
