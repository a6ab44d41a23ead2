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

    from airground.calibration import Calibration, Motion, TargetFit, Tracks

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "calibrate"
SUMMARY = "calibrate a camera from recordings of a robot that knows its heading and speed"
EXAMPLE = """\
  airground calibrate --tracks tracks.csv --motion motion.csv --out calibration.json --image-size 1280x720
  airground calibrate session.mcap --out calibration.json
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "session",
        type=Path,
        nargs="?",
        metavar="SESSION",
        help="log of a live session (MCAP), in place of --tracks and --motion",
    )
    parser.add_argument("--tracks", type=Path, metavar="T", help="where targets were seen (CSV)")
    parser.add_argument(
        "--motion", type=Path, metavar="M", help="how they moved on the ground (CSV)"
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="C", help="calibration to write (JSON)"
    )
    parser.add_argument(
        "--method",
        choices=["trajectory", "linear"],
        default="trajectory",
        help="estimator: the whole drive as one problem, or the paper's eqs. 16 and 17 (default: %(default)s)",
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
        help="lens: estimated where the data show one, never, or always (default: %(default)s); "
        "the linear method knows none",
    )
    parser.add_argument(
        "--image-size",
        type=image_size,
        metavar="WxH",
        help="kept with the calibration; its middle is taken as the lens's",
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
    if args.distortion == "division" and args.method == "linear":
        raise InputError(
            "--distortion division: the linear method does not estimate a lens; use --method trajectory"
        )
    paths = _inputs(args)
    refuse_overwriting("--out", args.out, paths)
    inputs = tuple((str(path), sha256(path)) for path in paths)
    notes = Notes()
    tracks, motion, size = _read(args, notes)
    calibration = calibrate(
        tracks,
        motion,
        method=args.method,
        time_offset_s=args.time_offset_s,
        distortion=args.distortion,
        image_size_px=size,
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


def _inputs(args: Namespace) -> tuple[Path, ...]:
    """Files to read: one session, or tracks and motion."""
    pair = {"--tracks": args.tracks, "--motion": args.motion}
    given = [option for option, path in pair.items() if path is not None]
    if args.session is not None:
        if given:
            raise InputError(f"give either {args.session} or {' and '.join(given)}, not both")
        return (args.session,)
    if len(given) < len(pair):
        missing = " and ".join(option for option in pair if option not in given)
        raise InputError(f"{missing} must be given, or the log of a live session: SESSION")
    return (args.tracks, args.motion)


def _read(args: Namespace, notes: Notes) -> tuple[Tracks, Motion, tuple[int, int] | None]:
    if args.session is None:
        tracks, motion = read_tracks(args.tracks, note=notes), read_motion(args.motion, note=notes)
        return tracks, motion, args.image_size
    from airground.records.session_recording import read_recording

    drive = read_recording(args.session, note=notes)
    return drive.tracks, drive.motion, args.image_size or drive.image_size_px


def _summary(calibration: Calibration, out: Path) -> list[str]:
    c = calibration
    names = printable(", ".join(c.targets))
    lines = [
        f"{out}: {c.observability.verdict}; ground velocities good to {c.observability.relative_sigma:.1%} "
        "(one standard deviation)",
        f"  {c.fit.sightings} sightings of {names}, {c.fit.inlier_fraction:.1%} follow; residual {c.fit.rms_px:.2f} px"
        + ("" if c.fit.window_s is None else f" over {c.fit.window_s:.2f} s"),
        f"  clock offset {c.time_offset_s:+.3f} s (deviation {c.time_offset_sigma_s:.3f} s)",
    ]
    if c.lens is not None:
        sigma = "" if c.k1_sigma is None else f" (deviation {c.k1_sigma:.1e})"
        lines.append(f"  lens k1 {c.lens.k1:+.3e} per px2{sigma}")
    lines += [line for name, t in c.targets.items() for line in _target_lines(printable(name), t)]
    if c.observability.verdict == "weak":
        lines.append(f"  next: {c.observability.advice}")
    return lines


def _target_lines(name: str, target: TargetFit) -> list[str]:
    said = []
    if target.heading_bias_rad is not None:
        said.append(
            f"heading reads {math.degrees(target.heading_bias_rad):+.2f} deg too much"
            + _deviation(target.heading_bias_sigma_rad, 180 / math.pi, "deg")
        )
    if target.speed_scale is not None:
        said.append(
            f"speed reads {target.speed_scale:.4f} of the first's"
            + _deviation(target.speed_scale_sigma, 1, "")
        )
    if target.lever_arm_m is not None:
        forward, left = target.lever_arm_m
        said.append(f"seen {forward:+.3f} m ahead, {left:+.3f} m left of what is read")
    if target.heading_drift_rad_per_sqrt_s is not None:
        said.append(
            f"heading wanders by {math.degrees(target.heading_drift_rad_per_sqrt_s):.2f} deg/sqrt(s)"
        )
    return [f"  {name}: " + "; ".join(said)] if said else []


def _deviation(sigma: float | None, factor: float, unit: str) -> str:
    return "" if not sigma else f" (deviation {sigma * factor:.2g}{' ' + unit if unit else ''})"


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
