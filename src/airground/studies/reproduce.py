"""The paper's tables and figures: run, collect, draw, print. Later items plug into `ITEMS`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from airground.errors import InputError
from airground.records import make_folder
from airground.records.atomic import replacing, write_text
from airground.studies.beyond import BEYOND
from airground.studies.fig4 import FIG4
from airground.studies.fig5 import FIG5
from airground.studies.fig7 import FIG7
from airground.studies.fig8 import FIG8
from airground.studies.fig9 import FIG9, FIG10
from airground.studies.fig11 import FIG11
from airground.studies.item import Item, Outcome, Work
from airground.studies.moving import MOVING
from airground.studies.others import OTHERS
from airground.studies.paper_page import write_paper_page
from airground.studies.real import REAL
from airground.studies.sheet import rich_table
from airground.studies.simulation import require_trials
from airground.studies.table1 import TABLE1
from airground.studies.table2 import TABLE2
from airground.studies.workers import HERE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from rich.table import Table

    from airground.studies.simulation import Progress
    from airground.studies.workers import Workers

__all__ = ["ITEMS", "reproduce", "tables"]

ITEMS: dict[str, Item] = {
    "table1": TABLE1,
    "fig4": FIG4,
    "fig5": FIG5,
    "table2": TABLE2,
    "fig7": FIG7,
    "fig8": FIG8,
    "fig9": FIG9,
    "fig10": FIG10,
    "fig11": FIG11,
    "moving": MOVING,
    "real": REAL,
    "beyond": BEYOND,
    "others": OTHERS,
}
"""What can be reproduced, in the paper's order; then the same on recordings, and what the paper could not do."""


def reproduce(
    items: Sequence[str],
    *,
    trials: int = 100,
    seed: int = 0,
    out: Path | None = None,
    progress: Progress | None = None,
    workers: Workers = HERE,
) -> dict[str, object]:
    """Run the paper's experiments.

    Parameters
    ----------
    items : sequence of str
        Keys of `ITEMS`; none for all of them.
    trials : int
        Simulated drives.
    seed : int
        Of all random numbers.
    out : Path, optional
        Folder for pictures and ``reproduce.json``, with ``paper.html`` where all items run; made where it is missing.
    progress : callable, optional
        Told how many trials are done, and of how many.
    workers : Workers
        Who runs the trials; the numbers do not depend on it.

    Returns
    -------
    result : dict
        The JSON object: one entry per item, paper beside ours.

    Raises
    ------
    InputError
        If an item is not known or not built yet, `trials` is less than one, or `seed` is negative.
    FileError
        If `out` cannot be made or written to.
    """
    names = _chosen(items)
    require_trials(trials, seed)
    if out is not None:
        make_folder(out)  # before the long work, not after
    work = Work(trials, seed, progress, workers)
    outcomes = {name: ITEMS[name].compute(work) for name in names}
    result: dict[str, object] = {name: outcome.document for name, outcome in outcomes.items()}
    if out is not None:
        _write(out, outcomes, result)
        if not items:
            drawn = [name for name, outcome in outcomes.items() if outcome.draw is not None]
            write_paper_page(out, ITEMS, result, pictures=drawn, trials=trials, seed=seed)
    return result


def tables(result: Mapping[str, Any]) -> list[Table]:
    """Tables for the terminal, from what `reproduce` gave.

    Parameters
    ----------
    result : mapping
        The JSON object.

    Returns
    -------
    tables : list of rich.table.Table
        One per item.
    """
    return [rich_table(ITEMS[name].sheet(document)) for name, document in result.items()]


def _chosen(items: Sequence[str]) -> list[str]:
    """Each item once, in the order asked for."""
    known = ", ".join(ITEMS)
    for name in items:
        if name not in ITEMS:
            raise InputError(f"there is no item {name!r}; there are {known}")
    return list(dict.fromkeys(items)) or list(ITEMS)


def _write(out: Path, outcomes: Mapping[str, Outcome], result: Mapping[str, object]) -> None:
    for name, outcome in outcomes.items():
        if outcome.draw is not None:
            with replacing(out / f"{name}.png") as temporary:
                outcome.draw(temporary)
    write_text(out / "reproduce.json", json.dumps(result, indent=2, allow_nan=False) + "\n")
