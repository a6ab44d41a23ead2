"""The line of a CSV file that names its columns."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from typing import TYPE_CHECKING

from airground.errors import FileError
from airground.records.cells import cell_problem, shown

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Column", "Header", "listed", "parse_header", "split_line"]

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


def parse_header(name: str, line: int, text: str, columns: Sequence[Column]) -> Header:
    """Read the header, and say what is wrong if a column that is required is not in it.

    Parameters
    ----------
    name : str
        The file.
    line : int
        Where in the file the header stands.
    text : str
        The line.
    columns : sequence of Column
        What the file should have.

    Returns
    -------
    header : Header
        With all required columns, and each of `columns` once at most.

    Raises
    ------
    FileError
        If the header is missing, separated otherwise than by commas, or lacks a column.
    """
    cells = split_line(text)
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
            f"missing {noun} {', '.join(missing)}; the header has {listed(header.names)}"
        )
    for column in columns:
        if header.names.count(column.name) > 1:
            raise FileError(name, "the header has it twice", line=line, column=column.name)
    return header


def split_line(line: str) -> list[str] | str:
    """Split one line into cells.

    Parameters
    ----------
    line : str
        Without its line end.

    Returns
    -------
    cells : list of str or str
        The cells, or a text that says why they cannot be told apart.
    """
    try:
        return next(csv.reader([line], strict=True, skipinitialspace=True))
    except csv.Error as error:
        if "unexpected end of data" in str(error):
            return 'a quoted cell does not end on its line, expected a closing "'
        if "field larger" in str(error):
            return f"a cell is longer than {csv.field_size_limit()} characters"
        return f"cannot be split into cells: {error}"


def listed(names: Sequence[str]) -> str:
    """List names in an error, but not without end.

    Parameters
    ----------
    names : sequence of str
        As found in a file.

    Returns
    -------
    text : str
        The first few of them, and how many more there are.
    """
    some = ", ".join(shown(name) for name in names[:_MANY_COLUMNS])
    return some if len(names) <= _MANY_COLUMNS else f"{some} and {len(names) - _MANY_COLUMNS} more"
