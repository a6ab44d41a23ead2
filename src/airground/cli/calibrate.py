"""``airground calibrate``."""

from __future__ import annotations

import math
import time
from argparse import ArgumentTypeError
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from airground._version import __version__
from airground.calibration import SPEED_SCALE_SIGMA, Provenance, calibrate
from airground.cli.output import (
    Notes,
    image_size,
    print_json,
    printable,
    refuse_overwriting,
    sha256,
)
from airground.errors import InputError
from airground.records import read_motion, read_tracks
from airground.records.calibration_file import calibration_document
from airground.records.cells import shown

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from airground.calibration import Calibration

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "calibrate"
SUMMARY = "calibrate a camera from recordings of a robot that knows its heading and speed"
EXAMPLE = """\
  airground calibrate --tracks tracks.csv --motion motion.csv --out calibration.json --image-size 1280x720
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "--tracks", type=Path, required=True, metavar="T", help="where targets were seen (CSV)"
    )
    parser.add_argument(
        "--motion", type=Path, required=True, metavar="M", help="how they moved on the ground (CSV)"
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="C", help="calibration to write (JSON)"
    )
    parser.add_argument(
        "--method",
        choices=["linear"],
        default="linear",
        help="estimator (default: %(default)s, the paper's; the whole-drive one is to come)",
    )
    parser.add_argument(
        "--time-offset-s",
        type=_offset,
        default=None,
        metavar="auto|NUMBER",
        help="to be added to times of the tracks to get times of the motion file (default: auto)",
    )
    parser.add_argument(
        "--distortion",
        choices=["auto", "none", "division"],
        default="auto",
        help="lens model (default: %(default)s, which the linear method takes as none)",
    )
    parser.add_argument(
        "--image-size", type=image_size, metavar="WxH", help="kept with the calibration"
    )
    parser.add_argument(
        "--speed-scale-sigma",
        type=float,
        default=SPEED_SCALE_SIGMA,
        metavar="S",
        help="relative deviation of the speeds' scale, which no data of one robot tell (default: %(default)s)",
    )


def run(args: Namespace) -> None:
    """Calibrate, write the file, say how it went.

    Parameters
    ----------
    args : Namespace
        As parsed.
    """
    started = time.perf_counter()
    if args.distortion == "division":
        raise InputError(
            "--distortion division: the linear method does not estimate a lens; use none"
        )
    refuse_overwriting("--out", args.out, (args.tracks, args.motion))
    inputs = tuple((str(path), sha256(path)) for path in (args.tracks, args.motion))
    notes = Notes()
    tracks = read_tracks(args.tracks, note=notes)
    motion = read_motion(args.motion, note=notes)
    calibration = calibrate(
        tracks,
        motion,
        method=args.method,
        time_offset_s=args.time_offset_s,
        image_size_px=args.image_size,
        speed_scale_sigma=args.speed_scale_sigma,
        note=notes,
    )
    provenance = Provenance(version=__version__, command=args.command_line, inputs=inputs)
    calibration = replace(calibration, provenance=provenance)
    calibration.save(args.out)
    notes.flush()
    if args.json:
        written = calibration_document(type(calibration).load(args.out))
        print_json({**written, "elapsed_s": time.perf_counter() - started})
    else:
        print("\n".join(_summary(calibration, args.out)))


def _summary(calibration: Calibration, out: Path) -> list[str]:
    c = calibration
    names = printable(", ".join(c.targets))
    return [
        f"{out}: {c.observability.verdict}; ground velocities good to {c.observability.relative_sigma:.1%} "
        "(one standard deviation)",
        f"  {c.fit.sightings} sightings of {names}; residual {c.fit.rms_px:.2f} px over {c.fit.window_s or 0:.2f} s",
        f"  clock offset {c.time_offset_s:+.3f} s (deviation {c.time_offset_sigma_s:.3f} s)",
        *([f"  next: {c.observability.advice}"] if c.observability.verdict == "weak" else []),
    ]


def _offset(text: str) -> float | None:
    if text == "auto":
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ArgumentTypeError(f"expected auto or a number of seconds, not {shown(text)}")
    return value
