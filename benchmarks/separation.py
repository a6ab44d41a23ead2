"""Ten robots cross a fenced floor with obstacles: kept apart by the separation filter, or not.

Random scenes. Robots are unicycles that reach their commands by acceleration within each step, driven in exact arcs of
5 ms; between them, and with corners of fence and obstacles, contact is looked for at each of these. What
drives them to their goals knows nothing of other robots: it follows the planner's way round the obstacles. In a
share of the scenes the filter sees positions with noise, and knows its deviation. The same scenes without a filter say
what they are like. Times are those of the filter's step, in CPU seconds of this process.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass
from math import atan2, cos, hypot, pi
from multiprocessing import get_context

import numpy as np
from shapely import Polygon, distance, points  # type: ignore[import-untyped]

from airground.control import Floor, Limits, VelocityCommand
from airground.control.separation.fence import Fence
from airground.control.separation.filter import SeparationFilter
from airground.control.separation.planner import WayPlanner
from airground.control.separation.types import Body
from airground.errors import NoWayError
from airground.geometry import LimitedHomography
from airground.geometry.arrays import FloatArray
from airground.sim import SimCamera
from airground.sim.unicycle import arc

RADIUS = 0.2
HALF = 3.0  # [m] of the fenced square
DT, SUBSTEP = 0.1, 0.005
NOISE = 0.02  # [m]
NEAR = 0.1  # [m] from the goal
LIMITS = Limits()


@dataclass
class Scene:
    """What is there at the start."""

    fence: Fence
    inner: Polygon
    obstacles: list[Polygon]
    start: FloatArray
    theta: FloatArray
    goal: FloatArray
    noise: float


@dataclass
class Outcome:
    """What came of it."""

    contacts: int
    crossings: int
    closest: float
    arrived: int
    count: int
    seconds: list[float]
    ticks: list[float]
    track: FloatArray


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene")
    args = parser.parse_args()
    seeds = range(args.first, args.first + args.scenes)
    work = [(seed, args.robots) for seed in seeds]
    with get_context("spawn").Pool(args.jobs) as pool:
        rows = []
        for k, row in enumerate(pool.imap_unordered(_one, work, chunksize=2)):
            rows.append(row)
            if (k + 1) % 100 == 0:
                print(f"{k + 1} scenes", flush=True)
    rows.sort(key=lambda row: row[0])
    _report(rows, args.robots)


def _report(rows: list[tuple[int, bool, Outcome, Outcome]], robots: int) -> None:
    print(
        f"{len(rows)} scenes, {robots} robots of radius {RADIUS} m in {2 * HALF} m x {2 * HALF} m"
    )
    for title, pick in (("exact positions", False), ("2 cm of noise", True)):
        some = [row for row in rows if row[1] == pick]
        if not some:
            continue
        ours = [row[2] for row in some]
        bare = [row[3] for row in some]
        every = sum(o.arrived == o.count for o in ours)
        reached = sum(o.arrived for o in ours) / sum(o.count for o in ours)
        extra = [
            a - b
            for o, free in zip(ours, bare, strict=True)
            for a, b in zip(o.seconds, free.seconds, strict=True)
            if np.isfinite(a) and np.isfinite(b)
        ]
        plain = np.mean([b for free in bare for b in free.seconds if np.isfinite(b)])
        print(f"{title}: {len(some)} scenes, {robots} robots each")
        for name, count in (
            ("scenes with contact", [sum(o.contacts > 0 for o in all_) for all_ in (ours, bare)]),
            (
                "scenes over a boundary",
                [sum(o.crossings > 0 for o in all_) for all_ in (ours, bare)],
            ),
        ):
            print(f"  {name:26} {count[0]:6}   without filter {count[1]}")
        print(f"  closest over r_i + r_j     {min(o.closest for o in ours) * 1e3:6.1f} mm")
        print(f"  scenes in which all arrive {every / len(some):6.1%}   robots {reached:.2%}")
        print(f"  mean extra time            {np.mean(extra):6.2f} s on {plain:.2f} s")
        stuck = [row[0] for row in some if row[2].arrived < row[2].count]
        print(f"  seeds with robots left     {stuck[:20]}")
    ticks = np.concatenate([row[2].ticks for row in rows]) * 1e3
    load = os.getloadavg()[0]
    print(
        f"filter per step, CPU time: median {np.median(ticks):.2f} ms, "
        f"99 % {np.percentile(ticks, 99):.2f} ms (load {load:.1f} on {os.cpu_count()} cores)"
    )


def _one(work: tuple[int, int]) -> tuple[int, bool, Outcome, Outcome]:
    seed, robots = work
    scene = random_scene(seed, robots)
    ours = drive(scene, SeparationFilter(scene.fence), seed)
    bare = drive(scene, None, seed)
    return seed, scene.noise > 0, ours, bare


def random_scene(seed: int, robots: int = 10) -> Scene:
    """Starts and goals on opposite parts of a square with up to three obstacles, all reachable."""
    rng = np.random.default_rng(seed)
    camera = SimCamera.looking_down(
        focal_length_px=900.0, tilt_rad=0.5, height_m=12.0, image_size_px=(1280, 960)
    )
    centre = camera.unproject(np.array([640.0, 480.0]))
    floor = Floor(LimitedHomography(camera.g), np.array([640.0, 480.0]))
    square = HALF * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    while True:
        rings = []
        for _ in range(rng.integers(0, 4)):
            angle = np.sort(rng.uniform(0, 2 * pi, rng.integers(3, 6)))
            size = rng.uniform(0.3, 0.7)
            middle = rng.uniform(-1.6, 1.6, 2)
            rings.append(middle + size * np.column_stack([np.cos(angle), np.sin(angle)]))
        if any(Polygon(r).area < 0.08 for r in rings):
            continue
        fence = Fence(
            floor,
            (camera.project(square + centre),),
            tuple(camera.project(ring + centre) for ring in rings),
        )
        places = _places(rng, fence, robots)
        if places is None:
            continue
        start, goal = places
        planner = WayPlanner(fence, RADIUS + 0.1)
        try:
            for a, b in zip(start, goal, strict=True):
                planner.way(floor.pixel(a), floor.pixel(b))
        except NoWayError:
            continue
        noise = NOISE if rng.random() < 0.3 else 0.0
        theta = rng.uniform(-pi, pi, robots)
        return Scene(fence, Polygon(square), [Polygon(r) for r in rings], start, theta, goal, noise)


def _places(
    rng: np.random.Generator, fence: Fence, robots: int
) -> tuple[FloatArray, FloatArray] | None:
    apart = 2 * RADIUS + 0.3
    sets: list[FloatArray] = []
    for _ in range(2):
        chosen: list[FloatArray] = []
        for _ in range(4000):
            xy = rng.uniform(-HALF, HALF, 2)
            if not fence.inside(xy, RADIUS + 0.25):
                continue
            if len(sets) == 1 and hypot(*(xy - sets[0][len(chosen)])) < HALF:
                continue  # a goal across the floor
            if all(hypot(*(xy - other)) > apart for other in chosen):
                chosen.append(xy)
            if len(chosen) == robots:
                break
        else:
            return None
        sets.append(np.array(chosen))
    return sets[0], sets[1]


class Driver:
    """Drives along planned ways to the goals, as if alone; plans again now and then."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.planner = WayPlanner(scene.fence, RADIUS + 0.1)
        self.ways: list[FloatArray] = [np.empty((0, 2))] * len(scene.start)

    def wanted(
        self, k: int, xy: FloatArray, theta: float, tick: int
    ) -> tuple[VelocityCommand, tuple[float, float]]:
        """What robot k shall do, and the place that it is on the way to."""
        goal = self.scene.goal[k]
        if hypot(*(goal - xy)) < NEAR / 2:
            return VelocityCommand(0.0, 0.0), (float(goal[0]), float(goal[1]))
        aim = goal
        if self.scene.obstacles:
            if (tick + k) % 10 == 0 or not len(self.ways[k]):
                floor = self.scene.fence.floor
                try:
                    way = floor.position(self.planner.way(floor.pixel(xy), floor.pixel(goal)))
                except NoWayError:
                    way = np.stack([xy, goal])
                self.ways[k] = way[1:]
            while len(self.ways[k]) > 1 and hypot(*(self.ways[k][0] - xy)) < 0.15:
                self.ways[k] = self.ways[k][1:]
            aim = self.ways[k][0]
        away = (atan2(*(aim - xy)[::-1]) - theta + pi) % (2 * pi) - pi
        pace = min(LIMITS.speed_mps, 0.9 * hypot(*(goal - xy))) * max(0.0, cos(away))
        command = VelocityCommand(pace, float(np.clip(2.0 * away, -1.5, 1.5)))
        return command, (float(aim[0]), float(aim[1]))


