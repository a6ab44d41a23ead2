"""``airground identify``."""

from __future__ import annotations

import math
from argparse import ArgumentTypeError
from pathlib import Path
from typing import TYPE_CHECKING, Any

from airground.calibration.identify import LEAST_CONFIDENCE, REACH_S, identify
from airground.cli.output import Notes, print_json, printable, refuse_overwriting
from airground.records import read_motion, read_tracks, write_tracks
from airground.records.cells import shown

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from airground.calibration.identify import RobotIdentity

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "identify"
SUMMARY = "find which of many unnamed tracks are the robots, from how they move"
EXAMPLE = """\
  airground identify --tracks seen.csv --motion motion.csv --out tracks.csv
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "--tracks",
        type=Path,
        required=True,
        metavar="T",
        help="where things were seen, under any names (CSV)",
    )
    parser.add_argument(
        "--motion", type=Path, required=True, metavar="M", help="how robots moved (CSV)"
    )
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="T2",
        help="tracks to write, with the robots' names where they are (CSV)",
    )
    parser.add_argument(
        "--time-offset-s",
        type=_offset,
        default=None,
        metavar="auto|NUMBER",
        help="to be added to times of the tracks to get times of the motion file; known, it tells apart "
        "vehicles that follow each other (default: auto)",
    )
    parser.add_argument(
        "--reach-s",
        type=float,
        default=REACH_S,
        metavar="S",
        help="how far apart the two clocks may be, where the offset is not given (default: %(default)s)",
    )
    parser.add_argument(
        "--left-handed",
        action="store_true",
        help="the motion file's y axis points to the right of x, as in north-east",
    )
    parser.add_argument(
        "--least-confidence",
        type=float,
        default=LEAST_CONFIDENCE,
        metavar="P",
        help="probability from which on an answer is accepted (default: %(default)s)",
    )


def run(args: Namespace) -> None:
    """Identify, write the tracks, say which is which.

    Parameters
    ----------
    args : Namespace
        As parsed.
    """
    refuse_overwriting("--out", args.out, (args.tracks, args.motion))
    notes = Notes()
    tracks = read_tracks(args.tracks, note=notes)
    motion = read_motion(args.motion, note=notes)
    found = identify(
        tracks,
        motion,
        time_offset_s=args.time_offset_s,
        reach_s=args.reach_s,
        left_handed=args.left_handed,
        least_confidence=args.least_confidence,
        note=notes,
    ).require()
    write_tracks(args.out, found.tracks)
    notes.flush()
    if args.json:
        print_json(
            {
                "robots": {robot.robot: _document(robot) for robot in found.robots},
                "time_offset_s": found.time_offset_s,
                "tracks": len(tracks.targets),
            }
        )
        return
    some = sum(robot.identified for robot in found.robots)
    print(
        f"{args.out}: {some} of {len(found.robots)} robots identified among {len(tracks.targets)} tracks"
    )
    for robot in found.robots:
        print(printable(f"  {robot.robot}: {_said(robot)}"))


def _said(robot: RobotIdentity) -> str:
    if not robot.identified:
        return f"not identified: {robot.reason}; {robot.advice}"
    spans = ", ".join(f"{s.track} ({s.first_s:.1f} to {s.last_s:.1f} s)" for s in robot.spans[:6])
    more = "" if len(robot.spans) <= 6 else f" and {len(robot.spans) - 6} more"
    return f"{spans}{more}; confidence {math.floor(robot.confidence * 1000) / 1000:.3f}"


def _document(robot: RobotIdentity) -> dict[str, Any]:
    return {
        "identified": robot.identified,
        "confidence": robot.confidence,
        "margin": robot.margin,
        "spans": [
            {
                "track": s.track,
                "first_s": s.first_s,
                "last_s": s.last_s,
                "sightings": s.sightings,
            }
            for s in robot.spans
        ],
        "candidates": list(robot.candidates),
        "reason": robot.reason,
        "advice": robot.advice,
    }


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
