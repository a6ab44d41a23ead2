"""What a cell may hold: fast for whole columns, slow and with words for one cell.

The two must agree; tests feed both the same cells.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["LONGEST_NAME", "Codes", "cell_problem", "number_column", "row_problem", "shown"]

LONGEST_NAME = 1000
"""Characters that a name may have."""

_SHOWN = 40


def number_column(cells: Sequence[str], *, positive: bool) -> FloatArray:
    """Convert cells to finite numbers.

    Parameters
    ----------
    cells : sequence of str
        Decimal numbers, blanks around them allowed.
    positive : bool
        Whether they must be greater than zero.

    Returns
    -------
    column : (N,) array
        What `float` makes of each.

    Raises
    ------
    ValueError
        If any cell is not such a number; `cell_problem` tells what is wrong with it.
    """
    together = "".join(cells)
    if "_" in together or not together.isascii():  # float takes 1_000, and digits of any script
        raise ValueError
    column = np.fromiter(map(float, cells), dtype=np.float64, count=len(cells))
    if not np.isfinite(column).all() or (positive and not (column > 0).all()):
        raise ValueError
    return column


class Codes(dict[str, int]):
    """Numbers for names, in order of first appearance; a new cell gets the next number."""

    def __init__(self) -> None:
        super().__init__()
        self.names: list[str] = []

    def __missing__(self, cell: str) -> int:
        name = cell.strip()
        if not 0 < len(name) <= LONGEST_NAME:
            raise ValueError
        if name != cell:
            code = self[name]
        else:
            code = len(self.names)
            self.names.append(name)
        self[cell] = code
        return code

    def column(self, cells: Sequence[str]) -> IntArray:
        """Convert cells to codes.

        Parameters
        ----------
        cells : sequence of str
            Names, blanks around them allowed.

        Returns
        -------
        codes : (N,) array of int
            Which of `names` each cell holds.

        Raises
        ------
        ValueError
            If a name is empty or too long.
        """
        return np.fromiter(map(self.__getitem__, cells), dtype=np.intp, count=len(cells))


def cell_problem(cell: str, *, text: bool, positive: bool = False) -> str | None:
    """Tell what is wrong with a cell.

    Parameters
    ----------
    cell : str
        Its content.
    text : bool
        Whether it holds a name; otherwise a number.
    positive : bool
        Whether the number must be greater than zero.

    Returns
    -------
    problem : str or None
        What was found and what was expected; None if nothing is wrong.
    """
    expected = "a name" if text else "a number greater than 0" if positive else "a decimal number"
    if not cell.strip():
        return f"the cell is empty, expected {expected}"
    if text:
        too_long = len(cell.strip()) > LONGEST_NAME
        return f"the name is longer than {LONGEST_NAME} characters" if too_long else None
    value = _number(cell)
    if value is None or (positive and not value > 0):
        return f"found {shown(cell.strip())}, expected {expected}"
    return None


def row_problem(found: int, expected: int, *, last: bool) -> str | None:
    """Tell what is wrong with the number of cells in a row.

    Parameters
    ----------
    found : int
        Cells in the row.
    expected : int
        Cells in the header.
    last : bool
        Whether the file ends with this row.

    Returns
    -------
    problem : str or None
        What was found and what was expected; None if nothing is wrong.
    """
    if found == expected:
        return None
    problem = f"the row has {found} cell{'s' if found > 1 else ''}, the header has {expected}"
    return f"{problem}; the file may be truncated" if last and found < expected else problem


def shown(text: str) -> str:
    """Show a text in an error: quoted, on one line, and not too long.

    Parameters
    ----------
    text : str
        What was found.

    Returns
    -------
    quoted : str
        Its representation, shortened.
    """
    return repr(text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "...")


def _number(cell: str) -> float | None:
    if "_" in cell or not cell.isascii():
        return None
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
