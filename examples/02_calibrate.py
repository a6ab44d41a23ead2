"""From a recording to a calibration, with its uncertainty; the recording is made by the embedded world.

Run: python examples/02_calibrate.py
"""

import tempfile
from pathlib import Path

import numpy as np

import airground as ag
from airground.sim import calibration_drive, demo_world


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        drive = calibration_drive(demo_world(), np.random.default_rng(1))
        ag.write_tracks(folder / "tracks.csv", drive.tracks)  # t_s, target, u_px, v_px
        ag.write_motion(
            folder / "motion.csv", drive.motion
        )  # t_s, target, heading_rad, speed_mps, distance_m

        # With recordings of your own, begin here.
        tracks, motion = (
            ag.read_tracks(folder / "tracks.csv"),
            ag.read_motion(folder / "motion.csv"),
        )
        try:
            calibration = ag.calibrate(tracks, motion, note=print)
        except ag.UnobservableMotionError as error:
            print(f"not yet: {error.reason}. Next: {error.advice}")
            return
        calibration.save(folder / "calibration.json")

    print("verdict:", calibration.observability.verdict)
    print(
        "n against the truth:",
        round(float(ag.n_error(demo_world().camera.g, calibration.model)), 4),
    )
    xy_dot, covariance = calibration.ground_velocity([640.0, 360.0], [40.0, 0.0])
    print(
        "40 px/s in the middle:",
        xy_dot.round(3),
        "m/s, deviations",
        np.sqrt(np.diag(covariance)).round(3),
    )

    # Everything else in view has a speed too, whether it knows of us or not.
    for row in ag.measure_speeds(calibration, tracks).by_target():
        print(
            row["target"],
            f"{row['speed_median_mps']:.3f} m/s, deviation {row['speed_sigma_median_mps']:.3f}",
        )


if __name__ == "__main__":
    main()
