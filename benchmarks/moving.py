"""A moving camera held still: how still, how honestly stated, how fast, and what is left for the calibration.

    python benchmarks/moving.py real        parked vehicles of two drone recordings as fixed points
    python benchmarks/moving.py images      flights over a flat picture, beside what users usually do with ORB
    python benchmarks/moving.py rendered    a calibration drive seen by a drone, beside the same seen by a still camera

`real` wants the folder of recordings in AIRGROUND_DATA. Peers of `images`: 2000 ORB features matched by ratio test
and cv2.findHomography(RANSAC, 3 px), from each frame to the one before (chain) or to the first.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.calibration import Motion, Tracks, calibrate
from airground.geometry import LimitedHomography, n_error
from airground.sim import Pinhole, Renderer, Scene, Sun, drive_eight, ground
from airground.sim.body import Tag
from airground.sim.body_kinds import box, car, robot
from airground.sim.body_poses import along_path, parked
from airground.sim.flights import fly_over, hover, orbit
from airground.sim.world import FigureEight
from airground.vision.frame import Frame
from airground.vision.moving import (
    PointStabilizer,
    Stabilizer,
    apply_homography,
    homography_jacobian,
    raised,
)
from airground.vision.sightings import Sightings

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from vision.moving import flight as flights
from vision.moving import recordings as drones

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.sim import Path as DrivenPath
    from airground.sim.scene import CameraOfTime
    from airground.vision.moving import Stabilization


def main() -> None:
    cv2.setNumThreads(1)
    wanted = sys.argv[1:] or ["real", "images", "rendered"]
    if "real" in wanted:
        _real()
    if "images" in wanted:
        _images()
    if "rendered" in wanted:
        _rendered()


# Real recordings


def _real() -> None:
    folder = Path(os.environ.get("AIRGROUND_DATA", ""))
    print(
        "parked vehicles as fixed points; px of the first frame. 'rest' is how far parked vehicles that were held out"
    )
    print(
        "wander about their own mean once referred (rms, per coordinate), with our homographies and the published ones"
    )
    print(
        f"{'recording':>10} {'frames':>7} {'ok':>5} {'fixed':>6} {'rms':>6} {'apart':>6} "
        f"{'stated':>7} {'rest':>6} {'publ.':>6} {'ms':>6}"
    )
    for name in drones.NAMES:
        recording = drones.load(folder, name)
        result = drones.judge(recording, PointStabilizer())
        print(
            f"{name:>10} {result.frames:7} {result.ok:5} {result.fixed:6} {result.rms_px:6.2f} "
            f"{result.apart_px:6.2f} {result.stated_px:7.2f} {result.rest_px:6.2f} "
            f"{result.published_rest_px:6.2f} {result.ms:6.1f}",
            flush=True,
        )


# Flights over a flat picture


def _images() -> None:
    size = (1280, 720)
    rng = np.random.default_rng(0)
    picture = flights.ground(rng)
    vehicles = [
        flights.Vehicle((560 + 90 * k, 760 + 60 * (k % 5)), (2.0 * (-1) ** k, 0.0))
        for k in range(9)
    ]
    ways = {
        "hover": flights.hover(rng, 150, size=size),
        "orbit": flights.orbit(150, size=size, turns=0.5),
        "round": flights.out_and_home(200, size=size, reach=900.0),
    }
    print(
        "\nflights over a flat picture, 1280x720, noise 2 grey levels, 9 vehicles driving, masked; error of the"
    )
    print("homography over the image, px of the frame; ms of CPU time on one core")
    print(
        f"{'flight':>8} {'method':>8} {'ok':>5} {'rms px':>9} {'last px':>9} {'max px':>9} "
        f"{'stated':>9} {'ms':>7} {'worst':>7}"
    )
    for name, cameras in ways.items():
        flight = flights.Flight(cameras, picture, vehicles, size)
        images = [flight.image(k) for k in range(len(cameras))]
        for method, run in (("ours", _ours), ("chain", _orb_chain), ("first", _orb_first)):
            rows = run(flight, images)
            error, stated, seconds = np.array(rows).T
            known = np.isfinite(error)
            last = error[known][-1] if known.any() else np.nan
            print(
                f"{name:>8} {method:>8} {known.sum():5} {_rms(error):9.4f} {last:9.4f} "
                f"{np.nanmax(error):9.4f} {_rms(stated):9.4f} {1e3 * seconds.mean():7.1f} {1e3 * seconds.max():7.1f}",
                flush=True,
            )


Row = tuple[float, float, float]  # error and stated deviation [px], seconds


def _ours(flight: flights.Flight, images: list[flights.Image]) -> list[Row]:
    stabilizer = Stabilizer()
    rows: list[Row] = []
    grid = _grid(flight.size)
    for k, image in enumerate(images):
        started = time.process_time()
        result = stabilizer.update(Frame(image, k / 30, index=k), flight.outlines(k))
        seconds = time.process_time() - started
        if result.stable_from_image is None:
            rows.append((np.nan, np.nan, seconds))
            continue
        J = np.linalg.inv(homography_jacobian(result.stable_from_image, grid))
        C = J @ result.point_covariance(grid) @ np.swapaxes(J, -1, -2)
        stated = float(np.sqrt(np.trace(C, axis1=1, axis2=2).mean() / 2))
        rows.append((_error(flight, k, result.stable_from_image), stated, seconds))
    return rows


def _orb_chain(flight: flights.Flight, images: list[flights.Image]) -> list[Row]:
    H = np.eye(3)
    before = None
    rows: list[Row] = []
    for k, image in enumerate(images):
        started = time.process_time()
        here = _orb(image, flight.outlines(k))
        step = np.eye(3) if before is None else _orb_homography(here, before)
        seconds = time.process_time() - started
        before = here
        if step is not None:
            H = np.asarray(H @ step)
        rows.append((_error(flight, k, H), np.nan, seconds))
    return rows


def _orb_first(flight: flights.Flight, images: list[flights.Image]) -> list[Row]:
    first = None
    rows: list[Row] = []
    for k, image in enumerate(images):
        started = time.process_time()
        here = _orb(image, flight.outlines(k))
        first = here if first is None else first
        H = _orb_homography(here, first)
        seconds = time.process_time() - started
        rows.append((np.nan if H is None else _error(flight, k, H), np.nan, seconds))
    return rows


Orb = tuple["FloatArray", flights.Image]


def _orb(image: flights.Image, outlines: FloatArray) -> Orb:
    mask = np.full(image.shape[:2], 255, np.uint8)
    for outline in outlines:
        cv2.fillConvexPoly(mask, np.rint(outline).astype(np.int32), 0.0)
    points, code = cv2.ORB.create(nfeatures=2000).detectAndCompute(image, mask)
    return np.array([p.pt for p in points], dtype=np.float64), np.asarray(code, dtype=np.uint8)


def _orb_homography(here: Orb, there: Orb) -> FloatArray | None:
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(here[1], there[1], k=2)
    good = [(a.queryIdx, a.trainIdx) for a, b in pairs if a.distance < 0.75 * b.distance]
    if len(good) < 4:
        return None
    rows = np.array(good)
    H, _ = cv2.findHomography(here[0][rows[:, 0]], there[0][rows[:, 1]], cv2.RANSAC, 3.0)
    return None if H is None else np.asarray(H, dtype=np.float64)


def _error(flight: flights.Flight, k: int, H: FloatArray) -> float:
    """Rms over the image, in pixels of the frame, so that a frame seen from afar counts alike."""
    grid = _grid(flight.size)
    there = flights.project(H, grid)
    back = flights.project(np.asarray(np.linalg.inv(flight.truth(k)), dtype=np.float64), there)
    return float(np.sqrt(np.mean((back - grid) ** 2)))


def _grid(size: tuple[int, int]) -> FloatArray:
    u, v = np.meshgrid(np.linspace(0, size[0] - 1, 9), np.linspace(0, size[1] - 1, 6))
    return np.column_stack([u.ravel(), v.ravel()])


def _rms(values: FloatArray) -> float:
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


# Rendered flights

HZ, DURATION_S, NOISE_PX, SEEDS = 10.0, 60.0, 0.5, 6
HEIGHTS_M = (0.0, 0.12, 0.24)


def _rendered() -> None:
    base = Pinhole.looking_down(
        focal_length_px=900.0,
        tilt_rad=np.radians(40),
        height_m=8.0,
        image_size_px=(1280, 720),
        heading_rad=np.radians(90),
    )
    ways: dict[str, Pinhole | CameraOfTime] = {
        "hover": hover(base, seed=1),
        "orbit": orbit(
            centre_m=(0.0, 6.7),
            radius_m=6.7,
            height_m=8.0,
            period_s=180.0,
            focal_length_px=900.0,
            image_size_px=(1280, 720),
            seed=1,
        ),
        "fly-over": fly_over(base, to_m=(4.0, 0.0), period_s=60.0, seed=1),
    }
    print(
        f"\na calibration drive of {DURATION_S:.0f} s seen by a drone at 8 m, {HZ:.0f} Hz, sightings with "
        f"{NOISE_PX} px of noise; n"
    )
    print(
        "over that of a camera that stands where the first frame was taken (rms over "
        f"{SEEDS} drives of noise); told: where height of the mark, focal length and tilt are known"
    )
    print(
        f"{'flight':>10} {'mark at':>8} {'ok':>9} {'H px':>7} {'stated':>7} "
        f"{'n':>8} {'still n':>8} {'ratio':>6} {'told':>6} {'ms':>6}"
    )
    for name, camera in ways.items():
        _rendered_rows(name, camera)


def _rendered_rows(name: str, camera: Pinhole | CameraOfTime) -> None:
    path = drive_eight(FigureEight((0.0, 6.7), (2.6, 1.9), 0.5), DURATION_S)
    tag = Tag("36h11", 0, 0.36, (-0.05, 0.0))
    scene = Scene(
        camera=camera,
        ground=ground("warehouse", seed=3, tile_m=12.0, texel_m=0.008),
        bodies=(
            robot("robot", along_path(path), tag, size_m=(0.62, 0.5, 0.24)),
            box("box", parked(-3.4, 5.2, 0.4), (0.6, 0.5, 0.45)),
            car("car", parked(3.4, 9.2, 0.4)),
        ),
        sun=Sun(azimuth_rad=np.radians(-35), elevation_rad=np.radians(50)),
        exposure_s=0.004,
    )
    renderer, stabilizer = Renderer(scene, seed=5), Stabilizer()
    times = np.arange(0.0, DURATION_S, 1 / HZ)
    xy, _, _ = path.at(times)
    first = scene.image_from_plane(0.0, 0.0)
    results, seconds, error, stated = [], [], [], []
    for k, t in enumerate(times):
        frame = Frame(renderer.image(t, k), t, index=k)
        spot = scene.plane(0.0, t).project(xy[k])
        started = time.process_time()
        result = stabilizer.update(frame, _square(spot, 70.0)[None])
        seconds.append(time.process_time() - started)
        results.append(result)
        if result.stable_from_image is not None:
            truth = first @ np.linalg.inv(scene.image_from_plane(0.0, t))
            error.append(
                apply_homography(result.stable_from_image, spot) - apply_homography(truth, spot)
            )
            stated.append(np.trace(result.point_covariance(spot)) / 2)
    for height in HEIGHTS_M:
        ours, told, still = [], [], []
        g = LimitedHomography.from_homography(scene.image_from_plane(height, 0.0))
        seen = np.array([scene.plane(height, t).project(p) for t, p in zip(times, xy, strict=True)])
        for seed in range(SEEDS):
            rng = np.random.default_rng(seed)
            motion = _motion(path, rng)
            noise = rng.normal(0, NOISE_PX, seen.shape)
            ours.append(_n(g, _tracks(results, seen + noise), motion))
            told.append(_n(g, _tracks(_lifted(scene, results, height), seen + noise), motion))
            uv = scene.plane(height, 0.0).project(xy) + noise
            names, sigma = ["robot"] * len(times), np.full(len(times), NOISE_PX)
            still.append(_n(g, Tracks.from_rows(times, names, uv, sigma), motion))
        n, n_still = _rms(np.array(ours)), _rms(np.array(still))
        print(
            f"{name:>10} {height:6.2f} m {sum(r.ok for r in results):4}/{len(times)} "
            f"{_rms(np.array(error)):7.3f} {np.sqrt(np.mean(stated)):7.3f} {n:8.5f} {n_still:8.5f} "
            f"{n / n_still:6.2f} {_rms(np.array(told)) / n_still:6.2f} {1e3 * np.median(seconds):6.1f}",
            flush=True,
        )


def _lifted(scene: Scene, results: list[Stabilization], height_m: float) -> list[Stabilization]:
    """For marks above the ground, by who knows how high, and the camera's focal length and tilt."""
    camera = scene.camera_at(0.0)
    width, height = camera.image_size_px
    return [
        raised(
            r,
            height_ratio=height_m / float(camera.centre_m[2]),
            normal=camera.camera_from_world @ np.array([0.0, 0.0, -1.0]),
            focal_length_px=camera.focal_length_px,
            principal_point=[(width - 1) / 2, (height - 1) / 2],
        )
        for r in results
    ]


