"""Speed of the linear estimator and of a whole calibration, beside peers, in one run.

The floor of the estimator is one pass over its input, 48 bytes a sample. The peers are the same constraint solved by
NumPy's SVD of the whole system, as textbook code has it, and OpenCV's findHomography on as many point pairs.
"""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.calibration import MotionSamples, calibrate, estimate_linear
from airground.calibration.linear import linear_system
from airground.sim import calibration_drive, demo_world

if TYPE_CHECKING:
    from collections.abc import Callable


def main() -> None:
    print("estimator: median of 7 runs")
    print(
        f"{'samples':>10} {'ours':>10} {'full SVD':>10} {'ratio':>7} {'findHomography':>15} {'ratio':>7}"
    )
    for count in (8, 1_000, 30_000, 1_000_000):
        samples, xy = _samples(count)
        ours = _time(partial(estimate_linear, samples))
        svd = _time(partial(_plain_svd, samples))
        peer = _time(partial(cv2.findHomography, xy, samples.uv, 0))
        print(
            f"{count:10} {ours * 1e3:8.2f}ms {svd * 1e3:8.2f}ms {ours / svd:7.2f} "
            f"{peer * 1e3:13.2f}ms {ours / peer:7.2f}"
        )

    print("\nwhole calibration of the demo's drive (clock search, jackknife): one run each")
    print(f"{'sightings':>10} {'s':>8} {'us/sighting':>12}")
    for duration in (75.0, 750.0, 7500.0):
        drive = calibration_drive(demo_world(), np.random.default_rng(0), duration_s=duration)
        started = time.perf_counter()
        calibrate(drive.tracks, drive.motion)
        elapsed = time.perf_counter() - started
        count = len(drive.tracks)
        print(f"{count:10} {elapsed:8.2f} {elapsed / count * 1e6:12.1f}")


def _samples(count: int) -> tuple[MotionSamples, np.ndarray]:
    rng = np.random.default_rng(0)
    camera = demo_world().camera
    xy = rng.uniform([-2.0, 2.6], [2.0, 5.6], (count, 2))
    angle = rng.uniform(-np.pi, np.pi, count)
    xy_dot = 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])
    step = 1e-6
    uv = camera.project(xy)
    uv_dot = (camera.project(xy + step * xy_dot) - camera.project(xy - step * xy_dot)) / (2 * step)
    return MotionSamples(uv, uv_dot + rng.normal(0, 1, uv.shape), xy_dot), xy


def _plain_svd(samples: MotionSamples) -> object:
    return np.linalg.svd(linear_system(samples)[0], full_matrices=False)


def _time(work: Callable[[], object]) -> float:
    seconds = []
    for _ in range(7):
        started = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - started)
    return float(np.median(seconds))


if __name__ == "__main__":
    main()
