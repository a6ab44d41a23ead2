"""Who is who when robots hide each other: identity switches on rendered images, beside well-known trackers.

Twenty robots that look alike drive about as unicycles whose turn rate and speed wander; they steer clear of each other
late, and push each other where they touch, so that they pass closely all the time; with `--bumps` they do so as hard as
stones, and else within a tenth of a second. No tags: identity comes from motion
only. `soccer_scene` is not used, as its robots never come nearer than 0.4 m, twice their size. Two views of 1280x720: a
camera at the ceiling, where robots touch, and one that looks down at 55 degrees from straight down, where they hide
each other and pass behind two pillars.

Two detectors see the same images. `moving` suits what the scene shows: it knows nothing of the robots, and two that
touch in the image are one to it. `blob` looks for the red disc in the middle of each roof, 0.08 m across: discs never
touch, and only the pillars hide them. Sightings are made once, kept in `--npz FOLDER` if that is given, and are the
same for all trackers.

Peers: ByteTrack, SORT and OC-SORT of the Python library `trackers`, run by the interpreter that `--peer-python` names.
They get the upright box around each sighting's outline, of confidence 0.9, as it is and enlarged two and four times
about its middle; the size that gives the best IDF1 is shown. Their position is that of the sighting. Their buffer for
lost tracks is as long as ours; else they run as they come.

Truth is the middle of what a robot covers in the image, hidden parts included (`moving`), or of its disc (`blob`). All
trackers are judged as in benchmarks/tracker.py, things only while they are seen apart; the last columns judge them all
the time, hidden or not. "seen" is ours without what it gives between sightings, as the peers do.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.tracker import Answer, judge

from airground.sim import Disc, Pinhole, Scene, Sun, WorldCamera, ground
from airground.sim.body_kinds import pillar, round_outline, round_robot
from airground.sim.body_poses import parked
from airground.vision.detectors.registry import make_detector
from airground.vision.overlay import Overlay
from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker, TrackerOptions
from vision.tracker.points import Scene as Watched

if TYPE_CHECKING:
    from airground.sim.body_poses import PoseOfTime

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

RATE_HZ = 30.0
RADIUS_M, HEIGHT_M, DISC_M = 0.09, 0.14, 0.04
APART_PX = 8.0  # the detector of moving things closes gaps of 7 px
DETECTORS = {"moving": "moving", "blob": "blob:color=red"}
GROW = (1.0, 2.0, 4.0)  # of the peers' boxes
BUMP_S = 0.06  # how long robots that bump into each other take to change their ways
PILLAR_M = 0.06, 0.9  # radius and height
PEER = """
import json, sys, time, numpy as np, supervision as sv, trackers
lost, path, out, kinds = int(sys.argv[1]), sys.argv[2], sys.argv[3], sys.argv[4:]
data = dict(np.load(path))
frames, middle, half, answers = int(data["frames"]), data["middle"], data["half"], []
for kind, grow in [(kind, grow) for kind in kinds for grow in data["grow"].tolist()]:
    tracker = getattr(trackers, kind)(lost_track_buffer=lost, frame_rate=float(data["rate"]))
    boxes = np.concatenate([middle - grow * half, middle + grow * half], axis=1).reshape(-1, 4)
    rows, begin = [], time.perf_counter()
    for k in range(frames):
        box = boxes[data["frame"] == k]
        count = len(box)
        seen = sv.Detections(xyxy=box, confidence=np.full(count, 0.9), class_id=np.zeros(count, dtype=int),
                             data={"row": np.arange(count)})
        seen = tracker.update(seen)
        ids = seen.tracker_id if seen.tracker_id is not None else np.empty(0, dtype=int)
        rows.append([[int(i), int(row)] for i, row in zip(ids, seen.data.get("row", [])) if i >= 0])
    answers.append({"kind": kind, "rows": rows, "seconds": time.perf_counter() - begin})
