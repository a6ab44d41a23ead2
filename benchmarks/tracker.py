"""Who is who: identity switches, interruptions and accuracy of the tracker, beside well-known trackers, and its speed.

Things drive about and cross each other's ways; one in ten sightings is missing, some are false, things nearer to each
other than 20 px are seen as one, and each is hidden for a second now and then. With `--npz FILE` the sightings and the
truth come from a file: `t_s` (T,), `truth_px` (T, K, 2) with NaN where there is nothing, and for N sightings `frame`
(N,), `uv_px` (N, 2) and `sigma_px` (N,).

Peers: ByteTrack, SORT and OC-SORT of the Python library `trackers` (pip install trackers), run by the interpreter that
`--peer-python` names, as it brings another OpenCV. They track boxes: each sighting is given to them as a square of
`--box-px` around it, of confidence 0.9; of several sizes, the best for each peer is shown. Their buffer for lost tracks
is as long as ours; else they run as they come.

All are judged alike: truth and tracks are paired frame by frame within 20 px, a pair of the last frame staying a pair
while it is near enough (CLEAR MOT, Bernardin and Stiefelhagen 2008). Things are judged only while they are seen apart.
IDF1 is of Ristani et al. 2016. A track between sightings is given by ours, and not by the peers; "seen" is ours
without it.

A last table says how probable an exchange of identities was said to be, and how often there was one: somebody affirms
each track, and looks again five seconds later. `--first-seed` chooses scenes that nothing was tuned on.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker, TrackerOptions
from airground.vision.tracker.state import AMBIGUOUS
from vision.tracker.points import Detector, Scene, robots
from vision.tracker.swaps import look, unannounced

FloatArray = NDArray[np.float64]
Answer = list[tuple[list[str], FloatArray]]  # of each frame: names and positions

NEAR_PX = 20.0
PEER = """
import json, sys, numpy as np, supervision as sv, trackers
kind, side, lost, path, out = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), sys.argv[4], sys.argv[5]
import inspect, time
data = np.load(path)
cls = getattr(trackers, kind)
tracker = cls(lost_track_buffer=lost, frame_rate=float(data["rate"]))
rows, begin = [], time.perf_counter()
for k in range(int(data["frames"])):
    uv = data["uv"][data["frame"] == k]
    box = np.concatenate([uv - side / 2, uv + side / 2], axis=1).reshape(-1, 4)
    seen = sv.Detections(xyxy=box, confidence=np.full(len(uv), 0.9), class_id=np.zeros(len(uv), dtype=int))
    seen = tracker.update(seen)
    ids = seen.tracker_id if seen.tracker_id is not None else np.empty(0, dtype=int)
    middle = (seen.xyxy[:, :2] + seen.xyxy[:, 2:]) / 2
    rows.append([[int(i), float(u), float(v)] for i, (u, v) in zip(ids, middle) if i >= 0])
