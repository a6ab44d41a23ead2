"""Speed and accuracy of the robust estimate from motion, beside OpenCV's robust homographies from points, in one run.

The same drive for all. Ours sees where the robot is, how fast it moves there and on the ground. The peers see the same
sightings and the ground positions, which a robot with a compass and an odometer does not have. The same samples are
wrong: an image velocity for ours, a sighting for the peers, anywhere in the range of the good ones. The noise is alike
in proportion: 1 px on sightings that spread over hundreds, and 0.5 % of the largest speed on image velocities.

The peers' threshold is 3 px, three deviations as ours; else they run as they come. n is the error of eq. 22, which
in pixels hardly sees the perspective; map is the error of ground velocities over the driven region.
"""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import cv2
import numpy as np

from airground.calibration import MotionSamples, estimate_robust
from airground.geometry import LimitedHomography, n_error, velocity_map_error
from airground.sim import demo_world

if TYPE_CHECKING:
    from collections.abc import Callable

_First = TypeVar("_First")
_Second = TypeVar("_Second")

SEEDS = 25
REPEATS = 3
NOISE_PX = 1.0
NOISE = 0.005  # of the largest image speed
PEERS = {"RANSAC": cv2.RANSAC, "USAC_MAGSAC": cv2.USAC_MAGSAC}


def main() -> None:
    print(f"medians over {SEEDS} drives, {REPEATS} runs of each; ratio = ours over the peer's time")
    print(
        f"{'samples':>8} {'wrong':>6} {'ours':>9} {'n':>8} {'map':>8}"
        + "".join(f" {name:>12} {'ratio':>6} {'n':>8} {'map':>8}" for name in PEERS)
    )
    for count in (1_000, 10_000):
        for wrong in (0.0, 0.3, 0.5):
            rows = np.array([_compare(count, wrong, seed) for seed in range(SEEDS)])
            (ours, n, error), *peers = np.median(rows, axis=0)
            line = f"{count:8} {wrong:6.0%} {ours * 1e3:7.2f}ms {n:8.5f} {error:8.5f}"
            for seconds, peer_n, peer_error in peers:
                line += f" {seconds * 1e3:10.2f}ms {ours / seconds:6.2f} {peer_n:8.5f} {peer_error:8.5f}"
            print(line, flush=True)


def _compare(count: int, wrong: float, seed: int) -> list[tuple[float, float, float]]:
    """Seconds, n and error of the velocities for ours and each peer."""
    rng = np.random.default_rng(seed)
    camera = demo_world().camera
    xy = rng.uniform([-2.0, 2.6], [2.0, 5.6], (count, 2))
    angle = rng.uniform(-np.pi, np.pi, count)
    xy_dot = 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])
    step = 1e-6
    clean = camera.project(xy)
    uv_dot = (camera.project(xy + step * xy_dot) - camera.project(xy - step * xy_dot)) / (2 * step)
    sigma = NOISE * float(np.abs(uv_dot).max())
    outlier = rng.permutation(count) < wrong * count

    seen = uv_dot + rng.normal(0, sigma, uv_dot.shape)
    seen[outlier] = rng.uniform(uv_dot.min(axis=0), uv_dot.max(axis=0), (outlier.sum(), 2))
    uv = clean + rng.normal(0, NOISE_PX, clean.shape)
    uv[outlier] = rng.uniform(clean.min(axis=0), clean.max(axis=0), (outlier.sum(), 2))

    truth = LimitedHomography.from_homography(camera.image_from_ground)
    samples = MotionSamples(clean, seen, xy_dot)
    results = []
    elapsed, (model, _) = _time(
        lambda: estimate_robust(samples, sigma_pxps=sigma, rng=np.random.default_rng(seed))
    )
    results.append((elapsed, float(n_error(truth, model)), velocity_map_error(truth, model, clean)))
    for method in PEERS.values():
        elapsed, (G, _) = _time(partial(cv2.findHomography, xy, uv, method, 3.0))
        errors = (np.inf, np.inf)  # it may find nothing
        if G is not None:
            peer = LimitedHomography.from_homography(G)
            errors = (float(n_error(truth, peer)), velocity_map_error(truth, peer, clean))
        results.append((elapsed, *errors))
    return results


def _time(work: Callable[[], tuple[_First, _Second]]) -> tuple[float, tuple[_First, _Second]]:
    seconds = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - started)
    return float(np.median(seconds)), result


if __name__ == "__main__":
    main()
