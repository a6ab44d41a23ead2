"""``airground demo``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from airground.cli.output import print_json, whole_number
from airground.cli.terminal import show_demo, status

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "demo"
SUMMARY = "see it work: a simulated camera and robot, calibration drive, calibration, report"
EXAMPLE = """\
  airground demo --out out/demo
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("airground-demo"),
        metavar="DIR",
        help="where to write (default: %(default)s)",
    )
    parser.add_argument(
        "--seed",
        type=whole_number,
        default=0,
        metavar="N",
        help="of all random numbers (default: 0)",
    )


def run(args: Namespace) -> None:
    """Run the demo, write its files, print its figures.

    Parameters
    ----------
    args : Namespace
        As parsed.
    """
    from airground.studies.demo import run_demo

    with status() as say:
        demo = run_demo(args.out, seed=args.seed, command=args.command_line, say=say)
    if args.json:
        print_json(demo.document())
    else:
        show_demo(demo, args.out)
