"""Read and write path.csv: a path drawn into the image."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import FileError
from airground.geometry.arrays import FloatArray, readonly
from airground.records.atomic import write_text
from airground.records.csv_table import Column, read_table

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.records.access import StrPath

__all__ = ["DrawnPath", "read_path", "write_path"]

_COLUMNS = (
    Column("u_px"),
    Column("v_px"),
    Column("speed_mps", required=False, positive=True),
)


@dataclass(frozen=True, slots=True, eq=False)
class DrawnPath:
    """Points of a sketch, in order."""

    uv: FloatArray
    """(N, 2) [px]. Raw image points, two or more."""

    speed: FloatArray | None = None
    """(N,) [m/s]. Wanted at each point; None where the file does not say."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "uv", readonly(self.uv, (None, 2), "uv"))
        if self.speed is not None:
            object.__setattr__(self, "speed", readonly(self.speed, (len(self.uv),), "speed"))


def read_path(path: StrPath, *, note: Callable[[str], None] | None = None) -> DrawnPath:
    """Read a sketched path from a CSV file with the columns u_px, v_px and, optionally, speed_mps.

    Parameters
    ----------
    path : path-like
        The file; its rows are in order.
    note : callable, optional
        Given remarks of one line each on what was accepted but may surprise.

    Returns
    -------
    drawn : DrawnPath
        Two points or more.

    Raises
    ------
    FileError
        If the file cannot be read, a cell is wrong, or there are fewer than two points.
    """
    table = read_table(path, _COLUMNS)
    for line in table.notes:
        if note is not None:
            note(line)
    u, v = table.numbers["u_px"], table.numbers["v_px"]
    if len(u) < 2:
        raise FileError(os.fspath(path), f"a path needs two points or more, found {len(u)}")
    return DrawnPath(np.column_stack([u, v]), table.numbers.get("speed_mps"))


def write_path(path: StrPath, drawn: DrawnPath) -> None:
    """Write a path to a CSV file, whole or not at all.

    Parameters
    ----------
    path : path-like
        Where to.
    drawn : DrawnPath
        Points, and speeds where there are any.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    names = ["u_px", "v_px"]
    columns = [*drawn.uv.T.tolist()]
    if drawn.speed is not None:
        names.append("speed_mps")
        columns.append(drawn.speed.tolist())
    rows = [",".join(map(repr, row)) for row in zip(*columns, strict=True)]
    write_text(path, "\n".join([",".join(names), *rows]) + "\n")
