"""``airground record``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from airground.cli import serve

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "record"
SUMMARY = "run the live system and record all of it to one file"
EXAMPLE = """\
  airground record --out session.mcap
  airground record --site site.toml --out session.mcap --seconds 600
  airground calibrate session.mcap --out calibration.json
  airground replay session.mcap

What cameras, robots and operators did is in the file, readable by others' tools too (MCAP, Foxglove's schemas),
also after the power was cut.
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="recording to write (MCAP)"
    )
    serve.add_live_arguments(parser)


def run(args: Namespace) -> None:
    """Record until somebody ends it.

    Parameters
    ----------
    args : Namespace
        As parsed.
    """
    serve.run(args)