json.dump(answers, open(out, "w"))
"""


class View(NamedTuple):
    """A camera, and where robots drive before it."""

    camera: Pinhole
    middle_m: tuple[float, float]
    half_m: tuple[float, float]
    pillars_m: tuple[tuple[float, float], ...]


VIEWS = {
    "ceiling": View(
        Pinhole.looking_down(
            focal_length_px=900.0,
            tilt_rad=np.radians(4),
            height_m=4.3,
            image_size_px=(1280, 720),
            heading_rad=np.pi / 2,
        ),
        (0.0, 0.3),
        (2.6, 1.3),
        (),
    ),
    "oblique": View(
        Pinhole.looking_down(
            focal_length_px=800.0,
            tilt_rad=np.radians(55),
            height_m=3.0,
            image_size_px=(1280, 720),
            heading_rad=np.pi / 2,
        ),
        (0.0, 4.0),
        (2.2, 1.8),
        ((-0.7, 3.3), (0.9, 4.2)),
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--peer-python", help="interpreter that has the library trackers")
    parser.add_argument(
        "--peers", nargs="*", default=["ByteTrackTracker", "SORTTracker", "OCSORTTracker"]
    )
    parser.add_argument("--views", nargs="*", default=list(VIEWS), choices=list(VIEWS))
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--bumps", action="store_true", help="robots bump as hard as stones")
    parser.add_argument("--npz", type=Path, help="folder that keeps the sightings")
    parser.add_argument("--prepare", action="store_true", help="only make the sightings")
    parser.add_argument("--picture", type=Path, help="a frame with its tracks, to look at")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.npz or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for name in arguments.views:
            paths = [_prepared(folder, name, seed, arguments) for seed in range(arguments.seeds)]
            for detector in () if arguments.prepare else DETECTORS:
                _compare(name, detector, paths, arguments)
            if arguments.picture:
                out = arguments.picture.with_stem(f"{arguments.picture.stem}-{name}")
                _draw(name, paths[0], arguments, out)


def _compare(view: str, detector: str, paths: list[Path], arguments: argparse.Namespace) -> None:
    figures: dict[str, list[list[float]]] = {}
    passes: list[FloatArray] = []
    for path in paths:
        scene, seen_of_all, counts = _load(path, detector)
        passes.append(counts)
        hard = Watched(
            scene.t,
            scene.uv,
            scene.uv_dot,
            scene.sightings,
            [],
            np.zeros_like(scene.shared),
            scene.alive,
        )

        def note(name: str, answer: Answer, took: float, easy=scene, all_=hard) -> None:  # type: ignore[no-untyped-def]
            always = judge(all_, answer)
            row = [*judge(easy, answer), always[3], always[4], always[5], took]
            figures.setdefault(name, []).append(row)

        for name, options in {
            "airground": TrackerOptions(),
            "airground, no hypotheses": TrackerOptions(hypotheses=1),
        }.items():
            every, seen, took = _ours(scene, options)
            note(name, every, took)
            note(f"{name}, seen", seen, took)
        if arguments.peer_python and arguments.peers:
            for peer, tries in _peers(scene, arguments.peer_python, arguments.peers).items():
                best = max(tries, key=lambda found: judge(scene, found[0])[5])
                note(peer, *best)
    total, overlaps, behind, apart = np.sum(passes, axis=0)
    print(
        f"\n{view}, detector {detector}: {len(paths)} x {arguments.seconds:.0f} s, {arguments.count} robots; "
        f"{total:.0f} close passes (gap < {APART_PX:.0f} px), {overlaps:.0f} of them overlap, "
        f"{behind:.0f} times behind a pillar; apart {apart / len(paths):.0%} of the time; "
        f"{seen_of_all / scene.uv.shape[1]:.1%} of sightings to robots in the last"
    )
    print(
        f"{'tracker':>30} {'IDSW':>6} {'frag':>6} {'false':>7} {'missed':>7} {'MOTA':>6} {'IDF1':>6} {'rms px':>7}"
        f" | {'missed':>7} {'MOTA':>6} {'IDF1':>6} | {'ms/frame':>8}"
    )
    for name, rows in figures.items():
        m = np.mean(rows, axis=0)
        print(
            f"{name:>30} {m[0]:6.1f} {m[1]:6.1f} {m[2]:7.4f} {m[3]:7.4f} {m[4]:6.3f} {m[5]:6.3f} {m[6]:7.3f}"
            f" | {m[7]:7.4f} {m[8]:6.3f} {m[9]:6.3f} | {m[10]:8.2f}",
            flush=True,
        )


def _ours(scene: Watched, options: TrackerOptions) -> tuple[Answer, Answer, float]:
    tracker = Tracker(options)
    every: Answer = []
    seen: Answer = []
    begin = time.perf_counter()
    for sightings in scene.sightings:
        state = tracker.update(sightings)
        names = np.array(state.names, dtype=object)
        every.append((list(names[state.confirmed]), state.uv[state.confirmed]))
        now = state.confirmed & (state.sighting >= 0)
        seen.append((list(names[now]), state.uv[now]))
    return every, seen, 1e3 * (time.perf_counter() - begin) / len(scene.t)


def _peers(scene: Watched, python: str, kinds: list[str]) -> dict[str, list[tuple[Answer, float]]]:
    """Of each peer: its answers and milliseconds a frame, for each size of the boxes."""
    frame = np.repeat(np.arange(len(scene.t)), [len(s) for s in scene.sightings])
    outline = np.concatenate([s.outline for s in scene.sightings])
    low, high = outline.min(axis=1), outline.max(axis=1)
    lost = round(TrackerOptions().lost_s * 30)  # the library counts it at 30 frames a second
    with tempfile.TemporaryDirectory() as folder:
        data, out = Path(folder) / "boxes.npz", Path(folder) / "out.json"
        np.savez(
            data,
            frame=frame,
            middle=(low + high) / 2,
            half=(high - low) / 2,
            grow=np.array(GROW),
            frames=len(scene.t),
            rate=RATE_HZ,
        )
        command = [python, "-c", PEER, str(lost), str(data), str(out), *kinds]
        subprocess.run(command, check=True, capture_output=True)
        answers = json.loads(out.read_text("utf-8"))
    found: dict[str, list[tuple[Answer, float]]] = {}
    for answer in answers:
        rows = [
            ([str(i) for i, _ in pairs], np.array([s.uv[row] for _, row in pairs]).reshape(-1, 2))
            for pairs, s in zip(answer["rows"], scene.sightings, strict=True)
        ]
        took = 1e3 * answer["seconds"] / len(rows)
        found.setdefault(answer["kind"], []).append((rows, took))
    return found


def _scene(view: View, seed: int, arguments: argparse.Namespace) -> Scene:
    rng = np.random.default_rng([seed, 0xC2])
    poses = _drives(view, rng, arguments.count, arguments.seconds, bumps=arguments.bumps)
    disc = Disc(DISC_M, (40.0, 40.0, 200.0))
    bodies = [round_robot(f"robot-{k + 1}", pose, disc) for k, pose in enumerate(poses)]
    bodies += [
        pillar(
            f"pillar-{k + 1}",
            parked(*xy),
            radius_m=PILLAR_M[0],
            height_m=PILLAR_M[1],
            colour=(120.0, 125.0, 120.0),
        )
        for k, xy in enumerate(view.pillars_m)
    ]
    return Scene(
        camera=view.camera,
        ground=ground("carpet", seed=seed, tile_m=4.0, texel_m=0.004),
        bodies=tuple(bodies),
        sun=Sun(azimuth_rad=0.5, elevation_rad=1.2, shadow=0.3, softness=0.2),
        exposure_s=0.004,
    )


def _drives(
    view: View, rng: np.random.Generator, count: int, seconds: float, *, bumps: bool
) -> list[PoseOfTime]:
    """Wandering unicycles that steer clear of each other within 0.35 m, and cannot pass through each other."""
    from scipy.ndimage import (  # type: ignore[import-untyped,unused-ignore]
        gaussian_filter1d,
    )

    step, usual = 0.01, 0.45
    half, middle = np.array(view.half_m), np.array(view.middle_m)
    posts = np.array(view.pillars_m).reshape(-1, 2) - middle
    t = np.arange(-1.0, seconds + 1.0, step)
    columns = int(np.ceil(np.sqrt(count * half[0] / half[1])))
    rows = -(-count // columns)
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    xy = (((grid + 0.5) / [columns, rows] - 0.5) * 1.8 * half)[rng.permutation(len(grid))[:count]]
    heading, turn = rng.uniform(-np.pi, np.pi, count), rng.normal(0, 1.0, count)
    wanted = rng.uniform(0.5, 1.2, count) * usual
    speed = wanted.copy()
    places, headings = np.empty((len(t), count, 2)), np.empty((len(t), count))
    for k in range(len(t)):
        turn += -turn * step / 0.7 + np.sqrt(2 * step / 0.7) * rng.normal(size=count)
        change = rng.random(count) < step / 3.0
        fresh = rng.uniform(0.5, 1.2, count) * usual * (rng.random(count) > 0.15)
        wanted = np.where(change, fresh, wanted)
        others = np.concatenate([xy, posts])
        reach = np.concatenate([np.full(count, RADIUS_M), np.full(len(posts), PILLAR_M[0])])
        off = others[None] - xy[:, None]
        gap = np.hypot(*np.moveaxis(off, -1, 0))
        gap[range(count), range(count)] = np.inf
        aside = _wrapped(np.arctan2(off[..., 1], off[..., 0]) - heading[:, None])
        near = np.clip((0.35 - gap) / 0.15, 0, 1) * (np.abs(aside) < 1.6)
        avoid = -4.0 * (near * np.where(aside >= 0, 1.0, -1.0)).sum(axis=1)
        outside = (np.abs(xy) > 0.9 * half).any(axis=1)
        home = _wrapped(np.arctan2(-xy[:, 1], -xy[:, 0]) - heading)
        heading += step * (np.where(outside, 2.5 * np.sign(home), turn) + avoid)
        aim = np.where(near.any(axis=1), np.maximum(wanted, 0.5 * usual), wanted)
        speed += np.clip(aim - speed, -2 * usual * step, 2 * usual * step)
        xy = xy + step * speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
        touch = reach[None] + RADIUS_M + 0.01
        into = np.clip(touch - gap, 0, None) + step * 0.25 * np.clip(1 + (touch - gap) / 0.05, 0, 1)
        share = np.where(np.arange(len(others)) < count, 0.5, 1.0)
        xy -= ((share * into / gap)[..., None] * off).sum(axis=1)
        xy = np.clip(xy, -half, half)
        places[k], headings[k] = xy + middle, heading
    if not bumps:
        places = gaussian_filter1d(places, BUMP_S / step, axis=0, mode="nearest")
    return [_pose(t, places[:, k], headings[:, k]) for k in range(count)]


def _pose(t: FloatArray, xy: FloatArray, theta: FloatArray) -> PoseOfTime:
    def pose(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        u, v = np.interp(at, t, xy[:, 0]), np.interp(at, t, xy[:, 1])
        return np.column_stack([u, v]), np.interp(at, t, theta)

    return pose


def _wrapped(angle: FloatArray) -> FloatArray:
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)


def _prepared(folder: Path, view: str, seed: int, arguments: argparse.Namespace) -> Path:
    """Sightings and truth of a scene, made if they are not there yet."""
    seconds, count = arguments.seconds, arguments.count
    bumps = "-bumps" if arguments.bumps else ""
    path = folder / f"crossing-{view}-{seed}-{count}x{seconds:.0f}s{bumps}.npz"
    if path.exists():
        return path
    scene = _scene(VIEWS[view], seed, arguments)
    camera = WorldCamera(scene, rate_hz=RATE_HZ, duration_s=seconds, seed=seed)
    t = np.array(camera.times)
    data: dict[str, NDArray[np.generic]] = {"t": t, **_truth(VIEWS[view], scene, t, count)}
    found: dict[str, list[Sightings]] = {name: [] for name in DETECTORS}
    detectors = {name: make_detector(text) for name, text in DETECTORS.items()}
    # As `airground track` does with a file: the background is learned from frames all over it.
    detectors["moving"].learn(  # type: ignore[attr-defined]
        [camera.frame(int(k)) for k in np.linspace(0, len(t) - 1, 9)]
    )
    begin = time.perf_counter()
    for frame in camera:
        for name, detector in detectors.items():
            found[name].append(detector.detect(frame))
    print(
        f"{view}, seed {seed}: {len(t)} frames drawn and looked at in {time.perf_counter() - begin:.0f} s",
        file=sys.stderr,
    )
    for name, rows in found.items():
        data[f"{name}_frame"] = np.repeat(np.arange(len(t)), [len(s) for s in rows])
        for column in ("uv", "covariance", "outline", "angle", "angle_sigma", "score"):
            data[f"{name}_{column}"] = np.concatenate([getattr(s, column) for s in rows])
    np.savez(path, **data)  # type: ignore[arg-type]
    return path


def _truth(view: View, scene: Scene, t: FloatArray, count: int) -> dict[str, NDArray[np.generic]]:
    """Positions for each detector, who is near whom in the image, and who is behind a pillar."""
    poses = [body.pose(t)[0] for body in scene.bodies[:count]]
    xy = np.stack(poses, axis=1)
    roof = np.concatenate([xy, np.full((*xy.shape[:2], 1), HEIGHT_M)], axis=-1)
    ring = round_outline(RADIUS_M)
    drum = np.concatenate([np.column_stack([ring, np.full(len(ring), z)]) for z in (0.0, HEIGHT_M)])
    rim = view.camera.project(
        np.append(xy, np.zeros((*xy.shape[:2], 1)), axis=-1)[:, :, None] + drum
    )
    middle = np.empty_like(xy)
    for k in range(len(t)):
        for j in range(count):
            moments = cv2.moments(cv2.convexHull(rim[k, j].astype(np.float32)))
            middle[k, j] = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
    gap = np.full((len(t), count, count), np.inf)
    size = np.linalg.norm(rim - middle[:, :, None], axis=-1).max(axis=-1)
    apart = np.linalg.norm(middle[:, :, None] - middle[:, None], axis=-1)
    close = apart < size[:, :, None] + size[:, None] + 2 * APART_PX
    for k, i, j in zip(*np.nonzero(np.triu(close, 1)), strict=True):
        gap[k, i, j] = gap[k, j, i] = _gap(rim[k, i], rim[k, j])
    behind = np.zeros((len(t), count), dtype=bool)
    eye = view.camera.centre_m[:2]
    for x, y in view.pillars_m:
        radius, height = PILLAR_M
        ring = round_outline(radius, 32)
        post = np.concatenate(
            [np.column_stack([ring + (x, y), np.full(32, z)]) for z in (0.0, height)]
        )
        hull = cv2.convexHull(view.camera.project(post).astype(np.float32))[:, 0].astype(np.float64)
        farther = np.linalg.norm(xy - eye, axis=-1) > np.hypot(x - eye[0], y - eye[1])
        behind |= farther & (_depth(hull, rim) > -2.0).any(axis=-1)
    return {
        "moving_truth": middle,
        "blob_truth": view.camera.project(roof),
        "gap": gap.astype(np.float32),
        "behind": behind,
    }


def _gap(a: FloatArray, b: FloatArray) -> float:
    """Between two convex outlines [px]; negative where they overlap. By the axes across the sides of both."""
    widest = -np.inf
    for one, other in ((a, b), (b, a)):
        hull = cv2.convexHull(one.astype(np.float32))[:, 0].astype(np.float64)
        widest = max(widest, float(-_depth(hull, other[None])[0].max()))
    return widest


def _depth(hull: FloatArray, points: FloatArray) -> FloatArray:
    """How deep points are inside a convex hull [px]: the least distance to a side's line, negative outside."""
    side = np.roll(hull, -1, axis=0) - hull
    length = np.maximum(np.hypot(*side.T), 1e-9)
    normal = np.column_stack([-side[:, 1], side[:, 0]]) / length[:, None]
    inside = hull.mean(axis=0)
    normal *= np.sign(((inside - hull) * normal).sum(axis=1))[:, None]
    return np.asarray((points @ normal.T - (hull * normal).sum(axis=1)).min(axis=-1))


