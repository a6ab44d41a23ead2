"""The command line: parse, call, print. No maths.

Exit codes: 0 done, 1 a bug of ours, 2 the command or an input is wrong, 3 the data do not determine the answer,
4 something cannot be reached, 130 interrupted.
"""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from airground.cli.output import printable
from airground.cli.parser import build_parser
from airground.errors import AirgroundError, InputError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import FrameType

__all__ = ["main"]

INTERRUPTED = 130
BROKEN_PIPE = 141  # what a shell reports for a program that SIGPIPE ended


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process where not given.

    Returns
    -------
    code : int
        Exit code.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    _prepare()
    try:
        code = _run(arguments)
        sys.stdout.flush()
    except AirgroundError as error:
        for line in getattr(
            error, "lines", (str(error),)
        ):  # a site file tells all its mistakes at once
            print(f"airground: {_one_line(line)}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("airground: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read our output has had enough
        _silence()
        return BROKEN_PIPE
    except OSError as error:
        if error.filename is not None:  # about a file, which should have been a FileError
            raise
        _silence()
        print(f"airground: cannot write to the standard output: {error.strerror}", file=sys.stderr)
        return InputError.exit_code
    return code


def _run(arguments: list[str]) -> int:
    try:
        args = build_parser().parse_args(arguments)
    except SystemExit as stop:  # --help and --version
        return stop.code if isinstance(stop.code, int) else 0
    args.command_line = " ".join(["airground", *arguments])
    args.run(args)
    return 0


def _prepare() -> None:
    """Make streams, signals and libraries behave, whatever they were given."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by whoever started us
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a terminal need not know every letter
    for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP; nohup ignores it, and so do we
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            with contextlib.suppress(ValueError):  # not in the main thread: leave signals alone
                signal.signal(number, _terminate)
    os.environ["MPLBACKEND"] = "agg"  # pictures go to files, whatever is set for others
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # its caches are not our user's concern


def _silence() -> None:
    """Let nothing more be written to the standard output, also at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _one_line(text: str) -> str:
    return printable(" ".join(text.split()))


def _terminate(number: int, frame: FrameType | None) -> None:
    """Unwind on SIGTERM and SIGHUP, so that half-written files are removed."""
    del number, frame
    raise KeyboardInterrupt
