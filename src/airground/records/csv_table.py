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
from airground.records.cells import Codes, cell_problem, number_column, row_problem, shown
from airground.records.text_blocks import Block, read_blocks

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.records.access import StrPath

__all__ = ["Column", "Header", "Table", "read_table"]

_MANY_COLUMNS = 8


@dataclass(frozen=True, slots=True)
class Column:
    """What a column is called and what its cells may hold."""

    name: str
    """As in the header."""

    required: bool = True
    """Whether a file without it is refused."""

    text: bool = False
    """Whether cells are names; otherwise they are finite decimal numbers."""

    positive: bool = False
    """Whether numbers must be greater than zero."""


@dataclass(frozen=True, slots=True)
class Header:
    """The line that names the columns."""

    path: str
    """The file."""

    line: int
    """Where in the file it stands."""

    names: tuple[str, ...]
    """Names without the blanks around them."""

    def error(self, problem: str) -> FileError:
        """Make an error that points at this line.

        Parameters
        ----------
        problem : str
            What was found and what was expected.

        Returns
        -------
        error : FileError
            To be raised.
        """
        return FileError(self.path, problem, line=self.line)


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
    notes = [f"{name}: ignored unknown columns: {_listed(unknown)}"] if unknown else []

    rows = _Rows(header, wanted)
    rows.add(block)
    for _, block in blocks:  # the last one is looked at after the loop
        rows.add(block)
    if rows.count == 0:
        raise FileError(name, "there are no rows below the header", line=header.line)
    if not block.ended:
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
            header = _header(name, block.first + at, block.lines[at], columns)
            lines = block.lines[at + 1 :]
            body = Block(header.line + 1, lines, last=block.last, ended=block.ended)
        yield header, body
    if header is None:
        expected = ",".join(c.name for c in columns if c.required)
        raise FileError(name, f"the file is empty, expected a header with {expected}")


def _header(name: str, line: int, text: str, columns: Sequence[Column]) -> Header:
    cells = _split(text)
    if isinstance(cells, str):
        raise FileError(name, cells, line=line)
    header = Header(name, line, tuple(cell.strip() for cell in cells))
    required = [c.name for c in columns if c.required]
    missing = [c for c in required if c not in header.names]
    if missing and "," not in text and (";" in text or "\t" in text):
        found = "semicolons" if ";" in text else "tabs"
        raise header.error(f"columns must be separated by commas, found {found}")
    if missing and any(cell_problem(cell, text=False) is None for cell in header.names):
        problem = f"the header is missing; the first line must name the columns, with {required[0]}"
        raise header.error(", ".join([problem, *required[1:]]))
    if missing:
        noun = "column" if len(missing) == 1 else "columns"
        raise header.error(
            f"missing {noun} {', '.join(missing)}; the header has {_listed(header.names)}"
        )
    for column in columns:
        if header.names.count(column.name) > 1:
            raise FileError(name, "the header has it twice", line=line, column=column.name)
    return header


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
        rows = list(csv.reader(lines, strict=True, skipinitialspace=True))
        if not rows:
            return 0
        if len(rows) != len(lines):
            raise ValueError  # a quoted cell went on over the end of its line
        cells = list(zip(*rows, strict=True))
        if len(cells) != len(self.header.names):
            raise ValueError
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
        return len(rows)

    def _first_error(self, block: Block, error: Exception) -> FileError:
        """Look for the first cell of a block that made it fail."""
        path = self.header.path
        final = max((i for i, line in enumerate(block.lines) if line.strip()), default=-1)
        for i, line in enumerate(block.lines):
            if not line.strip():
                continue
            cells = _split(line)
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


def _split(line: str) -> list[str] | str:
    """Cells of one line, or what is wrong with its quotes."""
    try:
        return next(csv.reader([line], strict=True, skipinitialspace=True))
    except csv.Error as error:
        if "unexpected end of data" in str(error):
            return 'a quoted cell does not end on its line, expected a closing "'
        if "field larger" in str(error):
            return f"a cell is longer than {csv.field_size_limit()} characters"
        return f"cannot be split into cells: {error}"


def _listed(names: Sequence[str]) -> str:
    some = ", ".join(shown(name) for name in names[:_MANY_COLUMNS])
    return some if len(names) <= _MANY_COLUMNS else f"{some} and {len(names) - _MANY_COLUMNS} more"
