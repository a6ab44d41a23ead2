"""Efficiency and honesty of the whole-drive estimate: its errors over the Cramer-Rao bound, and over what it states.

Errors are whitened by a covariance: their root mean square is 1 where they are as large as it says. Beside it the share
of the stated 95 % regions of g that hold the truth. The scale of the speeds is exact here, and told to be.
"""

from __future__ import annotations

import argparse
from typing import Literal

import numpy as np
from scipy.stats import chi2  # type: ignore[import-untyped,unused-ignore]

from airground.calibration.calibrate import calibrate
from airground.errors import UnobservableMotionError
from airground.sim.recordings import RecordingNoise, RecordingPlan, record
from airground.studies.path_bound import Unknowns, recording_bound

NOISE = {
    "low": RecordingNoise(pixel_px=0.3, speed_share=0.02, heading_rad=0.005, time_offset_s=0.05),
    "middle": RecordingNoise(pixel_px=1.0, speed_share=0.05, heading_rad=0.02, time_offset_s=0.05),
    "high": RecordingNoise(pixel_px=3.0, speed_share=0.1, heading_rad=0.05, time_offset_s=0.05),
}
Reading = Literal["speed", "distance", "xy_dot"]
ROWS: tuple[tuple[str, float, str, Reading], ...] = (
    ("figure_eight", 35.0, "middle", "speed"),
    ("rectangle", 55.0, "middle", "xy_dot"),
    ("lawn_mower", 20.0, "low", "xy_dot"),
    ("eight_segments", 0.0, "middle", "speed"),
    ("circle", 35.0, "middle", "xy_dot"),
    ("figure_eight", 70.0, "high", "xy_dot"),
    ("rectangle", 0.0, "low", "speed"),
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=24)
    trials = parser.parse_args().trials
    print(f"{'drive':15} tilt noise   readings  over bound  over stated  in 95 %  refused")
    for drive, tilt, level, reading in ROWS:
        plan = RecordingPlan(drive=drive, tilt_deg=tilt, duration_s=40.0, reading=reading)
        bound = recording_bound(record(plan, NOISE[level], seed=0), Unknowns(clock=True))
        over_bound, over_stated, refused = [], [], 0
        for seed in range(trials):
            recording = record(plan, NOISE[level], seed=seed)
            try:
                found = calibrate(recording.tracks, recording.motion, speed_scale_sigma=0.0)
            except UnobservableMotionError:
                refused += 1
                continue
            error = (found.model.g - recording.truth.g).ravel()
            over_bound.append(error @ np.linalg.solve(bound.covariance, error) / 6)
            over_stated.append(error @ np.linalg.solve(found.covariance, error) / 6)
        inside = np.mean(6 * np.array(over_stated) < chi2.ppf(0.95, 6))
        print(
            f"{drive:15} {tilt:4.0f} {level:7} {reading:8} {np.sqrt(np.mean(over_bound)):11.3f}"
            f"{np.sqrt(np.mean(over_stated)):13.3f} {inside:8.0%} {refused:8d}",
            flush=True,
        )


if __name__ == "__main__":
    main()