def _episodes(now: BoolArray) -> int:
    """How often something begins that was not there for half a second; over all columns."""
    memory = round(RATE_HZ / 2)
    count = 0
    for column in now.reshape(len(now), -1).T:
        rows = np.flatnonzero(column)
        count += int((np.diff(rows, prepend=-memory - 1) > memory).sum())
    return count


def _load(path: Path, detector: str) -> tuple[Watched, float, FloatArray]:
    with np.load(path) as data:
        t, uv, gap, behind = data["t"], data[f"{detector}_truth"], data["gap"], data["behind"]
        frame = data[f"{detector}_frame"]
        names = ("uv", "covariance", "angle", "angle_sigma", "score", "outline")
        columns = {name: data[f"{detector}_{name}"] for name in names}
    sightings = [
        Sightings(float(t[k]), **{name: column[frame == k] for name, column in columns.items()})
        for k in range(len(t))
    ]
    one = np.triu(np.ones(gap.shape[1:], dtype=bool), 1)
    passes = [_episodes(gap[:, one] < limit) for limit in (APART_PX, 0.0)]
    shared = behind if detector == "blob" else behind | (gap < APART_PX).any(axis=-1)
    counts = np.array([*passes, _episodes(behind), float((~shared).mean())])
    alive = np.ones(uv.shape[:2], dtype=bool)
    scene = Watched(t, uv, np.zeros_like(uv), sightings, [], shared, alive)
    return scene, len(frame) / len(t), counts


def _draw(view: str, path: Path, arguments: argparse.Namespace, out: Path) -> None:
    """A frame in the middle, with the tracks of the last seconds."""
    scene, _, _ = _load(path, "moving")
    seed = int(path.stem.split("-")[2])
    camera = WorldCamera(
        _scene(VIEWS[view], seed, arguments),
        rate_hz=RATE_HZ,
        duration_s=arguments.seconds,
        seed=seed,
    )
    tracker, overlay, last = Tracker(), Overlay(), len(scene.t) // 2
    blank = camera.frame(0)
    for k in range(last + 1):
        state = tracker.update(scene.sightings[k])
        frame = (
            camera.frame(k) if k == last else type(blank)(blank.image, float(scene.t[k]), "world")
        )
        if k > last - 5 * RATE_HZ:
            image = overlay.draw(frame, state.tracks)
    cv2.imwrite(str(out), image)
    print(f"wrote {out}", file=sys.stderr)


if __name__ == "__main__":
    main()
