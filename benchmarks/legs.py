"""Legs that a robot drives before there is a calibration: how many, how far, how long, how well, and never out of view.

    python benchmarks/legs.py [starts per row]

Robots start anywhere in view, or at the edge of it heading out. Legs are scripted until the online calibrator has an
answer, and those of `next_leg` from then on. `seen` is the number of legs until `good_enough(0.05)`, which is about the
places that were driven; `legs`, metres and seconds are until ground velocities are known to 5 % over the whole image by
`Leg.relative_sigma`, or 16 legs. n error and error of velocities over the image are in truth, then. Odometers are off
by 2 % that changes over 4 s, their readings are 50 ms late, pictures 130 ms, of which 50 ms are not in their stamps.
Medians, but for what is marked.
"""

from __future__ import annotations

import sys
from math import degrees
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from airground.control import Limits, SafetyMemory
from airground.control.legs import DriveLeg, LegDriver
from airground.geometry import n_error, velocity_map_error
from airground.sim import SimCamera
from leg_loop import LegLoop, World, ceiling, jacobian, mirrored, start_in, tilted

CAR = Limits(turn_radius_m=0.7)
ROWS = {
    "tilt 55": (tilted(), "differential", Limits(), False),
    "tilt 55, edge": (tilted(), "differential", Limits(), True),
    "ceiling": (ceiling(), "differential", Limits(), False),
    "ceiling, edge": (ceiling(), "differential", Limits(), True),
    "clockwise, edge": (mirrored(tilted()), "unicycle", Limits(), True),
    "no reverse, edge": (tilted(), "differential", Limits(reverse_mps=0.0), True),
    "car, tilt 55": (tilted(), "ackermann", CAR, False),
    "car, ceiling": (ceiling(), "ackermann", CAR, False),
    "omni, ceiling": (ceiling(), "omni", Limits(), True),
}
MOST = 16


class Result(NamedTuple):
    """Of one start."""

    enough: bool
    seen: int
    legs: int
    metres: float
    seconds: float
    n: float
    off: float
    aborted: int
    closest_px: float
    short_m: float
    turned_deg: float
    stops: int


def places(camera: SimCamera) -> np.ndarray:
    """Ground in the image that is not too far away."""
    width, height = camera.image_size_px
    u, v = np.meshgrid(np.linspace(60, width - 60, 7), np.linspace(60, height - 60, 5))
    uv = np.stack([u, v], axis=-1).reshape(-1, 2)
    xy = camera.unproject(uv)
    keep = np.isfinite(xy).all(axis=1)
    scale = np.array([np.linalg.svd(jacobian(camera, one), compute_uv=False)[0] for one in xy])
    return np.asarray(uv[keep & (scale > 0.1 * scale[keep].max())])


def run(name: str, seed: int) -> Result:
    """One calibration drive."""
    camera, kind, limits, edge = ROWS[name]
    xy, theta = start_in(camera, np.random.default_rng([seed, 7]), edge=edge)
    loop = LegLoop(World(camera, xy, theta, seed, kind, limits))  # type: ignore[arg-type]
    enough, seen = False, MOST
    for k in range(MOST):
        if loop.leg() is None:
            break
        if seen == MOST and loop.calibrator.good_enough(0.05):
            seen = k + 1
        loop.guided()
        if loop.image_sigma <= loop.wanted_sigma:
            enough = True
            break
    found = loop.calibrator.calibration()
    good = [leg for leg in loop.ended if leg.whole]
    return Result(
        enough,
        seen,
        len(loop.ended),
        loop.path_m,
        loop.t,
        np.inf if found is None else float(n_error(camera.g, found.model)),
        np.inf if found is None else velocity_map_error(camera.g, found.model, places(camera)),
        sum(not leg.whole for leg in loop.ended),
        loop.closest_px,
        max((abs(leg.length_m - leg.wanted.length_m) for leg in good), default=0.0),
        max((abs(degrees(leg.heading_error_rad)) for leg in good), default=0.0),
        len(loop.stops),
    )


def ticks_us() -> tuple[float, float]:
    """Driver and safety, for one tick of a robot that drives: medians."""
    camera = tilted()
    xy, theta = start_in(camera, np.random.default_rng(1))
    loop = LegLoop(World(camera, xy, theta, 1))
    for _ in range(3):
        loop.leg()
    driver, memory = LegDriver(Limits()), SafetyMemory()
    driver.give(DriveLeg(theta, 50.0))
    spent = []
    for told, _, situation in loop.log:
        a = perf_counter()
        said = driver.tick(told)
        b = perf_counter()
        memory = loop.safety.check(said.command, situation, memory).memory
        spent.append((b - a, perf_counter() - b))
    a, b = (1e6 * np.median(spent, axis=0)).tolist()
    return a, b


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    print(
        f"{'':18} enough  seen legs    m    s  n error  off  aborted  closest px (worst)  "
        "length off cm, heading off deg (90 %)  stops"
    )
    for name in ROWS:
        all_of = [run(name, seed) for seed in range(count)]
        middle = Result(*np.median(np.array(all_of, dtype=float), axis=0))
        print(
            f"{name:18} {sum(r.enough for r in all_of):3}/{count:<3} {middle.seen:4.0f} "
            f"{middle.legs:4.0f} {middle.metres:4.1f} {middle.seconds:4.0f} {middle.n:7.3f} "
            f"{middle.off:6.3f} {sum(r.aborted for r in all_of):5} "
            f"{min(r.closest_px for r in all_of):10.0f} "
            f"{100 * np.quantile([r.short_m for r in all_of], 0.9):14.1f} "
            f"{np.quantile([r.turned_deg for r in all_of], 0.9):8.1f} "
            f"{sum(r.stops for r in all_of):18}",
            flush=True,
        )
    print("tick: driver {:.0f} us, safety {:.0f} us".format(*ticks_us()))


if __name__ == "__main__":
    main()
