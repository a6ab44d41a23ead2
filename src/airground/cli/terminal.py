"""Tables and progress on a terminal; plain text in a pipe."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path

    from airground.studies.demo import Demo

__all__ = ["progress", "show_demo", "show_tables", "status"]

NARROWEST = 72  # columns


@contextmanager
def progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar on stderr, on a terminal only.

    Parameters
    ----------
    title : str
        What is being done.

    Yields
    ------
    advance : callable
        Takes how much is done, and of how much.
    """
    console = Console(stderr=True)
    if not sys.stderr.isatty():  # rich would take FORCE_COLOR for a terminal
        yield lambda _done, _total: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(title, total=None)

        def advance(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        yield advance


@contextmanager
def status() -> Iterator[Callable[[str], None]]:
    """Show what is being done on stderr, on a terminal only.

    Yields
    ------
    say : callable
        Takes one line.
    """
    console = Console(stderr=True)
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    with console.status("start") as spinner:
        yield spinner.update


def show_tables(tables: Iterable[Table]) -> None:
    """Print tables on stdout.

    Parameters
    ----------
    tables : iterable of Table
        One after the other.
    """
    for table in tables:
        _print(table)


def show_demo(demo: Demo, out: Path) -> None:
    """Print the demo's figures and files.

    Parameters
    ----------
    demo : Demo
        What to print.
    out : Path
        Where its files are.
    """
    from airground.studies.report import figure_rows

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("what", "found", "truth", ""):
        table.add_column(title)
    for row in figure_rows(demo):
        table.add_row(*row)
    _print(table)
    report = (str(out / "report.html"), "bold")  # as it is: a path may hold what is markup to rich
    _print(Text.assemble(f"\n{demo.elapsed_s:.1f} s; open ", report))


def _print(what: Table | Text) -> None:
    """Print as wide as the terminal, or wide enough for all tables in a pipe or a file."""
    console = Console(highlight=False)
    # In a terminal narrower than that, broken lines tell more than figures cut short.
    console.width = max(console.width, NARROWEST) if sys.stdout.isatty() else 140
    with console.capture() as text:  # print knows what to do when nobody reads on; rich would exit
        console.print(what, soft_wrap=isinstance(what, Text))
    print(text.get(), end="")
