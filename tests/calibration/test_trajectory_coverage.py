"""Is the stated uncertainty true? Errors over random drives, cameras and noise, against the covariances stated."""

from __future__ import annotations

import numpy as np
from scipy.stats import binom, chi2  # type: ignore[import-untyped,unused-ignore]

from airground.calibration.calibrate import calibrate
from airground.geometry.velocity import ground_velocity
from airground.sim.recordings import RecordingNoise, RecordingPlan, record

DRIVES = ("figure_eight", "rectangle", "lawn_mower", "eight_segments", "circle", "triangle")
TRIALS = 36
DURATION_S = 30.0


def test_95_per_cent_regions_hold_95_per_cent_of_the_time(rng: np.random.Generator) -> None:
    squared, speeds = [], []
    for k in range(TRIALS):
        plan = RecordingPlan(
            drive=DRIVES[k % len(DRIVES)],
            tilt_deg=float(rng.uniform(0, 65)),
            heading_deg=float(rng.uniform(-180, 180)),
            duration_s=DURATION_S,
            reading=("speed", "xy_dot")[k % 2],
        )
        noise = RecordingNoise(
            tracks_hz=20.0,
            motion_hz=20.0,
            pixel_px=float(rng.uniform(0.5, 2.0)),
            speed_share=float(rng.uniform(0.02, 0.1)),
            heading_rad=float(rng.uniform(0.01, 0.04)),
            time_offset_s=0.05,
        )
        recording = record(plan, noise, seed=int(rng.integers(1 << 31)))
        # The scale of the speeds is exact here: a prior on it would only make the regions wider.
        found = calibrate(
            recording.tracks, recording.motion, speed_scale_sigma=0.0, distortion="none"
        )
        error = (found.model.g - recording.truth.g).ravel()
        squared.append(float(error @ np.linalg.solve(found.covariance, error)))
        uv = recording.tracks.uv[len(recording.tracks) // 3]
        uv_dot = np.array([30.0, -20.0])
        xy_dot, covariance = found.ground_velocity(uv, uv_dot)
        off = xy_dot - ground_velocity(recording.truth.g, uv, uv_dot)
        speeds.append(float(off @ np.linalg.solve(covariance, off)))
    for values, freedom in ((np.array(squared), 6), (np.array(speeds), 2)):
        inside = int(np.sum(values < chi2.ppf(0.95, freedom)))
        # What chance allows, one time in a thousand to either side.
        assert binom.ppf(0.001, TRIALS, 0.95) <= inside
        # Neither far too small nor far too large: the mean of a chi-square is its degrees of freedom.
        spread = np.sqrt(2 * freedom / TRIALS)
        assert freedom - 4 * spread < values.mean() < freedom + 4 * spread
