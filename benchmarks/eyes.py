"""From a frame in memory to the tracker's state: how long it takes, how many frames a second, and where the time goes.

Frames of 1280x720 are drawn one by one, which is not counted, and each is looked at once by `Eyes`: stabilise where the
camera hovers, detect, track. Four vehicles drive eights below a drone at 12 m: tags of 36h11, 54 px wide; the same
vehicles without their tags being read, as moving things; and four small robots with two lamps each, in the dark. Then
one robot of the demo, and four and ten that weave about a lawn with tags of 4x4_50, 27 px wide: what a live session
sees. The first frames, in which memory is had and backgrounds are learned, are left out and shown by themselves.

wall: what a user waits [ms], on a machine that others may be using; cpu: what the process used of both cores [ms],
threads added up, which other load hardly changes. late: share of the frames over 1/60 s, by wall and by cpu. Beside
them: OpenCV's bare `ArucoDetector.detectMarkers` on the same frames, with no track, no covariance and corners that are
good to half a pixel.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from airground.sim import Renderer, Tag, demo_scene, drone_scene, hover, lamp_scene
from airground.sim.body_kinds import robot
from airground.sim.scene_camera import Pinhole
from airground.sim.scene_kinds import soccer_scene
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.frame import Frame
from airground.vision.moving import Stabilizer
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from airground.sim import Scene
    from airground.sim.body_poses import PoseOfTime

    FloatArray = NDArray[np.float64]

BUDGET_MS = 1e3 / 60
SKIP = 30
STAGES = ("stabilise", "detect", "track")


class Row(NamedTuple):
    """What is looked at, and by what."""

    name: str
    detector: str
    scene: Callable[[bool], Scene]
    hovers: bool


class Times(NamedTuple):
    """Of every frame [ms]: wall and cpu, (N, 2) each."""

    whole: FloatArray
    stages: dict[str, FloatArray]
    floor: FloatArray
    found: FloatArray
    """(N, 2). Sightings and confirmed tracks."""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--frames", type=int, default=300, help="after the first thirty")
    parser.add_argument("--rate", type=float, default=60.0, help="of the camera [Hz]")
    parser.add_argument("--threads", type=int, help="of OpenCV")
    parser.add_argument("--only", help="rows whose name has this in it")
    arguments = parser.parse_args()
    if arguments.threads is not None:
        cv2.setNumThreads(arguments.threads)
    print(
        f"1280x720, {arguments.frames} frames after the first {SKIP}; OpenCV {cv2.__version__}, "
        f"{cv2.getNumThreads()} threads; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )
    print(
        f"{'':>26} {'wall ms:':>8} {'median':>7} {'99 %':>7} {'worst':>7} {'fps':>6} {'late':>6}"
        f" {'| cpu ms:':>9} {'median':>7} {'mean':>7} {'99 %':>7} {'late':>6}"
        f" | {'first: mean':>11} {'worst':>7} {'cpu':>6} | share of cpu: stabilise, detect, track | seen tracks"
    )
    for row in ROWS:
        if arguments.only is None or arguments.only in row.name:
            _show(row, _times(row, arguments.frames, arguments.rate))
    print(f"load at the end {os.getloadavg()[0]:.1f}")


def _show(row: Row, times: Times) -> None:
    later = {name: values[SKIP:] for name, values in times.stages.items()}
    whole = times.whole[SKIP:]
    total = whole[:, 1].sum()
    shares = ", ".join(f"{later[name][:, 1].sum() / total:4.0%}" for name in STAGES)
    seen, tracks = times.found[SKIP:].mean(axis=0)
    print(
        f"{row.name:>26} {_line(whole)} | {times.whole[:SKIP, 0].mean():11.1f} "
        f"{times.whole[:SKIP, 0].max():7.1f} {times.whole[:SKIP, 1].max():6.0f} | {shares:>38} | "
        f"{seen:4.1f} {tracks:6.1f}",
        flush=True,
    )
    if len(times.floor):
        print(f"{'bare detectMarkers':>26} {_line(times.floor[SKIP:])}", flush=True)


def _line(ms: FloatArray) -> str:
    wall, cpu = ms.T
    return (
        f"{'':>8} {np.median(wall):7.2f} {np.percentile(wall, 99):7.2f} {wall.max():7.2f} "
        f"{1e3 / wall.mean():6.0f} {(wall > BUDGET_MS).mean():6.1%} {'|':>9} {np.median(cpu):7.2f} "
        f"{cpu.mean():7.2f} {np.percentile(cpu, 99):7.2f} {(cpu > BUDGET_MS).mean():6.1%}"
    )


def _times(row: Row, frames: int, rate_hz: float) -> Times:
    renderer = Renderer(row.scene(row.hovers))
    detector, tracker = make_detector(row.detector), Tracker()
    stabilizer = Stabilizer() if row.hovers else None
    spent = {name: np.zeros(2) for name in STAGES}
    _clocked(detector, "detect", spent["detect"])
    _clocked(tracker, "update", spent["track"])
    if stabilizer is not None:
        _clocked(stabilizer, "update", spent["stabilise"])
    eyes = Eyes(detector, tracker, stabilizer)
    kind = cv2.aruco.DICT_4X4_50 if "4x4" in row.detector else cv2.aruco.DICT_APRILTAG_36h11
    bare = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(kind))
    whole, floor, found = [], [], []
    stages: dict[str, list[FloatArray]] = {name: [] for name in STAGES}
    for k in range(SKIP + frames):
        frame = Frame(renderer.image(k / rate_hz, k), k / rate_hz, "world", k)
        for ms in spent.values():
            ms[:] = 0.0
        begin = _now()
        look = eyes.look(frame)
        whole.append(_now() - begin)
        for name, ms in spent.items():
            stages[name].append(ms.copy())
        found.append([len(look.seen), len(look.state.confirmed_tracks)])
        if row.detector.startswith("tag"):
            begin = _now()
            bare.detectMarkers(frame.image)
            floor.append(_now() - begin)
    return Times(
        np.array(whole),
        {name: np.array(values) for name, values in stages.items()},
        np.array(floor).reshape(-1, 2),
        np.array(found, dtype=np.float64),
    )


def _now() -> FloatArray:
    return 1e3 * np.array([time.perf_counter(), time.process_time()])


def _clocked(thing: Any, method: str, spent: FloatArray) -> None:
    """Have a thing add up the time that is spent in one of its methods."""
    work = getattr(thing, method)

    def clocked(*arguments: Any, **options: Any) -> Any:
        begin = _now()
        try:
            return work(*arguments, **options)
        finally:
            spent[:] += _now() - begin

    setattr(thing, method, clocked)


def _vehicles(hovers: bool) -> Scene:
    """Four of them, on one eight; no two are in its middle at a time."""
    scene = drone_scene(0, flight="hover" if hovers else "still", duration_s=1.0)
    scenery = tuple(body for body in scene.bodies if not body.moves)
    base = drone_scene(0, flight="still", duration_s=1.0).camera_at(0.0)
    spot = np.linalg.inv(base.image_from_plane(0.0)) @ np.array([639.5, 359.5, 1.0])
    middle = float(spot[1] / spot[2])
    vehicles = tuple(
        robot(
            f"robot-{k + 1}",
            _eight(middle, share),
            Tag("36h11", k, 0.72, (-0.06, 0.0)),
            size_m=(1.2, 0.96, 0.5),
            colour=(40.0, 110.0, 220.0),
        )
        for k, share in enumerate((0.0, 0.125, 0.75, 0.875))
    )
    return replace(scene, bodies=vehicles + scenery)


def _eight(middle_m: float, share: float) -> PoseOfTime:
    def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        phase = 2 * np.pi * (share + t / 16.0)
        xy = np.column_stack([4.0 * np.sin(phase), middle_m + 2.4 * np.sin(2 * phase)])
        return xy, np.arctan2(4.8 * np.cos(2 * phase), 4.0 * np.cos(phase))

    return pose


def _lamps(hovers: bool) -> Scene:
    scene = lamp_scene(0, robots=4)
    assert isinstance(scene.camera, Pinhole)
    return replace(scene, camera=hover(scene.camera)) if hovers else scene


def _demo(_: bool) -> Scene:
    return demo_scene(0)


def _lawn(robots: int) -> Callable[[bool], Scene]:
    return lambda _: soccer_scene(0, robots=robots, tags=True)


HOVERING = tuple(
    Row(f"{name}{', hovering' if hovers else ''}", detector, scene, hovers)
    for hovers in (False, True)
    for name, detector, scene in (
        ("four tags", "tag:family=36h11", _vehicles),
        ("moving things", "moving", _vehicles),
        ("lights", "led", _lamps),
    )
)
LIVE = (
    Row("demo, one tag", "tag:family=36h11", _demo, hovers=False),
    Row("lawn, four tags", "tag:family=4x4_50", _lawn(4), hovers=False),
    Row("lawn, ten tags", "tag:family=4x4_50", _lawn(10), hovers=False),
)
ROWS = HOVERING + LIVE


if __name__ == "__main__":
    main()
