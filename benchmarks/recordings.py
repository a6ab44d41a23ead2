"""Accuracy on the real recordings: calibration against surveyed points, speeds against the vehicles' own sensors.

Needs the recordings: AIRGROUND_DATA, or ../shared/data. The peer integrates the odometry and calls OpenCV's
findHomography by least squares, with the clock offset that we found, as it has no way to find one.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from airground.calibration import Motion, calibrate, measure_speeds
from airground.errors import UndeterminedError, UnobservableMotionError
from airground.geometry import FloatArray, align_rotation, n_error, velocity_map_error
from airground.studies.recordings import find_recordings, odometry_homography, read_recording


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
    for path in find_recordings(folder):
        print(f"{path.relative_to(folder).as_posix():46} {_row(path)}", flush=True)


def _row(folder: Path) -> str:
    recording = read_recording(folder)
    tracks, motion = recording.tracks, recording.motion
    started = time.perf_counter()
    try:
        result = calibrate(tracks, motion, image_size_px=recording.image_size_px)
    except UnobservableMotionError as error:
        return f"refused: {error.reason[:90]}"
    elapsed = time.perf_counter() - started
    truth = recording.g
    if truth is None:
        return "no truth"
    aligned, _ = align_rotation(truth, result.model)
    try:
        peer = odometry_homography(tracks, motion, result.time_offset_s)
        peer_n = f"{float(n_error(truth, align_rotation(truth, peer)[0])):7.4f}"
    except UndeterminedError:  # several robots, whose origins differ
        peer_n = "-"
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


if __name__ == "__main__":
    main()
