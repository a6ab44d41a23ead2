"""Accuracy and speed of the detectors beside their peers, on images whose truth is known.

Images: a printed tag, area-sampled at 8 x 8 points a pixel, blurred, with noise; its tilt is towards a random side.
One row for each change from the middle of the ranges. found: share of the tags; centre and corner: rms [px] of those
that were found; nes: mean normalised square of the centre's error (2 if the stated covariance is right). The peers'
centre is where their diagonals meet, as ours.

Speed: 1280x720, four tags that move, the whole detector; then lights, a coloured patch and moving things.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from airground.vision.detectors.blobs import BlobDetector
from airground.vision.detectors.leds import LedDetector
from airground.vision.detectors.moving import MovingDetector
from airground.vision.detectors.tags import TagDetector
from vision.synthetic import (
    FloatArray,
    Tag,
    coverage,
    draw_spots,
    draw_tags,
    frame,
    texture,
    tilted,
    to_bytes,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from airground.vision.sightings import Sightings

    Image = NDArray[np.uint8]
    Found = tuple[FloatArray, FloatArray | None]  # corners, covariance of the centre
    Finder = Callable[[Image], dict[int, Found]]

TRIALS = 40
FRAMES = 60


class Setting(NamedTuple):
    """Of one row."""

    side_px: float = 40.0
    tilt_deg: float = 30.0
    blur_px: float = 0.6
    noise: float = 3.0


def main() -> None:
    finders = _finders()
    print(f"{TRIALS} tags of family 36h11 a row; OpenCV {cv2.__version__}")
    print(f"{'side':>5} {'tilt':>5} {'blur':>5} {'noise':>5}", end="")
    for name in finders:
        print(f" | {name:^30}", end="")
    print("\n" + " " * 23 + " |  found  centre  corner    nes " * len(finders))
    for setting in _settings():
        print("{:5.0f} {:5.0f} {:5.1f} {:5.0f}".format(*setting), end="")
        images = list(_images(setting))
        for finder in finders.values():
            print(" | {:6.0%} {:7.3f} {:7.3f} {:6.2f}".format(*_score(finder, images)), end="")
        print(flush=True)
    _speed(finders)
    _lights()
    _patches()
    _moving()


def _settings() -> Iterator[Setting]:
    yield Setting()
    yield from (Setting(side_px=side) for side in (15.0, 20.0, 30.0, 60.0, 100.0))
    yield from (Setting(tilt_deg=tilt) for tilt in (0.0, 50.0, 60.0, 70.0))
    yield from (Setting(blur_px=blur) for blur in (0.0, 1.0, 1.5))
    yield from (Setting(noise=noise) for noise in (0.0, 8.0, 15.0))


def _images(setting: Setting) -> Iterator[tuple[Image, Tag]]:
    for seed in range(TRIALS):
        rng = np.random.default_rng(seed)
        place = tilted(
            100 + rng.uniform(-1, 1, 2),
            setting.side_px,
            tilt_deg=setting.tilt_deg,
            turn_deg=rng.uniform(0, 360),
            lean_deg=rng.uniform(0, 360),
        )
        tag = Tag(place, number=int(rng.integers(587)))
        noise = {"noise": setting.noise, "rng": rng}
        yield draw_tags([tag], (200, 200), blur_px=setting.blur_px, **noise), tag  # type: ignore[arg-type]


def _score(finder: Finder, images: list[tuple[Image, Tag]]) -> tuple[float, ...]:
    centres, corners, squares, found = [], [], [], 0
    for image, tag in images:
        seen = finder(image).get(tag.number)
        if seen is None:
            continue
        found += 1
        quad, covariance = seen
        error = _crossing(quad) - tag.centre
        centres.append(error @ error)
        # The peers number corners in their own ways.
        corners.append(
            min(np.mean((np.roll(quad, k, axis=0) - tag.corners) ** 2) for k in range(4))
        )
        if covariance is not None:
            squares.append(error @ np.linalg.solve(covariance, error))
    if not found:
        return 0.0, np.nan, np.nan, np.nan
    mean = float(np.mean(squares)) if squares else np.nan
    return found / len(images), np.sqrt(np.mean(centres)), np.sqrt(2 * np.mean(corners)), mean


def _crossing(quad: FloatArray) -> FloatArray:
    a, b, c, d = np.column_stack([quad, np.ones(4)])
    x = np.cross(np.cross(a, c), np.cross(b, d))
    return np.asarray(x[:2] / x[2])


def _finders() -> dict[str, Finder]:
    def ours(image: Image) -> dict[int, Found]:
        seen = TagDetector().detect(frame(image))
        rows = zip(seen.labels, seen.outline, seen.covariance, strict=True)
        return {int(label): (quad, covariance) for label, quad, covariance in rows}

    finders: dict[str, Finder] = {"ours": ours, "OpenCV": _opencv(cv2.aruco.CORNER_REFINE_NONE)}
    finders["OpenCV SUBPIX"] = _opencv(cv2.aruco.CORNER_REFINE_SUBPIX)
    try:
        from pupil_apriltags import Detector  # type: ignore[import-not-found, import-untyped, unused-ignore]
    except ImportError:
        print("pupil-apriltags is not installed: left out")
        return finders
    detector = Detector("tag36h11", nthreads=2, quad_decimate=1.0)

    def pupil(image: Image) -> dict[int, Found]:
        # (0, 0) is the corner of its first pixel; its corners run the other way round.
        return {
            tag.tag_id: (np.asarray(tag.corners)[::-1] - 0.5, None)
            for tag in detector.detect(np.ascontiguousarray(image))
        }

    finders["pupil-apriltags"] = pupil
    return finders


def _opencv(refinement: int) -> Finder:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    detector = cv2.aruco.ArucoDetector(dictionary, parameters)

    def find(image: Image) -> dict[int, Found]:
        quads, ids, _ = detector.detectMarkers(image)
        numbers = np.ravel(ids).tolist() if len(quads) else []
        return {
            int(number): (np.asarray(quad[0], dtype=float), None)
            for number, quad in zip(numbers, quads, strict=True)
        }

    return find


def _tag_scene() -> list[Image]:
    rng = np.random.default_rng(0)
    images = []
    for k in range(FRAMES):
        t = k / 30
        places = [
            tilted(
                [200 + 250 * i + 60 * t, 150 + 100 * i + 100 * np.sin(t + i)],
                [30, 40, 60, 80][i],
                tilt_deg=15 * i,
                turn_deg=40 * i + 90 * t,
            )
            for i in range(4)
        ]
        tags = [Tag(place, number=i) for i, place in enumerate(places)]
        images.append(draw_tags(tags, blur_px=0.6, noise=3.0, rng=rng, supersample=4))
    return images


def _speed(finders: dict[str, Finder]) -> None:
    images = _tag_scene()
    detector = TagDetector()
    print("\n1280x720, four tags that move, milliseconds a frame: median, worst of ten")
    clocked: dict[str, Callable[[int], int]] = {
        name: partial(_count, find, images) for name, find in finders.items()
    }
    clocked["ours"] = lambda k: len(detector.detect(frame(images[k], k / 30)))
    for name, work in clocked.items():
        milliseconds, counts = _clock(work)
        print(
            f"{name:>16} {np.median(milliseconds):7.1f} {np.percentile(milliseconds, 90):7.1f}"
            f"   found {np.mean(counts) / 4:.0%}",
            flush=True,
        )


def _count(find: Finder, images: list[Image], k: int) -> int:
    return len(find(images[k]))


def _clock(work: Callable[[int], int], frames: int = FRAMES) -> tuple[list[float], list[int]]:
    milliseconds, counts = [], []
    for k in range(frames):
        started = time.perf_counter()
        counts.append(work(k))
        milliseconds.append(1e3 * (time.perf_counter() - started))
    return milliseconds, counts


def _report(
    name: str, errors: list[FloatArray], squares: list[float], missed: int, extra: int
) -> None:
    rms = np.sqrt(np.mean(np.square(errors)) * 2) if errors else np.nan
    share = len(errors) / max(len(errors) + missed, 1)
    print(f"{name:>30} {share:6.0%} {rms:7.3f} {np.mean(squares):6.2f} {extra:6}", flush=True)


def _match(
    seen: Sightings, truth: list[FloatArray], reach: float
) -> tuple[list[FloatArray], list[float], int, int]:
    errors, squares, used = [], [], set()
    for point in truth:
        off = seen.uv - point
        near = np.flatnonzero(np.hypot(*off.T) < reach)
        if len(near):
            k = int(near[np.argmin(np.hypot(*off[near].T))])
            used.add(k)
            errors.append(off[k])
            squares.append(float(off[k] @ np.linalg.solve(seen.covariance[k], off[k])))
    return errors, squares, len(truth) - len(errors), len(seen) - len(used)


def _lights() -> None:
    print(f"\n{'':>30} {'found':>6} {'rms px':>7} {'nes':>6} {'false':>6}")
    for sigma, peak in ((0.8, 100.0), (1.2, 150.0), (2.0, 220.0), (2.0, 900.0), (4.0, 600.0)):
        tally: list[object] = [[], [], 0, 0]
        for seed in range(TRIALS):
            rng = np.random.default_rng(seed)
            truth = [np.array([40.0 + 60 * i, 60.0]) + rng.uniform(0, 1, 2) for i in range(4)]
            image = draw_spots([(u, v, sigma, peak) for u, v in truth], (280, 120))
            seen = LedDetector().detect(frame(to_bytes(image, 3.0, rng)))
            tally = [a + b for a, b in zip(tally, _match(seen, truth, 3.0), strict=True)]  # type: ignore[operator]
        _report(f"light, sigma {sigma} px, peak {peak:.0f}", *tally)  # type: ignore[arg-type]


def _patches() -> None:
    ground, colour = np.array([90.0, 100.0, 95.0]), np.array([40.0, 50.0, 200.0])
    for half in (4.0, 10.0, 40.0):
        tally: list[object] = [[], [], 0, 0]
        for seed in range(TRIALS):
            rng = np.random.default_rng(seed)
            truth = [np.array([160.0, 120.0]) + rng.uniform(0, 1, 2)]
            share = coverage((320, 240), truth[0], (1.6 * half, half), rng.uniform(-1.5, 1.5))
            image = ground * (1 - share[..., None]) + colour * share[..., None]
            seen = BlobDetector("red").detect(frame(to_bytes(image, 3.0, rng)))
            tally = [a + b for a, b in zip(tally, _match(seen, truth, 5.0), strict=True)]  # type: ignore[operator]
        _report(f"coloured patch, {2 * half:.0f} px", *tally)  # type: ignore[arg-type]


def _moving() -> None:
    size = (1280, 720)
    rng = np.random.default_rng(0)
    grey = 110 + 0.5 * (texture(rng, size, 2.0).astype(float) - 128)
    ground = np.dstack([grey, grey + 5, grey + 10])
    colours = np.array([[200.0, 210, 220], [30, 30, 35], [40, 60, 190], [60, 160, 70]])
    for noise in (2.0, 5.0):
        detector = MovingDetector()
        detector.learn([frame(to_bytes(ground, noise, rng), k / 9) for k in range(9)])
        tallies: dict[float, list[object]] = {}
        milliseconds = []
        for k in range(20):
            image, truth = ground.copy(), {}
            for i, side in enumerate((9.0, 20.0, 60.0, 150.0)):
                place = np.array(
                    [120.0 + 250 * i + 9 * k, 130.0 + 130 * i + 20 * np.sin(k / 5 + i)]
                )
                _put(image, place, side / 2, colours[i], 0.05 * k)
                truth[side] = place
            picture = frame(to_bytes(image, noise, rng), k / 30)
            started = time.perf_counter()
            seen = detector.detect(picture)
            milliseconds.append(1e3 * (time.perf_counter() - started))
            for side, place in truth.items():
                new = _match(seen, [place], 0.3 * side)
                old = tallies.get(side, [[], [], 0, 0])
                tallies[side] = [a + b for a, b in zip(old, new, strict=True)]  # type: ignore[operator]
                tallies[side][3] = 0
        for side, tally in tallies.items():
            _report(f"moving, {side:.0f} px, noise {noise:.0f}", *tally)  # type: ignore[arg-type]
        print(f"{'1280x720, ms a frame':>30} {np.median(milliseconds):7.1f}")


def _put(
    image: FloatArray, place: FloatArray, half: float, colour: FloatArray, angle: float
) -> None:
    reach = int(1.5 * half) + 4
    low = np.floor(place).astype(int) - reach
    share = coverage((2 * reach, 2 * reach), place - low, (half, 0.7 * half), angle, round_=False)
    box = slice(low[1], low[1] + 2 * reach), slice(low[0], low[0] + 2 * reach)
    image[box] = image[box] * (1 - share[..., None]) + colour * share[..., None]


if __name__ == "__main__":
    main()