def drive(
    scene: Scene, guard: SeparationFilter | None, seed: int, limit_s: float = 60.0
) -> Outcome:
    """Drive until all have arrived, or the time is over."""
    rng = np.random.default_rng(seed + 1_000_000)
    count = len(scene.start)
    xy, theta = scene.start.copy(), scene.theta.copy()
    v, omega = np.zeros(count), np.zeros(count)
    driver = Driver(scene)
    contacts = crossings = 0
    closest = np.inf
    seconds = np.full(count, np.inf)
    ticks, track = [], []
    i, j = np.triu_indices(count, 1)
    for tick in range(round(limit_s / DT)):
        seen = xy + rng.normal(0.0, 1.0, xy.shape) * scene.noise
        each = [driver.wanted(k, seen[k], float(theta[k]), tick) for k in range(count)]
        told, aims = [command for command, _ in each], [aim for _, aim in each]
        if guard is not None:
            bodies = [
                Body(
                    tuple(seen[k].tolist()), float(theta[k]), float(v[k]), float(omega[k]),
                    radius_m=RADIUS, sigma_m=scene.noise, limits=LIMITS,
                )
                for k in range(count)
            ]  # fmt: skip
            begun = time.process_time()
            told = list(guard.step(bodies, told, DT, aims=aims).commands)
            ticks.append(time.process_time() - begun)
        want = np.array([(c.v, c.omega) for c in told])
        places, theta, v, omega = _steps(xy, theta, (v, omega), want)
        xy = places[-1]
        gap = np.hypot(*(places[:, i] - places[:, j]).transpose(2, 0, 1)) - 2 * RADIUS
        closest = min(closest, float(gap.min()))
        contacts += int((gap.min(axis=0) < 0).sum())
        crossings += _crossings(scene, places)
        track.append(np.column_stack([xy, theta, v, omega]))
        there = np.hypot(*(xy - scene.goal).T) < NEAR
        seconds[there & np.isinf(seconds)] = (tick + 1) * DT
        if there.all() and (np.abs(v) < 0.05).all():
            break
    return Outcome(
        contacts,
        crossings,
        closest,
        int(there.sum()),
        count,
        seconds.tolist(),
        ticks,
        np.array(track),
    )


