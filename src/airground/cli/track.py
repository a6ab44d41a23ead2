"""``airground track``."""

from __future__ import annotations

import math
import sys
import time
from argparse import ArgumentTypeError
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import Calibration
from airground.cli.output import Notes, print_json, printable, refuse_overwriting
from airground.cli.terminal import progress
from airground.cli.track_marks import MarksAbove, add_mark_arguments, refuse_marks
from airground.errors import InputError
from airground.records import replacing, write_smoothed, write_tracks
from airground.records.cells import shown

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterator

    from airground.vision.detectors.protocol import Detector
    from airground.vision.eyes import Look
    from airground.vision.frame import Frame
    from airground.vision.sources import FrameSource
    from airground.vision.video_tracks import VideoTracks

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "track"
SUMMARY = "find and follow what moves or is marked in a video: video to tracks"
EXAMPLE = """\
  airground track --video drive.mp4 --out tracks.csv --preview preview.mp4
  airground track --video drone.mp4 --out tracks.csv --detector apriltag --stabilize
  airground track --video rtsp://camera/stream --duration-s 120 --out tracks.csv
"""
SUFFIXES = (".mp4", ".mov", ".m4v", ".mkv", ".avi")
PROBES = 30  # frames of a file that tell which detector suits it
LISTED = 12  # targets that are named on the screen


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "--video",
        required=True,
        metavar="V",
        help="video file, folder of images, camera (0, /dev/video0) or address (rtsp://, udp://, http://)",
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="T", help="tracks to write (CSV)"
    )
    parser.add_argument(
        "--detector",
        default="auto",
        metavar="NAME",
        help="what to look for: auto, apriltag, aruco, led, blob:color=red, moving, point:at=U,V, "
        "package.module:function, model.onnx (default: %(default)s: tags where there are any, else what moves)",
    )
    parser.add_argument(
        "--stabilize",
        action="store_true",
        help="the camera moves: refer every sighting to the first frame",
    )
    add_mark_arguments(parser, _positive)
    parser.add_argument(
        "--preview", type=Path, metavar="FILE.mp4", help="video to write, with the tracks drawn in"
    )
    parser.add_argument(
        "--smoothed",
        type=Path,
        metavar="S",
        help="smoothed positions and velocities in the image to write (CSV); not for calibrate",
    )
    parser.add_argument(
        "--calibration",
        type=Path,
        metavar="C",
        help="calibration (JSON), for grid, horizon and speeds in the preview",
    )
    parser.add_argument(
        "--rate-hz",
        type=_positive,
        metavar="HZ",
        help="frame rate, where the video's own times are missing or wrong",
    )
    parser.add_argument(
        "--duration-s",
        type=_positive,
        metavar="S",
        help="stop after so many seconds of video; needed for cameras and streams",
    )
    parser.add_argument(
        "--shortest-s",
        type=_positive,
        default=0.5,
        metavar="S",
        help="leave out what was seen for less (default: %(default)s)",
    )


def run(args: Namespace) -> None:
    """Track, write the files, say what was found.

    Parameters
    ----------
    args : Namespace
        As parsed.
    """
    from airground.vision.eyes import Eyes
    from airground.vision.moving import Stabilizer
    from airground.vision.overlay import Overlay
    from airground.vision.preview import Preview
    from airground.vision.sources import ahead, open_source
    from airground.vision.tracker import Tracker, TrackRecorder
    from airground.vision.video_tracks import track_video

    started = time.perf_counter()
    _refuse(args)
    calibration = None if args.calibration is None else Calibration.load(args.calibration)
    marks = None if args.mark_height is None else MarksAbove(args)
    detector = _detector(args)
    eyes = Eyes(detector, Tracker(), Stabilizer() if args.stabilize else None)
    with ExitStack() as stack:
        source = stack.enter_context(open_source(args.video, rate_hz=args.rate_hz))
        if source.frame_count is None and args.duration_s is None and _endless(source):
            raise InputError(f"--video {source.name} does not end by itself; give --duration-s")
        advance = stack.enter_context(progress("track"))
        preview = None
        if args.preview is not None:
            temporary = stack.enter_context(replacing(args.preview))
            preview = stack.enter_context(Preview(temporary, Overlay(calibration=calibration)))
        done = 0

        def each(look: Look) -> None:
            nonlocal done
            done += 1
            if marks is not None:
                marks.note(look)
            if preview is not None:
                preview.add(look)
            advance(done, source.frame_count or 0)

        frames: Iterator[Frame] = _until(source, args.duration_s)
        if not _endless(source):
            frames = stack.enter_context(ahead(frames))
        recorder = TrackRecorder(shortest_s=args.shortest_s)
        found = track_video(frames, eyes, recorder, each=each)
        if marks is not None:
            found = marks.refer(found)
        write_tracks(args.out, found.tracks)
        if args.smoothed is not None:
            write_smoothed(args.smoothed, recorder.smoothed())
    notes = Notes()
    for line in source.health.notes:
        notes(line)
    notes.flush()
    elapsed = time.perf_counter() - started
    camera = None if marks is None else marks.camera_height_m
    _tell(args, source, found, (_described(detector), elapsed), camera)


def _tell(
    args: Namespace,
    source: FrameSource,
    found: VideoTracks,
    how: tuple[str, float],
    camera: float | None,
) -> None:
    """Say what was found, looking for what and within how many seconds, and from how high up [m]."""
    looked_for, elapsed = how
    if args.json:
        document = _document(args, source, found, looked_for, elapsed)
        print_json({**document, "camera_height_m": camera})
        return
    print("\n".join(_summary(args, source, found, looked_for, elapsed)))
    if camera is not None:
        print(f"  marks {args.mark_height:g} m above the ground, the camera {camera:.2f} m")


