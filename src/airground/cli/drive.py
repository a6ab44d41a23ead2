"""``airground drive``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from airground.cli.output import Notes, print_json, refuse_overwriting, two_numbers, whole_number
from airground.cli.terminal import status
from airground.errors import InputError

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "drive"
SUMMARY = "drive a robot to a pixel, or along a path sketched in the image"
EXAMPLE = """\
  airground drive --calibration calibration.json --goal 700,420
  airground drive --calibration calibration.json --path path.csv --speed-mps 0.3 --out out/drive
  airground drive --calibration calibration.json --site site.toml --robot red --goal 700,420

Without a site it drives in the embedded world: the demo's, if the calibration is one of its camera; otherwise in
one that the calibration could have come from, with a true g that is off by what the calibration is uncertain.
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "--calibration", type=Path, required=True, metavar="C", help="calibration (JSON)"
    )
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument(
        "--goal",
        type=two_numbers,
        action="append",
        metavar="U,V",
        help="pixel to drive to; give it again for further ones",
    )
    where.add_argument(
        "--path", type=Path, metavar="P", help="sketched path: CSV with u_px,v_px[,speed_mps]"
    )
    parser.add_argument(
        "--site", type=Path, metavar="SITE", help="drive a robot of a live site (TOML) instead"
    )
    parser.add_argument("--robot", metavar="NAME", help="which of the site's robots; the first")
    parser.add_argument(
        "--heading-deg",
        type=_finite,
        metavar="DEG",
        help="heading to end with, at the last goal; default: any",
    )
    parser.add_argument(
        "--speed-mps",
        type=_positive,
        metavar="V",
        help="ground speed to hold; default: 0.3 in the demo's world, elsewhere what crosses the view in 12 s",
    )
    parser.add_argument(
        "--latency-s",
        type=_latency,
        default=0.1,
        metavar="S",
        help="from a picture's exposure to its arrival (default: %(default)s)",
    )
    parser.add_argument(
        "--sight",
        choices=("images", "points"),
        help="rendered images with a tag, or noisy points; default: images in the demo's world",
    )
    parser.add_argument(
        "--seed",
        type=whole_number,
        default=0,
        metavar="N",
        help="of the random numbers (default: 0)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where to write what was driven, and its pictures"
    )


def run(args: Namespace) -> None:
    """Drive, and say how it went.

    Parameters
    ----------
    args : Namespace
        As parsed.

    Raises
    ------
    InputError
        If what is asked for cannot be driven.
    """
    if args.robot is not None and args.site is None:
        raise InputError("--robot goes with --site; the embedded world of drive has one robot")
    if args.heading_deg is not None and args.path is not None:
        raise InputError("--heading-deg goes with --goal; a path ends in its own direction")
    from airground.calibration import Calibration
    from airground.records import read_path
    from airground.studies.drive import drive_in_world
    from airground.studies.drive_result import DriveOrder

    notes = Notes()
    calibration = Calibration.load(args.calibration)
    drawn = None if args.path is None else read_path(args.path, note=notes)
    if args.site is not None:
        from airground.cli.drive_site import drive_site

        drive_site(args, calibration, drawn)
        notes.flush()
        return
    order = DriveOrder(
        goals_px=tuple(args.goal or ()),
        drawn=drawn,
        heading_deg=args.heading_deg,
        speed_mps=args.speed_mps,
        latency_s=args.latency_s,
        sight=args.sight,
        seed=args.seed,
    )
    if args.out is not None:
        inputs = [p for p in (args.calibration, args.path) if p is not None]
        for name in ("driven.csv", "drive.json", "drive.png"):
            refuse_overwriting("--out", args.out / name, inputs)
    with status() as say:
        result = drive_in_world(calibration, order, say=say, note=notes, out=args.out)
    notes.flush()
    document = result.document()
    if args.json:
        print_json(document)
        return
    for line in result.lines():
        print(line)


def _finite(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e9:
        raise argparse.ArgumentTypeError(f"expected a number, not {text!r}")
    return value


def _positive(text: str) -> float:
    value = _finite(text)
    if not 0 < value < 1e3:
        raise argparse.ArgumentTypeError(f"expected a speed in m/s, above 0, not {text!r}")
    return value


def _latency(text: str) -> float:
    value = _finite(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"expected 0 to 1 s, not {text!r}")
    return value
