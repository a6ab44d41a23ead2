"""The command line: parse, call, print. No maths.

Exit codes: 0 done, 1 a bug of ours, 2 the command or an input is wrong, 3 the data do not determine the answer,
4 something cannot be reached, 130 interrupted.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from typing import TYPE_CHECKING

from airground.cli.parser import build_parser
from airground.errors import AirgroundError

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
    with contextlib.suppress(ValueError):  # not in the main thread: leave signals alone
        signal.signal(signal.SIGTERM, _terminate)
    try:
        args = build_parser().parse_args(arguments)
        args.command_line = " ".join(["airground", *arguments])
        args.run(args)
        sys.stdout.flush()
    except SystemExit as stop:  # --help and --version
        return stop.code if isinstance(stop.code, int) else 0
    except AirgroundError as error:
        print(f"airground: {_one_line(error)}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("airground: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read our output has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    return 0


def _one_line(error: AirgroundError) -> str:
    return " ".join(str(error).split())


def _terminate(number: int, frame: FrameType | None) -> None:
    """Unwind on SIGTERM, so that half-written files are removed."""
    del number, frame
    raise KeyboardInterrupt
