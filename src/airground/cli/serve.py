"""``airground serve`` and ``airground record``: the live system with the operator's console in the browser."""

from __future__ import annotations

import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from airground.cli.output import note, print_json, printable, whole_number
from airground.errors import AirgroundError, InputError, UnreachableError

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from airground.calibration import Calibration
    from airground.records.site import Site
    from airground.session.compose import SitePlan

__all__ = ["EXAMPLE", "NAME", "SUMMARY", "add_arguments", "add_live_arguments", "open_plan", "run"]

NAME = "serve"
SUMMARY = "run the live system, with the operator's console in the browser"
EXAMPLE = """\
  airground serve                                   the embedded world: a rendered camera and two robots
  airground serve --site site.toml --port 8080
  airground serve --site site.toml --host 0.0.0.0   for others in the network; prints an address with a token

Open the address that it prints. It ends with Ctrl-C; robots are stopped.
"""

LOOK_S = 0.2
TOKEN_BYTES = 400


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    add_live_arguments(parser)
    parser.add_argument(
        "--record", type=Path, metavar="FILE", help="record everything to this file (MCAP)"
    )


def add_live_arguments(parser: ArgumentParser) -> None:
    """Declare what all live commands share.

    Parameters
    ----------
    parser : ArgumentParser
        The command's own.
    """
    parser.add_argument(
        "--site",
        type=Path,
        metavar="SITE",
        help="cameras, robots and limits (TOML); without, the embedded world",
    )
    parser.add_argument(
        "--calibration",
        type=Path,
        metavar="C",
        help="calibration to begin with (JSON); default: the site's, or none",
    )
    parser.add_argument("--host", metavar="HOST", help="address to serve at (default: 127.0.0.1)")
    parser.add_argument(
        "--port",
        type=whole_number,
        metavar="PORT",
        help="port to serve at, 0 for any (default: 8000)",
    )
    parser.add_argument(
        "--token-file",
        type=Path,
        metavar="FILE",
        help="file with the token that browsers must know; default: beyond this computer a new one, else none",
    )
    parser.add_argument(
        "--robots",
        type=whole_number,
        metavar="N",
        help="robots in the embedded world, 1 to 6 (default: 2)",
    )
    parser.add_argument(
        "--seconds", type=whole_number, metavar="S", help="end after so long; default: with Ctrl-C"
    )
    parser.add_argument(
        "--seed",
        type=whole_number,
        default=0,
        metavar="N",
        help="of the embedded world (default: 0)",
    )


def run(args: Namespace) -> None:
    """Serve until somebody ends it.

    Parameters
    ----------
    args : Namespace
        As parsed.

    Raises
    ------
    InputError
        If the site or an argument is wrong.
    UnreachableError
        If a camera, a robot or the address cannot be reached.
    AirgroundError
        If the session ended by itself, which is a bug of ours.
    """
    from airground.console.server import ConsoleServer
    from airground.session.compose import LiveSite

    site, plan, calibration = open_plan(args)
    console = None if site is None else site.console
    host = args.host or (console.host if console else "127.0.0.1")
    port = args.port if args.port is not None else (console.port if console else 8000)
    token_file = args.token_file or (console.token_file if console else None)
    record = _recording(args, site)
    with ExitStack() as stack:
        live_site = LiveSite(plan, calibration, record=record, note=note)
        live = stack.enter_context(live_site).live
        token = None if token_file is None else _token(token_file)
        server = stack.enter_context(ConsoleServer(live, host, port, token))
        if args.json:
            print_json({"url": server.url, "port": server.port, "recording": live.recording})
            sys.stdout.flush()
        else:
            print(f"airground console: {server.url}", flush=True)
            if live.recording:
                print(f"recording to {printable(live.recording)}", flush=True)
            print("Ctrl-C ends it and stops all robots", flush=True)
        end = None if args.seconds is None else time.monotonic() + args.seconds
        waiting = threading.Event()
        while live.running and not server.wait(0):
            if end is not None and time.monotonic() > end:
                return
            waiting.wait(LOOK_S)
        if live.failed:
            raise AirgroundError(f"the session has ended, robots were stopped: {live.failed}")
        raise UnreachableError("the console has ended by itself")


def open_plan(args: Namespace) -> tuple[Site | None, SitePlan, Calibration | None]:
    """Read site and calibration.

    Parameters
    ----------
    args : Namespace
        As parsed.

    Returns
    -------
    site : Site or None
        None for the embedded world.
    plan : SitePlan
        What is to be opened.
    calibration : Calibration or None
        To begin with.

    Raises
    ------
    InputError
        If something is wrong with them.
    """
    from airground.calibration import Calibration
    from airground.records.site_reader import read_site
    from airground.session.compose import plan_of_site, plan_without_site

    if args.site is not None and args.robots is not None:
        raise InputError("--robots goes with the embedded world; a site lists its robots")
    site = None if args.site is None else read_site(args.site)
    if site is None:
        robots = 2 if args.robots is None else args.robots
        plan = plan_without_site(robots=robots, seed=args.seed)
    else:
        plan = plan_of_site(site)
    file = args.calibration or plan.calibration
    return site, plan, None if file is None else Calibration.load(file)


def _recording(args: Namespace, site: Site | None) -> Path | None:
    record: Path | None = getattr(args, "record", None) or getattr(args, "out", None)
    if record is not None or site is None or site.record is None:
        return record
    from airground.records import make_folder

    make_folder(site.record.folder)
    return site.record.folder / time.strftime("session-%Y%m%d-%H%M%S.mcap")


def _token(path: Path) -> str:
    from airground.records.access import file_error

    try:
        with path.open("rb") as file:
            token = file.read(TOKEN_BYTES).decode("ascii").strip()
    except OSError as error:
        raise file_error(path, error, "read") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: a token is letters, digits, - and _") from error
    return token
