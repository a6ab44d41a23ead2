"""Sketches: how near the path stays to the drawing, how long it takes, and how well it is followed.

The hand's noise is 1 px on each point, and the tube 3 px. Deviations are of the noisy points from the path, largest
and root mean square; `meant` is the rms distance of the path from the line without noise. `followed` drives an ideal
unicycle along it at steps of 0.05 s, seen by the camera of the demo, and gives the rms distance of its track from the
path in the image and that of the stop from the end.
"""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np

from airground.control import Floor, Limits, RobotState
from airground.control.paths.path_follower import PathFollower
from airground.control.paths.sketch import smooth_sketch
from airground.control.paths.sketch_deviation import distances
from airground.geometry import LimitedHomography
from airground.geometry.arrays import FloatArray
from airground.sim import demo_world
from airground.sim.unicycle import arc

CAMERA = demo_world().camera
FLOOR = Floor(LimitedHomography(CAMERA.g), np.array([640.0, 400.0]))
REPEATS = 15
DT = 0.05


def main() -> None:
    print(
        f"{'sketch':>12} {'points':>7} {'robot':>6} {'time':>8} {'most px':>8} {'rms px':>7} {'meant px':>9}"
        f" {'length m':>9} {'plan s':>7} {'tick us':>8} {'followed px':>12} {'end mm':>7}"
    )
    rng = np.random.default_rng(1)
    angle = np.linspace(0, 2 * np.pi, 20001)
    lines = {
        "ellipse": np.column_stack([640 + 300 * np.cos(angle), 420 + 180 * np.sin(angle)]),
        "eight": np.column_stack([640 + 350 * np.sin(angle), 420 + 150 * np.sin(2 * angle)]),
        "corners": _through([(200, 600), (700, 560), (680, 250), (1100, 300)]),
        "zigzag": _through([(200, 600), (800, 500), (220, 450), (900, 330)]),
    }
    for name, line in lines.items():
        for count, limits in (
            (1000, Limits()),
            (1000, Limits(turn_radius_m=0.3)),
            (5000, Limits()),
        ):
            _row(name, line, count, limits, rng)


def _through(corners: list[tuple[int, int]]) -> FloatArray:
    c = np.array(corners, dtype=np.float64)
    return np.concatenate([np.linspace(a, b, 4000) for a, b in pairwise(c)])


def _row(name: str, line: FloatArray, count: int, limits: Limits, rng: np.random.Generator) -> None:
    places = np.sort(rng.choice(len(line), count, replace=False))
    uv = line[places] + rng.normal(0, 1.0, (count, 2))
    seconds = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        path = smooth_sketch(FLOOR, uv, limits)
        seconds.append(time.perf_counter() - started)
    meant = float(np.sqrt(np.mean(distances(path.uv, line[::8]) ** 2)))
    follower = PathFollower(path, limits)
    xy, theta, progress, v, omega = (
        CAMERA.unproject(path.uv[0]),
        float(path.theta[0]),
        0.0,
        0.0,
        0.0,
    )
    track, ticks = [], []
    for k in range(int(2 * path.duration / DT) + 200):
        state = RobotState(k * DT, CAMERA.project(xy), theta, v, omega)
        started = time.perf_counter()
        guidance = follower.step(state, progress, DT)
        ticks.append(time.perf_counter() - started)
        track.append(state.uv)
        if guidance.done or guidance.trouble:
            break
        progress, v, omega = guidance.progress, guidance.command.v, guidance.command.omega
        xy, theta = xy + arc(theta, v, omega, DT), theta + omega * DT
    followed = float(np.sqrt(np.mean(distances(np.array(track), path.uv) ** 2)))
    end = float(np.hypot(*(xy - CAMERA.unproject(path.uv[-1]))))
    print(
        f"{name:>12} {count:7} {'car' if limits.turn_radius_m else 'spot':>6} {np.median(seconds) * 1e3:6.1f}ms"
        f" {path.max_deviation_px:8.2f} {path.rms_deviation_px:7.2f} {meant:9.2f} {path.length:9.2f}"
        f" {path.duration:7.1f} {np.median(ticks) * 1e6:8.1f} {followed:12.3f} {end * 1e3:7.1f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
