"""Stated deviation against true error, over random cameras, drives, noise and clock offsets.

1.0 is an honest deviation; below, it is cautious; above, too sure of itself. The scenes are those of the tests.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from airground.calibration import calibrate
from airground.errors import UnobservableMotionError
from airground.geometry import velocity_map_error
from drives import fit_drive, read, see
from scenes import random_scene

TRIALS = 40
CASES = (  # pixels [px], speed (relative), heading [rad], duration [s]
    (0.3, 0.05, 0.02, 60.0),
    (1.0, 0.1, 0.05, 60.0),
    (2.0, 0.1, 0.1, 60.0),
    (1.0, 0.1, 0.05, 20.0),
    (5.0, 0.2, 0.2, 40.0),
)


def main() -> None:
    print(
        f"{TRIALS} trials each; error of ground velocities over relative_sigma; offset error over its sigma"
    )
    print(
        f"{'px':>4} {'speed':>6} {'heading':>8} {'s':>4} {'ok':>4} {'weak':>5} {'refused':>8} "
        f"{'rms':>6} {'largest':>8} {'offset rms':>11}"
    )
    for case in CASES:
        _row(*case)


def _row(noise: float, speed_noise: float, heading_noise: float, duration: float) -> None:
    ratio, clock = [], []
    verdicts = {"ok": 0, "weak": 0, "refused": 0}
    for seed in range(TRIALS):
        rng = np.random.default_rng(seed)
        scene = random_scene(rng, tilt_deg=(0, 65))
        drive = fit_drive(scene, period=float(rng.uniform(15, 50)), ratio=int(rng.integers(2, 4)))
        offset = float(rng.uniform(-0.3, 0.3))
        tracks = see(scene, drive, np.arange(0, duration, 1 / 25), noise=noise, rng=rng)
        readings = np.arange(-1.5, duration + 1.5, 0.1)
        motion = read(
            drive,
            readings,
            form="speed",
            offset=offset,
            speed_noise=speed_noise,
            heading_noise=heading_noise,
            rng=rng,
        )
        try:
            found = calibrate(tracks, motion, speed_scale_sigma=0.0)
        except UnobservableMotionError:
            verdicts["refused"] += 1
            continue
        verdicts[found.observability.verdict] += 1
        error = velocity_map_error(scene.g, found.model, tracks.uv)
        ratio.append(error / found.observability.relative_sigma)
        clock.append((found.time_offset_s - offset) / found.time_offset_sigma_s)
    print(
        f"{noise:4} {speed_noise:6} {heading_noise:8} {duration:4.0f} {verdicts['ok']:4} {verdicts['weak']:5} "
        f"{verdicts['refused']:8} {np.sqrt(np.mean(np.square(ratio))):6.2f} {max(ratio):8.2f} "
        f"{np.sqrt(np.mean(np.square(clock))):11.2f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