def _tracks(results: list[Stabilization], uv: FloatArray) -> Tracks:
    """What a user has: sightings of the moving camera, referred to its first frame."""
    seen = [
        r.refer(Sightings.round(r.t, p[None], NOISE_PX))
        for r, p in zip(results, uv, strict=True)
        if r.ok
    ]
    covariance = np.concatenate([s.covariance for s in seen])
    sigma = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    names = ["robot"] * len(seen)
    return Tracks.from_rows(
        np.array([s.t for s in seen]), names, np.concatenate([s.uv for s in seen]), sigma
    )


def _motion(path: DrivenPath, rng: np.random.Generator) -> Motion:
    t = np.arange(0.0, path.t[-1], 0.05)
    _, theta, way = path.at(t)
    speed = np.gradient(way, t) * (1 + rng.normal(0, 0.01, len(t)))
    heading = theta + rng.normal(0, 0.01, len(t))
    return Motion.from_rows(t, ["robot"] * len(t), heading=heading, speed=speed)


def _n(g: LimitedHomography, tracks: Tracks, motion: Motion) -> float:
    return float(n_error(g, calibrate(tracks, motion, image_size_px=(1280, 720)).model))


def _square(middle: FloatArray, half: float) -> FloatArray:
    return middle + half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


if __name__ == "__main__":
    main()