json.dump({"rows": rows, "seconds": time.perf_counter() - begin}, open(out, "w"))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--peer-python", help="interpreter that has the library trackers")
    parser.add_argument(
        "--peers", nargs="*", default=["ByteTrackTracker", "SORTTracker", "OCSORTTracker"]
    )
    parser.add_argument("--box-px", nargs="*", type=float, default=[20.0, 40.0, 60.0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--swap-seeds", type=int, default=10, help="scenes of the last table")
    parser.add_argument("--swap-seconds", type=float, default=20.0)
    parser.add_argument("--clutter", type=float, default=5.0, help="false sightings in a frame")
    parser.add_argument("--miss", type=float, default=0.1, help="chance that a thing is missed")
    parser.add_argument("--dropouts", type=float, default=3.0, help="of each thing in a minute")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--npz", type=Path, help="a recorded scene in place of the drawn ones")
    arguments = parser.parse_args()
    print(
        f"{'tracker':>24} {'IDSW':>6} {'frag':>6} {'false':>7} {'missed':>7} {'MOTA':>6} {'IDF1':>6} "
        f"{'rms px':>7} {'ms/frame':>9} {'worst':>7}"
    )
    detector = Detector(
        miss=arguments.miss, clutter=arguments.clutter, dropouts_per_minute=arguments.dropouts
    )
    first = arguments.first_seed
    scenes = (
        [_load(arguments.npz)]
        if arguments.npz
        else [
            robots(seed, arguments.count, arguments.seconds, detector)
            for seed in range(first, first + arguments.seeds)
        ]
    )
    figures: dict[str, list[FloatArray]] = {}
    for scene in scenes:
        for name, options in {
            "airground": TrackerOptions(),
            "airground, no hypotheses": TrackerOptions(hypotheses=1),
        }.items():
            every, seen, took = _ours(scene, options)
            times = [1e3 * float(np.mean(took)), 1e3 * float(np.max(took))]
            figures.setdefault(name, []).append(np.array([*judge(scene, every), *times]))
            figures.setdefault(f"{name}, seen", []).append(np.array([*judge(scene, seen), *times]))
        for peer in arguments.peers if arguments.peer_python else ():
            tries = [_peer(scene, arguments.peer_python, peer, side) for side in arguments.box_px]
            judged = [np.array([*judge(scene, answer), took, np.nan]) for answer, took in tries]
            best = max(range(len(judged)), key=lambda k: float(judged[k][5]))
            figures.setdefault(peer, []).append(judged[best])
    for name, rows in figures.items():
        mean = np.mean(rows, axis=0)
        print(
            f"{name:>24} {mean[0]:6.1f} {mean[1]:6.1f} {mean[2]:7.4f} {mean[3]:7.4f} {mean[4]:6.3f} "
            f"{mean[5]:6.3f} {mean[6]:7.3f} {mean[7]:9.2f} {mean[8]:7.2f}"
        )

    if arguments.swap_seeds and not arguments.npz:
        seeds = range(first, first + arguments.swap_seeds)
        _reliability(
            [robots(seed, arguments.count, arguments.swap_seconds, detector) for seed in seeds]
        )


def _reliability(scenes: list[Scene]) -> None:
    looks = [look(scene) for scene in scenes]
    stated = np.concatenate([one.stated for one in looks])
    swapped = np.concatenate([one.swapped for one in looks])
    met = np.concatenate([one.met for one in looks])
    total, silent = unannounced(looks, AMBIGUOUS)
    print(
        f"\n{len(stated)} looks, after {met.sum()} of them merged or hidden; {total} exchanges, of which "
        f"{silent} unannounced; called ambiguous without need {np.mean(stated[~swapped] > AMBIGUOUS):.1%}"
    )
    print(f"{'swap_probability':>18} {'looks':>6} {'stated':>7} {'actual':>7}")
    edges = [-1.0, 0.001, AMBIGUOUS, 0.05, 0.1, 0.2, 0.4, 1.0]
    for low, high in pairwise(edges):
        mine = (stated > low) & (stated <= high)
        if mine.any():
            print(
                f"{max(low, 0.0):8.3f} .. {high:6.3f} {mine.sum():6d} {stated[mine].mean():7.3f} "
                f"{swapped[mine].mean():7.3f}"
            )


def _ours(scene: Scene, options: TrackerOptions) -> tuple[Answer, Answer, list[float]]:
    tracker = Tracker(options)
    every, seen, took = [], [], []
    for sightings in scene.sightings:
        begin = time.perf_counter()
        state = tracker.update(sightings)
        took.append(time.perf_counter() - begin)
        names = np.array(state.names, dtype=object)
        every.append((list(names[state.confirmed]), state.uv[state.confirmed]))
        now = state.confirmed & (state.sighting >= 0)
        seen.append((list(names[now]), state.uv[now]))
    return every, seen, took[30:]


def _peer(scene: Scene, python: str, kind: str, side: float) -> tuple[Answer, float]:
    with tempfile.TemporaryDirectory() as folder:
        data, out = Path(folder) / "scene.npz", Path(folder) / "out.json"
        frame = np.repeat(np.arange(len(scene.t)), [len(s) for s in scene.sightings])
        rate = 1 / float(np.median(np.diff(scene.t)))
        lost = (
            TrackerOptions().lost_s * rate * 30 / rate
        )  # the library counts its buffer at 30 frames a second
        uv = np.concatenate([s.uv for s in scene.sightings])
        np.savez(data, frame=frame, uv=uv, frames=len(scene.t), rate=rate)
        command = [python, "-c", PEER, kind, str(side), str(round(lost)), str(data), str(out)]
        subprocess.run(command, check=True, capture_output=True)
        answer = json.loads(out.read_text("utf-8"))
    rows = [
        ([str(row[0]) for row in frame], np.array([row[1:] for row in frame]).reshape(-1, 2))
        for frame in answer["rows"]
    ]
    return rows, 1e3 * answer["seconds"] / len(rows)


def judge(scene: Scene, answer: Answer) -> tuple[float, ...]:
    """Switches, interruptions, false and missed share, MOTA, IDF1, rms."""
    from scipy.optimize import (  # type: ignore[import-untyped,unused-ignore]
        linear_sum_assignment,
    )

    count = scene.uv.shape[1]
    last: list[str | None] = [None] * count  # name that a thing had
    before: list[str | None] = [None] * count  # in the last frame
    was, switches, breaks, false, missed, squares, hits, total = (
        [False] * count,
        0,
        0,
        0,
        0,
        0.0,
        0,
        0,
    )
    together: dict[tuple[int, str], int] = {}
    lengths: dict[str, int] = {}
    for k in range(len(scene.t)):
        names, uv = answer[k]
        there = [int(j) for j in np.flatnonzero(scene.alive[k])]
        gap = np.linalg.norm(scene.uv[k, there][:, None] - uv[None], axis=-1)
        cost = np.where(gap < NEAR_PX, gap, 1e6)
        for row, thing in enumerate(there):
            name = before[thing]
            if name in names and gap[row, column := names.index(name)] < NEAR_PX:
                cost[row, column] = -1e3
        pairs = [
            (i, j) for i, j in zip(*linear_sum_assignment(cost), strict=True) if cost[i, j] < 1e5
        ]
        matched = {there[i]: int(j) for i, j in pairs}
        judged = {thing for thing in there if not scene.shared[k, thing]}
        false += len(names) - len(matched)
        total += len(judged)
        before = [None] * count
        for thing, j in matched.items():
            before[thing] = names[j]
        for thing in judged:
            if thing not in matched:
                missed += 1
                was[thing] = False
                continue
            name = names[matched[thing]]
            if last[thing] is not None and last[thing] != name:
                switches += 1
            if last[thing] is not None and not was[thing]:
                breaks += 1
            last[thing], was[thing] = name, True
            squares += float(np.sum((uv[matched[thing]] - scene.uv[k, thing]) ** 2))
            hits += 1
            together[thing, name] = together.get((thing, name), 0) + 1
        for name in names:
            lengths[name] = lengths.get(name, 0) + 1
        for thing in matched:
            if thing not in judged:
                lengths[names[matched[thing]]] -= 1
    keys = sorted(lengths)
    table = np.zeros((count, len(keys)))
    for (thing, name), number in together.items():
        table[thing, keys.index(name)] = number
    i, j = linear_sum_assignment(table, maximize=True)
    idf1 = 2 * table[i, j].sum() / (total + sum(lengths.values()))
    mota = 1 - (false + missed + switches) / total
    rms = float(np.sqrt(squares / max(2 * hits, 1)))
    return switches, breaks, false / total, missed / total, mota, idf1, rms


def _load(path: Path) -> Scene:
    data = np.load(path)
    t, truth = data["t_s"], data["truth_px"]
    sightings = [
        Sightings.round(
            float(t[k]), data["uv_px"][data["frame"] == k], data["sigma_px"][data["frame"] == k]
        )
        for k in range(len(t))
    ]
    alive = np.isfinite(truth).all(axis=-1)
    near = np.linalg.norm(truth[:, :, None] - truth[:, None], axis=-1) < Detector().merge_px
    shared = (near & ~np.eye(truth.shape[1], dtype=bool)).any(axis=-1)
    owner = [np.full(len(s), -1, dtype=np.intp) for s in sightings]
    return Scene(t, np.nan_to_num(truth), np.zeros_like(truth), sightings, owner, shared, alive)


if __name__ == "__main__":
    main()
