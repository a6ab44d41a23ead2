"""Arguments of all commands."""

from __future__ import annotations

import argparse
import re
from typing import Any, NoReturn

from airground._version import __version__
from airground.cli import (
    calibrate,
    demo,
    drive,
    identify,
    inspect,
    record,
    replay,
    reproduce,
    serve,
    speed,
    track,
)
from airground.errors import InputError

__all__ = ["build_parser"]

DESCRIPTION = """\
A camera that looks down on something that drives becomes a metric sensor and a joystick.

  airground demo                                    see it work, in a simulated world
  airground serve                                   a live system to play with: open the address that it prints
  airground track --video drive.mp4 --out tracks.csv --preview preview.mp4
  airground calibrate --tracks tracks.csv --motion motion.csv --out calibration.json
  airground inspect calibration.json --picture view.png
  airground speed --calibration calibration.json --tracks tracks.csv --out speeds.csv
  airground drive --calibration calibration.json --goal 640,420
"""

EPILOG = (
    "Exit codes: 0 done, 2 wrong input, 3 the data do not determine the answer, "
    "4 a camera or robot cannot be reached or was lost, 130 interrupted, 1 a bug of ours."
)


COMMANDS = (
    demo,
    serve,
    track,
    identify,
    calibrate,
    inspect,
    speed,
    drive,
    record,
    replay,
    reproduce,
)


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, like all our errors."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # -1e-3 and -5,3 are no options

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see {self.prog} --help")


def build_parser() -> argparse.ArgumentParser:
    """Set up the parser; each command's namespace carries the function that runs it.

    Returns
    -------
    parser : argparse.ArgumentParser
        Raises InputError where argparse would exit.
    """
    parser = _Parser(
        prog="airground",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"airground {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in COMMANDS:
        sub = commands.add_parser(
            command.NAME,
            help=command.SUMMARY,
            description=f"{command.SUMMARY[0].upper()}{command.SUMMARY[1:]}.\n\n{command.EXAMPLE}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        command.add_arguments(sub)
        sub.add_argument(
            "--json",
            action="store_true",
            help="print one JSON object on stdout, everything else on stderr",
        )
        sub.set_defaults(run=command.run)
    return parser