def _refuse(args: Namespace) -> None:
    """Raise for options that do not go together, before anything is opened."""
    refuse_marks(args)
    read = (args.calibration, args.motion)
    inputs = [Path(args.video), *(path for path in read if path is not None)]
    outputs = {"--out": args.out, "--preview": args.preview, "--smoothed": args.smoothed}
    named = {option: path for option, path in outputs.items() if path is not None}
    for option, path in named.items():
        refuse_overwriting(option, path, inputs)
    if len({path.resolve() for path in named.values()}) < len(named):
        raise InputError(f"{', '.join(named)} must name different files")
    if args.preview is None and args.calibration is not None:
        raise InputError("--calibration is for the preview; give --preview FILE.mp4 too")
    if args.preview is not None and args.preview.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"--preview {args.preview}: expected a name that ends in {', '.join(SUFFIXES)}"
        )


def _detector(args: Namespace) -> Detector:
    """Make the detector; one that chooses looks at frames from all over a file first."""
    from airground.vision.detectors.auto import AutoDetector
    from airground.vision.detectors.moving import MovingDetector
    from airground.vision.detectors.registry import make_detector
    from airground.vision.sources import open_source

    detector = make_detector(args.detector)
    if not isinstance(detector, AutoDetector):
        return detector
    with open_source(args.video, rate_hz=args.rate_hz) as source:
        if _endless(source):
            return detector
        step = max((source.frame_count or PROBES) // PROBES, 1)
        chosen = detector.choose(islice(source, 0, None, step))
    if args.stabilize and isinstance(chosen, MovingDetector):
        return MovingDetector()  # what it learnt is the background of a camera that stands
    return chosen


def _endless(source: FrameSource) -> bool:
    return hasattr(source, "start")


def _until(frames: FrameSource, duration_s: float | None) -> Iterator[Frame]:
    """Frames of the first seconds, and none of another segment: its times need not be comparable."""
    first: Frame | None = None
    for frame in frames:
        first = first or frame
        if frame.segment != first.segment:
            print(
                f"note: the camera went away at {frame.t - first.t:.1f} s and came back; stopped there",
                file=sys.stderr,
            )
            return
        if duration_s is not None and frame.t - first.t > duration_s:
            return
        yield frame


def _document(
    args: Namespace, source: FrameSource, found: VideoTracks, detector: str, elapsed: float
) -> dict[str, object]:
    tracks, health = found.tracks, source.health
    targets = {}
    for name in tracks.targets:
        rows = tracks.rows(name)
        t = tracks.t[rows]
        targets[name] = {
            "sightings": len(t),
            "first_s": float(t[0]),
            "last_s": float(t[-1]),
            "sigma_px": None if tracks.sigma is None else float(np.median(tracks.sigma[rows])),
        }
    return {
        "video": source.name,
        "out": str(args.out),
        "detector": detector,
        "clock": found.clock,
        "image_size_px": list(found.image_size_px),
        "frames": found.frames,
        "duration_s": found.duration_s,
        "sightings": len(tracks),
        "targets": targets,
        "stabilized": args.stabilize,
        "unplaced_frames": dict(found.unplaced),
        "corrupt_frames": health.corrupt,
        "dropped_frames": health.dropped,
        "late_frames": health.late,
        "elapsed_s": elapsed,
    }


def _summary(
    args: Namespace, source: FrameSource, found: VideoTracks, detector: str, elapsed: float
) -> list[str]:
    tracks, width, height = found.tracks, *found.image_size_px
    lines = [
        f"{args.out}: {len(tracks)} sightings of {len(tracks.targets)} "
        f"{'target' if len(tracks.targets) == 1 else 'targets'} in {found.frames} frames "
        f"({width}x{height}, {found.duration_s:.1f} s, clock: {found.clock}); looked for {detector}; "
        f"{found.frames / elapsed:.0f} frames/s"
    ]
    lost = sum(found.unplaced.values())
    if lost:
        why = ", ".join(f"{reason} {count}" for reason, count in sorted(found.unplaced.items()))
        lines.append(f"  left out {lost} frames that could not be referred to the first: {why}")
    if source.health.corrupt:
        lines.append(f"  left out {source.health.corrupt} damaged frames")
    by_length = sorted(tracks.targets, key=lambda name: -_length(tracks.rows(name)))
    for name in by_length[:LISTED]:
        rows = tracks.rows(name)
        t = tracks.t[rows]
        sigma = "" if tracks.sigma is None else f", {np.median(tracks.sigma[rows]):.2f} px"
        lines.append(f"  {printable(name)}: {len(t)} sightings, {t[0]:.2f} to {t[-1]:.2f} s{sigma}")
    if len(by_length) > LISTED:
        lines.append(f"  and {len(by_length) - LISTED} shorter ones")
    return lines


def _described(detector: Detector) -> str:
    """What a detector looks for, in a word or two."""
    from airground.vision.detectors.auto import AutoDetector
    from airground.vision.detectors.moving import MovingDetector
    from airground.vision.detectors.tags import TagDetector

    if isinstance(detector, AutoDetector) and detector.chosen is not None:
        return _described(detector.chosen)
    if isinstance(detector, TagDetector):
        return f"tags {'+'.join(family.name for family in detector.families)}"
    if isinstance(detector, MovingDetector):
        return "moving things"
    return type(detector).__name__.removesuffix("Detector").lower()


def _length(rows: slice) -> int:
    return int(rows.stop - rows.start)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise ArgumentTypeError(f"expected a number above zero, not {shown(text)}")
    return value
