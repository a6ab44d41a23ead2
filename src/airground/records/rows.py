"""Rows of a recording in the order of target and time, each target once at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import FileError
from airground.records.cells import shown

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.records.csv_table import Table

__all__ = ["sort_rows"]

TARGET, TIME = "target", "t_s"


def sort_rows(
    table: Table, what: str
) -> tuple[tuple[str, ...], IntArray, dict[str, FloatArray], list[str]]:
    """Sort a table by target and time, and drop rows that repeat another.

    Parameters
    ----------
    table : Table
        With the columns target and t_s; all its columns are compared.
    what : str
        What its rows are, in the plural, for messages.

    Returns
    -------
    targets : tuple of str
        Names in order of first appearance.
    index : (M,) array of int
        Target of each row, ascending.
    numbers : dict of str to (M,) array
        The columns; times ascend strictly within a target.
    notes : list of str
        A remark on dropped rows, if there were any.

    Raises
    ------
    FileError
        If a target has two different rows at one time.
    """
    codes, times = table.codes[TARGET], table.numbers[TIME]
    order = np.lexsort((times, codes))  # stable: of equal rows, the earlier line comes first
    index, t = codes[order], times[order]
    same = (index[1:] == index[:-1]) & (t[1:] == t[:-1])
    notes: list[str] = []
    if same.any():
        _refuse_different(table, order, np.flatnonzero(same) + 1, what)
        notes = [_repeats(table.header.path, int(same.sum()), what)]
        order = order[np.concatenate([[True], ~same])]
    numbers = {name: column[order] for name, column in table.numbers.items()}
    return table.names[TARGET], codes[order], numbers, notes


def _refuse_different(table: Table, order: IntArray, repeats: IntArray, what: str) -> None:
    """Raise for the earliest line that contradicts another; `repeats` are places in `order`."""
    later, before = order[repeats], order[repeats - 1]
    differs = np.zeros(len(repeats), dtype=np.bool_)
    for column in table.numbers.values():
        differs |= column[later] != column[before]
    if not differs.any():
        return
    row = int(later[differs].min())
    codes, times = table.codes[TARGET], table.numbers[TIME]
    first = int(np.flatnonzero((codes == codes[row]) & (times == times[row]))[0])
    target, time = table.names[TARGET][codes[row]], float(times[row])
    raise FileError(
        table.header.path,
        f"target {shown(target)} has two different {what} at t_s = {time!r} "
        f"(first on line {table.line(first)}); keep one",
        line=table.line(row),
    )


def _repeats(path: str, count: int, what: str) -> str:
    if count == 1:
        return f"{path}: 1 row repeats one of the same target and time; it was dropped"
    return (
        f"{path}: {count} of the {what} repeat one of the same target and time; they were dropped"
    )
