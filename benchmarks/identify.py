"""Which track is which robot: how often it is told, how often told wrong; and from unlabelled LEDs to a calibration.

Simulated scenes have robots, of which some give readings of a drive that is nowhere in the picture, other vehicles on
drives of the same kinds, parked ones and people; all in pieces, under meaningless names, with clocks up to a second
apart, slip, gross errors and a bent lens. "right" asks that 90 % of the sightings that got a robot's name are its.

The real rows need the recordings (AIRGROUND_DATA names their folder): `given` are the tracks that came with them;
`LEDs` go through the constellation detector, the tracker and identify. n is the error of eq. 22 after the best turn of
the ground. SCENES=10 for a short look.
"""

from __future__ import annotations

import csv
import json
import os
import time
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from airground.calibration import Identification, Motion, Tracks, calibrate, identify
from airground.geometry import align_rotation, n_error
from airground.geometry.arrays import FloatArray
from airground.records import read_motion, read_tracks
from airground.sim.recordings import Recording, RecordingNoise, RecordingPlan, record
from airground.vision.detectors.constellation import Constellation, constellation_sightings
from airground.vision.tracker import Tracker

SCENES = int(os.environ.get("SCENES", "40"))
DATA = Path(
    os.environ.get("AIRGROUND_DATA", Path(__file__).resolve().parents[2] / "shared" / "data")
)
DURATION_S = 50.0
SIZE = np.array([1280.0, 720.0])
DRIVES = ("rectangle", "lawn_mower", "eight_segments", "figure_eight", "triangle", "random_turns")
NOISE = RecordingNoise(
    pixel_px=1.0,
    speed_share=0.05,
    slip=0.03,
    heading_rad=0.02,
    heading_drift=0.005,
    lens_k1=-0.05,
    outlier_share=0.01,
    motion_hz=20.0,
    tracks_hz=15.0,
)
CAR = Constellation(np.array([[0.0, 0.01585], [0.0, -0.01585], [0.16, 0.0]]))


@dataclass(frozen=True)
class Kind:
    """A kind of scene."""

    name: str
    present: int = 1
    absent: int = 0
    others: int = 4
    pieces: int = 3
    convoy_s: float | None = None
    copies: bool = False


KINDS = (
    Kind("one robot, whole", pieces=0),
    Kind("one robot in pieces"),
    Kind("three robots in pieces", present=3, others=3),
    Kind("one there, one not", absent=1),
    Kind("two, neither there", present=0, absent=2, others=6),
    Kind("hundred other pieces", others=25, pieces=3),
    Kind("mirrored, reversed copies", copies=True),
    Kind("a convoy, 1 s behind", pieces=0, convoy_s=1.0),
    Kind("a convoy in formation", pieces=0, convoy_s=0.0),
)


class Scene:
    """Rows under meaningless names."""

    def __init__(self, kind: Kind, seed: int) -> None:
        self.rng = rng = np.random.default_rng([seed, 7])
        self.tilt_deg = float(rng.uniform(0, 60))
        self.rows: list[tuple[str, FloatArray, FloatArray]] = []
        motions: dict[str, Motion] = {}
        offset_s = float(rng.uniform(-1, 1))
        for r in range(kind.present + kind.absent):
            noise = replace(
                NOISE, time_offset_s=offset_s, heading_bias_rad=float(rng.uniform(-3, 3))
            )
            seen = self._drive(noise)
            motions[f"robot-{r + 1}"] = seen.motion
            if r >= kind.present:
                continue
            self._cut(f"robot-{r + 1}", seen.tracks.t, seen.tracks.uv, kind.pieces)
            if kind.convoy_s is not None:
                self._follow(seen, kind.convoy_s)
            if kind.copies:
                t, uv = seen.tracks.t, seen.tracks.uv
                self.rows.append(("mirrored", t, [SIZE[0] - 1, 0] + uv * [-1, 1]))
                self.rows.append(("reversed", t, uv[::-1]))
        for _ in range(kind.others):
            seen = self._drive(NOISE)
            self._cut("other", seen.tracks.t, seen.tracks.uv, kind.pieces)
        t = np.arange(0, DURATION_S, 1 / 15)
        for _ in range(5):
            place = rng.uniform([0, 0], SIZE)
            self.rows.append(("parked", t, place + rng.normal(0, 1, (len(t), 2))))
            walk = np.cumsum(np.cumsum(rng.normal(0, 1.0, (len(t), 2)), axis=0) / 15, axis=0)
            self.rows.append(("person", t, SIZE / 2 + walk + rng.normal(0, 1, walk.shape)))
        order = rng.permutation(len(self.rows))
        self.owner = {f"track-{j}": self.rows[k][0] for j, k in enumerate(order)}
        names = [f"track-{j}" for j, k in enumerate(order) for _ in self.rows[k][1]]
        self.tracks = Tracks.from_rows(
            np.concatenate([self.rows[k][1] for k in order]),
            names,
            np.concatenate([self.rows[k][2] for k in order]),
        )
        self.motion = Motion.from_rows(
            np.concatenate([m.t for m in motions.values()]),
            [name for name, m in motions.items() for _ in m.t],
            heading=np.concatenate([np.asarray(m.heading) for m in motions.values()]),
            speed=np.concatenate([np.asarray(m.speed) for m in motions.values()]),
        )

    def _drive(self, noise: RecordingNoise) -> Recording:
        rng = self.rng
        plan = RecordingPlan(
            drive=str(rng.choice(DRIVES)),
            tilt_deg=self.tilt_deg,
            duration_s=DURATION_S,
            speed_mps=float(rng.uniform(0.4, 1.0)),
            share=float(rng.uniform(0.4, 0.8)),
            corner_radius=float(rng.choice([0, 0.15])),
            turned_deg=float(rng.uniform(-180, 180)),
        )
        return record(plan, noise, seed=int(rng.integers(1 << 30)))

    def _cut(self, owner: str, t: FloatArray, uv: FloatArray, pieces: int) -> None:
        edges = np.concatenate(
            [[-1.0], np.sort(self.rng.uniform(0, DURATION_S, pieces)), [DURATION_S + 1]]
        )
        for first, last in pairwise(edges):
            mine = (t >= first + self.rng.uniform(0.3, 3.0)) & (t < last)
            if mine.sum() > 8:
                self.rows.append((owner, t[mine], uv[mine]))

    def _follow(self, seen: Recording, behind_s: float) -> None:
        truth, t = seen.truth, seen.tracks.t[seen.tracks.t > behind_s]
        xy = truth.drive.at(t - behind_s).xy + [0.0 if behind_s else 0.4, 0.0]
        uv = truth.camera.project(xy) + self.rng.normal(0, 1, (len(t), 2))
        self.rows.append(("mate", t, uv))


