"""CSV files as columns of numbers, checked cell by cell, without an object per cell.

Whole blocks of rows are converted at once. Only when that fails is the block looked through
again, slowly, for the line and the column of its first bad cell.
"""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import FileError
from airground.records.cells import Codes, cell_problem, number_column, row_problem
from airground.records.csv_header import Column, Header, listed, parse_header, split_line
from airground.records.text_blocks import Block, read_blocks

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.records.access import StrPath

__all__ = ["Column", "Header", "Table", "read_table"]


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """The columns of a file, in the order of its rows."""

    header: Header
    """Where the columns were named."""

    numbers: dict[str, FloatArray]
    """By column name, (N,)."""

    codes: dict[str, IntArray]
    """By name of a text column, (N,): which of `names` a row has."""

    names: dict[str, tuple[str, ...]]
    """By name of a text column: its distinct texts in order of first appearance."""

    notes: tuple[str, ...]
    """Remarks of one line each on what was accepted but may surprise."""

    blanks: IntArray
    """Number of rows before each blank line."""

    def line(self, row: int) -> int:
        """Tell where in the file a row stands.

        Parameters
        ----------
        row : int
            Its number; the first row below the header is 0.

        Returns
        -------
        line : int
            The file's first line is 1.
        """
        skipped = int(np.searchsorted(self.blanks, row, side="right"))
        return self.header.line + 1 + row + skipped


def read_table(
    path: StrPath,
    columns: Sequence[Column],
    *,
    leave_out: Callable[[Header], Collection[str]] | None = None,
) -> Table:
    """Read the columns of a CSV file that are asked for.

    Parameters
    ----------
    path : path-like
        The file.
    columns : sequence of Column
        What to look for. Other columns are ignored, with a note.
    leave_out : callable, optional
        Given the header, names the columns not to read although they are there. It may raise
        `Header.error` where the columns do not fit together.

    Returns
    -------
    table : Table
        One row or more.

    Raises
    ------
    FileError
        If the file cannot be read, a column is missing, there are no rows, or a cell is wrong.
    """
    name = os.fspath(path)
    blocks = _without_header(name, columns, read_blocks(path))
    header, block = next(blocks)
    omitted = set(leave_out(header)) if leave_out else set()
    wanted = [c for c in columns if c.name in header.names and c.name not in omitted]
    unknown = [cell for cell in header.names if cell not in {c.name for c in columns}]
    notes = [f"{name}: ignored unknown columns: {listed(unknown)}"] if unknown else []

    rows = _Rows(header, wanted)
    rows.add(block)
    for _, block in blocks:  # the last one is looked at after the loop
        rows.add(block)
    if rows.count == 0:
        raise FileError(name, "there are no rows below the header", line=header.line)
    if not block.ended and block.lines[-1].strip():
        notes.append(f"{name}: the last line has no line end; the file may have been truncated")
    return rows.table(notes)


def _without_header(
    name: str, columns: Sequence[Column], blocks: Iterator[Block]
) -> Iterator[tuple[Header, Block]]:
    """Give each block with the header, and the first of them without the header's line."""
    header = None
    for block in blocks:
        body = block
        if header is None:
            at = next((i for i, line in enumerate(block.lines) if line.strip()), None)
            if at is None:
                continue
            header = parse_header(name, block.first + at, block.lines[at], columns)
            lines = block.lines[at + 1 :]
            body = Block(header.line + 1, lines, last=block.last, ended=block.ended)
        yield header, body
    if header is None:
        expected = ",".join(c.name for c in columns if c.required)
        raise FileError(name, f"the file is empty, expected a header with {expected}")


class _Rows:
    """Columns that grow block by block."""

    def __init__(self, header: Header, columns: Sequence[Column]) -> None:
        self.header = header
        self.columns = [(header.names.index(c.name), c) for c in columns]
        self.count = 0
        self.numbers: dict[str, list[FloatArray]] = {c.name: [] for c in columns if not c.text}
        self.codes: dict[str, list[IntArray]] = {c.name: [] for c in columns if c.text}
        self.texts = {c.name: Codes() for c in columns if c.text}
        self.blanks: list[IntArray] = [np.empty(0, dtype=np.intp)]

    def add(self, block: Block) -> None:
        """Append the rows of a block."""
        try:
            count = self._convert(block.lines)
        except (ValueError, csv.Error):
            blank = [i for i, line in enumerate(block.lines) if not line.strip()]
            try:
                count = self._convert([line for line in block.lines if line.strip()])
            except (ValueError, csv.Error) as error:
                raise self._first_error(block, error) from None
            before = self.count + np.array(blank, dtype=np.intp) - np.arange(len(blank))
            self.blanks.append(before)
        self.count += count

    def _convert(self, lines: list[str]) -> int:
        """Convert whole columns; raise ValueError or csv.Error if any cell is wrong."""
        if not lines:
            return 0
        cells = _transposed(lines, len(self.header.names))
        numbers = {
            c.name: number_column(cells[i], positive=c.positive)
            for i, c in self.columns
            if not c.text
        }
        codes = {c.name: self.texts[c.name].column(cells[i]) for i, c in self.columns if c.text}
        for name, column in numbers.items():  # after all were converted: a block counts whole
            self.numbers[name].append(column)
        for name, code in codes.items():
            self.codes[name].append(code)
        return len(lines)

    def _first_error(self, block: Block, error: Exception) -> FileError:
        """Look for the first cell of a block that made it fail."""
        path = self.header.path
        final = max((i for i, line in enumerate(block.lines) if line.strip()), default=-1)
        for i, line in enumerate(block.lines):
            if not line.strip():
                continue
            cells = split_line(line)
            number = block.first + i
            if isinstance(cells, str):
                return FileError(path, cells, line=number)
            truncated = block.last and i == final
            problem = row_problem(len(cells), len(self.header.names), last=truncated)
            if problem:
                return FileError(path, problem, line=number)
            for k, column in self.columns:
                problem = cell_problem(cells[k], text=column.text, positive=column.positive)
                if problem:
                    return FileError(path, problem, line=number, column=column.name)
        return FileError(path, f"cannot be read: {error}", line=block.first)

    def table(self, notes: Sequence[str]) -> Table:
        """Join the blocks, letting go of each column's blocks before the next is joined."""
        numbers = {name: np.concatenate(self.numbers.pop(name)) for name in list(self.numbers)}
        codes = {name: np.concatenate(self.codes.pop(name)) for name in list(self.codes)}
        names = {name: tuple(text.names) for name, text in self.texts.items()}
        return Table(self.header, numbers, codes, names, tuple(notes), np.concatenate(self.blanks))


def _transposed(lines: list[str], width: int) -> list[Sequence[str]]:
    """Cells by column; raise ValueError or csv.Error if a row has not `width` cells."""
    # Without quotes, one split does it in a third of the time. The mark that ends each line must
    # then stand after every `width` cells; no cell can hold it, as lines have no line ends.
    text = ",\n,".join(lines)
    if '"' not in text:
        flat = text.split(",")
        marks = flat[width :: width + 1]
        if len(flat) != len(lines) * (width + 1) - 1 or marks.count("\n") != len(lines) - 1:
            raise ValueError
        return [flat[i :: width + 1] for i in range(width)]
    rows = list(csv.reader(lines, strict=True, skipinitialspace=True))
    if len(rows) != len(lines):
        raise ValueError  # a quoted cell went on over the end of its line
    columns = list(zip(*rows, strict=True))
    if len(columns) != width:
        raise ValueError
    return list(columns)
