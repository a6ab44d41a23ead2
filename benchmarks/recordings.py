"""Accuracy on the real recordings: calibration against surveyed points, speeds against the vehicles' own sensors.

Needs the recordings: AIRGROUND_DATA, or ../shared/data. The peer integrates the odometry and calls OpenCV's
findHomography by least squares, with the clock offset that we found, as it has no way to find one.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import cv2
import numpy as np

from airground.calibration import Motion, Tracks, calibrate, measure_speeds
from airground.calibration.ground_path import ground_path
from airground.errors import UnobservableMotionError
from airground.geometry import (
    FloatArray,
    LimitedHomography,
    align_rotation,
    n_error,
    velocity_map_error,
)
from airground.records import read_motion, read_tracks

NAMES = (
    "cpm_lab/vehicle_3_a",
    "cpm_lab/single_vehicle_manual_driving",
    "efs_traffic/all_drives",
    "efs_traffic/audi_08_klinikum_right",
    "efs_traffic/audi_09_marktkauf_left",
    "efs_traffic/klinikum_01_marktkauf_straight",
    "efs_traffic/marktkauf_07_stadtmitte_left",
    "efs_traffic/stadtmitte_11_marktkauf_right_02",
    "efs_traffic/stadtmitte_12_audi_straight",
    "fvessel_two_ships",
)


def main() -> None:
    folder = Path(os.environ.get("AIRGROUND_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        print(f"no recordings at {folder}; set AIRGROUND_DATA to their folder")
        return
    print(
        "n and map error after the best rotation of the ground; map = relative error of ground velocities"
    )
    print(
        f"{'recording':46} {'n':>7} {'map':>7} {'stated':>7} {'peer n':>7} "
        f"{'speed rms':>10} {'of':>6} {'in 95 %':>8} {'s':>5}"
    )
    for name in NAMES:
        print(f"{name:46} {_row(folder / name)}", flush=True)


def _row(folder: Path) -> str:
    tracks, motion = read_tracks(folder / "tracks.csv"), read_motion(folder / "motion.csv")
    told = json.loads((folder / "truth.json").read_text())
    size = told["image_size_px"]  # which a user knows of the camera
    started = time.perf_counter()
    try:
        result = calibrate(tracks, motion, image_size_px=None if size is None else tuple(size))
    except UnobservableMotionError as error:
        return f"refused: {error.reason[:90]}"
    elapsed = time.perf_counter() - started
    truth = np.array(told["g"])
    aligned, _ = align_rotation(truth, result.model)
    peer = _peer(tracks, motion, result.time_offset_s)
    peer_n = (
        "-" if peer is None else f"{float(n_error(truth, align_rotation(truth, peer)[0])):7.4f}"
    )
    speeds = measure_speeds(result, tracks)
    wrong, sigma, size = [], [], []
    for k, target in enumerate(speeds.targets):
        mine = speeds.target_index == k
        rows = motion.rows(target)
        own = _own_speed(motion, rows)
        t = speeds.t[mine] + result.time_offset_s
        read = np.interp(t, motion.t[rows], own, left=np.nan, right=np.nan)
        known = np.isfinite(read)
        wrong.append((speeds.speed[mine] - read)[known])
        sigma.append(speeds.speed_sigma[mine][known])
        size.append(read[known])
    errors, sigmas, sizes = (np.concatenate(x) for x in (wrong, sigma, size))
    return (
        f"{float(n_error(truth, aligned)):7.4f} {velocity_map_error(truth, aligned, tracks.uv):7.4f} "
        f"{result.observability.relative_sigma:7.4f} {peer_n:>7} {np.sqrt(np.mean(errors**2)):6.3f} m/s "
        f"{np.sqrt(np.mean(sizes**2)):6.2f} {np.mean(np.abs(errors) < 1.96 * sigmas):8.2f} {elapsed:5.2f}"
    )


def _own_speed(motion: Motion, rows: slice) -> FloatArray:
    """Speed that the vehicle's own sensors read."""
    if motion.xy_dot is not None:
        return np.asarray(np.linalg.norm(motion.xy_dot[rows], axis=1))
    assert motion.speed is not None
    return np.abs(motion.speed[rows])


def _peer(tracks: Tracks, motion: Motion, offset: float) -> LimitedHomography | None:
    """Odometry integrated over the whole drive, and OpenCV's findHomography; one target only, as origins differ."""
    name = tracks.targets[0]
    path = ground_path(motion, name)
    if len(tracks.targets) > 1 or path is None:
        return None
    rows = tracks.rows(name)
    xy, stretch = path.at(tracks.t[rows] + offset)
    keep = stretch >= 0
    matrix, _ = cv2.findHomography(xy[keep], tracks.uv[rows][keep], 0)
    return LimitedHomography.from_homography(matrix)


if __name__ == "__main__":
    main()
