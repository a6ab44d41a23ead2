"""``airground speed``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from airground.calibration import Calibration, measure_speeds
from airground.cli.output import Notes, print_json, printable, refuse_overwriting
from airground.errors import InputError
from airground.records import read_tracks, write_speeds

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "speed"
SUMMARY = "measure the ground velocity of every target, with its standard deviation"
EXAMPLE = """\
  airground speed --calibration calibration.json --tracks tracks.csv --out speeds.csv
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
    parser.add_argument(
        "--tracks", type=Path, required=True, metavar="T", help="where targets were seen (CSV)"
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="S", help="speeds to write (CSV)"
    )


def run(args: Namespace) -> None:
    """Measure, write the file, say how it went.

    Parameters
    ----------
    args : Namespace
        As parsed.
    """
    started = time.perf_counter()
    refuse_overwriting("--out", args.out, (args.tracks, args.calibration))
    notes = Notes()
    calibration = Calibration.load(args.calibration)
    tracks = read_tracks(args.tracks, note=notes)
    speeds = measure_speeds(calibration, tracks)
    if len(speeds.t) == 0:
        raise InputError(
            f"{args.tracks}: no sighting has a neighbour in time and lies on the ground; nothing to measure"
        )
    if speeds.lonely:
        notes(f"{speeds.lonely} sightings left out: no other one of that target is near in time")
    if speeds.beyond:
        notes(f"{speeds.beyond} sightings left out: they lie on or beyond the horizon")
    if speeds.assumed_noise:
        notes(
            f"{len(speeds.assumed_noise)} targets are too short, or stand too still, to show their noise: taken as 1 px"
        )
    write_speeds(
        args.out,
        t=speeds.t,
        targets=speeds.targets,
        target_index=speeds.target_index,
        uv=speeds.uv,
        xy_dot=speeds.xy_dot,
        speed_sigma=speeds.speed_sigma,
    )
    notes.flush()
    rows = speeds.by_target()
    if args.json:
        print_json(
            {
                "rows": len(speeds.t),
                "left_out_lonely": speeds.lonely,
                "left_out_beyond_horizon": speeds.beyond,
                "targets": rows,
                "elapsed_s": time.perf_counter() - started,
            }
        )
        return
    print(
        f"{args.out}: {len(speeds.t)} velocities of {len(rows)} target{'' if len(rows) == 1 else 's'}"
    )
    for row in rows[:20]:
        print(
            f"  {printable(str(row['target']))}: median {row['speed_median_mps']:.3f} m/s, "
            f"largest {row['speed_max_mps']:.3f}, deviation {row['speed_sigma_median_mps']:.3f}"
        )
    if len(rows) > 20:
        print(f"  and {len(rows) - 20} more")
