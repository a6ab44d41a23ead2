"""``airground reproduce``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from airground.cli.output import print_json, printable, whole_number
from airground.cli.terminal import progress, show_tables
from airground.records.cells import shown

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "reproduce"
MAX_TRIALS = 10_000_000
MAX_JOBS = 1024
# Names of the items, without loading what runs them; a test compares.
NAMES = (
    "table1",
    "fig4",
    "fig5",
    "table2",
    "fig7",
    "fig8",
    "fig9",
    "fig10",
    "fig11",
    "moving",
    "real",
    "beyond",
    "others",
)
SUMMARY = "run the paper's experiments: tables and figures, paper beside ours"
EXAMPLE = """\
  airground reproduce table1 fig4 fig5 --trials 100 --out out/paper
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "items", nargs="*", metavar="ITEM", help=f"any of {', '.join(NAMES)} (default: all)"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="where to put pictures and reproduce.json, and paper.html with all of it where no ITEM is given",
    )
    parser.add_argument(
        "--trials",
        type=_count,
        default=100,
        metavar="N",
        help="simulated drives (default: 100); with fewer than 20 the robot's in MuJoCo are short, too",
    )
    parser.add_argument(
        "--seed",
        type=whole_number,
        default=0,
        metavar="N",
        help="of the random numbers (default: 0)",
    )
    workers = parser.add_mutually_exclusive_group()
    workers.add_argument(
        "--jobs",
        type=_jobs,
        metavar="N",
        help="processes that run the drives (default: all cores); the numbers stay the same",
    )
    workers.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="Dask scheduler whose cluster runs the drives instead, as tcp://host:8786; needs airground[dask]",
    )


def run(args: Namespace) -> None:
    """Run the experiments and print them.

    Parameters
    ----------
    args : Namespace
        As parsed.
    """
    from airground.studies.cluster import Cluster
    from airground.studies.reproduce import reproduce, tables
    from airground.studies.workers import Processes

    with (
        Processes(args.jobs) if args.dask is None else Cluster(args.dask) as workers,
        progress("reproduce") as advance,
    ):
        result = reproduce(
            args.items,
            trials=args.trials,
            seed=args.seed,
            out=args.out,
            progress=advance,
            workers=workers,
        )
    if args.json:
        print_json(result)
    else:
        show_tables(tables(result))
        if args.out is not None and not args.items:
            print(f"open {printable(str(args.out / 'paper.html'))}")


def _jobs(text: str) -> int:
    count = whole_number(text, least=1)
    if count > MAX_JOBS:
        raise argparse.ArgumentTypeError(f"expected at most {MAX_JOBS}, not {shown(text)}")
    return count


def _count(text: str) -> int:
    count = whole_number(text, least=1)
    if count > MAX_TRIALS:
        raise argparse.ArgumentTypeError(f"expected at most {MAX_TRIALS}, not {shown(text)}")
    return count
