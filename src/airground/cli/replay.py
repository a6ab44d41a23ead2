"""``airground replay``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from airground.cli.output import note, print_json
from airground.cli.terminal import status
from airground.errors import AirgroundError

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "run"]

NAME = "replay"
SUMMARY = "feed a recorded session to the same loop again, and compare what it decides"
EXAMPLE = """\
  airground replay session.mcap

Sightings, readings and orders go in as they did, at the same times; tracks and commands must come out the same.
"""

SAY_EVERY = 500  # steps


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument("session", type=Path, metavar="SESSION", help="recording (MCAP)")


def run(args: Namespace) -> None:
    """Replay, and say whether it went the same way.

    Parameters
    ----------
    args : Namespace
        As parsed.

    Raises
    ------
    AirgroundError
        If it went another way.
    """
    from airground.session.replaying import replay

    with status() as say:

        def each(number: int, t: float) -> None:
            if number % SAY_EVERY == 0:
                say(f"replay: {t:.0f} s")

        done = replay(args.session, each=lambda tick: each(tick.number, tick.t))
    if done.cut:
        note(f"{args.session}: {done.cut}; all before is replayed")
    difference = done.difference
    if args.json:
        print_json(
            {
                "steps": done.steps,
                "frames": done.frames,
                "commands": done.commands,
                "duration_s": done.duration_s,
                "same": difference is None,
                "first_difference": None
                if difference is None
                else {"step": difference.step, "t_s": difference.t, "what": difference.what},
                "cut": done.cut,
            }
        )
    else:
        print(
            f"{done.duration_s:.1f} s: {done.steps} steps, {done.frames} frames, {done.commands} commands other than "
            "rest"
        )
    if difference is not None:
        raise AirgroundError(
            f"{args.session}: from step {difference.step}, at {difference.t:.2f} s, it goes another way: "
            f"{difference.what}; was it recorded by another version?"
        )
    if not args.json:
        print("the same tracks and the same commands")