def main() -> None:
    print(f"{SCENES} scenes of each kind; told: answers with a confidence of 0.95 or more")
    print(
        f"{'scene':>26} {'tracks':>6} {'there':>6} {'told':>5} {'right':>5} {'not there':>9} {'told':>5} {'median':>7}"
    )
    told_all = right_all = 0
    for kind in KINDS:
        there = told = right = absent = false = tracks = 0
        times = []
        for seed in range(SCENES):
            scene = Scene(kind, seed)
            started = time.perf_counter()
            found = identify(scene.tracks, scene.motion)
            times.append(time.perf_counter() - started)
            tracks += len(scene.tracks.targets)
            here = set(scene.owner.values())
            for robot in found.robots:
                is_there = robot.robot in here
                there, absent = there + is_there, absent + (not is_there)
                if robot.identified:
                    told, false = told + is_there, false + (not is_there)
                    right += _share(scene, found, robot.robot) > 0.9
        told_all, right_all = told_all + told + false, right_all + right
        print(
            f"{kind.name:>26} {tracks / SCENES:6.0f} {there:6} {told:5} {right:5} {absent:9} {false:5} "
            f"{np.median(times):6.2f}s",
            flush=True,
        )
    print(f"of {told_all} answers {right_all} are right: {right_all / max(told_all, 1):.1%}")
    if DATA.is_dir():
        _real()


def _share(scene: Scene, found: Identification, robot: str) -> float:
    spans = found.of(robot).spans
    good = sum(s.sightings for s in spans if scene.owner[s.track] == robot)
    return good / sum(s.sightings for s in spans)


def _real() -> None:
    print(
        f"\n{'recording':>30} {'tracks':>16} {'pieces':>6} {'confidence':>10} {'sightings':>9} {'n':>7} {'clock_s':>8}"
    )
    for name in ("single_vehicle_manual_driving", "vehicle_3_a"):
        folder = DATA / "cpm_lab" / name
        truth = np.array(json.loads((folder / "truth.json").read_text())["g"])
        motion = read_motion(folder / "motion.csv")
        t, frames = _points(folder / "led_points.csv")
        for how, tracks in (
            ("given", read_tracks(folder / "tracks.csv")),
            ("LEDs, described", _tracked(t, frames, CAR)),
            ("LEDs, learned", _tracked(t, frames, None)),
        ):
            found = identify(tracks, motion)
            (robot,) = found.robots
            c = calibrate(found.tracks, motion, image_size_px=(2048, 2048))
            aligned, _ = align_rotation(truth, c.model)
            sightings = sum(s.sightings for s in robot.spans)
            print(
                f"{name:>30} {how:>16} {len(tracks.targets):6} {robot.confidence:10.4f} {sightings:9} "
                f"{float(n_error(truth, aligned)):7.4f} {c.time_offset_s:8.3f}",
                flush=True,
            )


def _points(path: Path) -> tuple[FloatArray, list[FloatArray]]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    stamp = np.array([int(row["stamp_ns"]) for row in rows])
    uv = np.array([[float(row["u_px"]), float(row["v_px"])] for row in rows])
    stamps, first = np.unique(stamp, return_index=True)
    return (stamps - stamps[0]) * 1e-9, np.split(uv, first[1:])


def _tracked(t: FloatArray, frames: list[FloatArray], pattern: Constellation | None) -> Tracks:
    tracker, rows = Tracker(), []
    for sightings in constellation_sightings(t, frames, pattern):
        state = tracker.update(sightings)
        rows += [
            (sightings.t, f"track-{track.serial}", *sightings.uv[track.sighting])
            for track in state.tracks
            if track.sighting is not None
        ]
    times, names, u, v = zip(*rows, strict=True)
    return Tracks.from_rows(times, names, np.column_stack([u, v]))


if __name__ == "__main__":
    main()