def _steps(
    xy: FloatArray, theta: FloatArray, speeds: tuple[FloatArray, FloatArray], want: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Positions at all substeps of a step; headings and speeds at its end."""
    v, omega = speeds
    passed = SUBSTEP * np.arange(round(DT / SUBSTEP) + 1)[:, None]
    faster = np.abs(want[:, 0]) > np.abs(v)
    rate = np.where(faster, LIMITS.acceleration_mps2, LIMITS.deceleration_mps2) * passed
    turn = LIMITS.turn_acceleration_radps2 * passed
    vs = v + np.clip(want[:, 0] - v, -rate, rate)
    omegas = omega + np.clip(want[:, 1] - omega, -turn, turn)
    mean_v, mean_omega = (vs[1:] + vs[:-1]) / 2, (omegas[1:] + omegas[:-1]) / 2
    thetas = theta + np.cumsum(np.vstack([np.zeros_like(theta), mean_omega * SUBSTEP]), axis=0)
    moved = arc(thetas[:-1], mean_v, mean_omega, SUBSTEP)
    return xy + np.cumsum(moved, axis=0), thetas[-1], vs[-1], omegas[-1]


def _crossings(scene: Scene, places: FloatArray) -> int:
    """Robots whose disc leaves the square or meets an obstacle."""
    bad = (np.abs(places) > HALF - RADIUS).any(axis=(0, 2))
    spots = points(places)
    for ring in scene.obstacles:
        bad |= (distance(ring, spots) < RADIUS).any(axis=0)
    return int(bad.sum())


if __name__ == "__main__":
    main()
