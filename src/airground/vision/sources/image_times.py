"""Times of the images in a folder: from their names, or from a file beside them."""

from __future__ import annotations

import csv
import re
from math import isfinite
from typing import TYPE_CHECKING

from airground.errors import FileError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

__all__ = ["TABLE", "TIME_LISTS", "natural_key", "time_in_name", "times_beside"]

TABLE = "times.csv"
TIME_LISTS = ("timestamps.txt", "times.txt")

# Seconds, milliseconds, microseconds, nanoseconds since 1970 have this many digits until the year 2286.
UNITS = {10: 0, 13: 3, 16: 6, 19: 9}
TIME = re.compile(r"(?:.*[^0-9.])?(\d+\.\d+|\d{10}|\d{13}|\d{16}|\d{19})")


def natural_key(name: str) -> tuple[tuple[bool, int, str], ...]:
    """Sorting key by which image 10 comes after image 9.

    Parameters
    ----------
    name : str
        Name of a file.

    Returns
    -------
    key : tuple
        Numbers by their value, before all else, as text.
    """
    parts = re.findall(r"\d+|\D+", name)
    return tuple(
        (False, int(part), part) if part.isdecimal() else (True, 0, part) for part in parts
    )


def time_in_name(stem: str) -> float | None:
    """Time that a file's name ends with, as in the EuRoC and TUM data sets and in dumps of ROS bags.

    A number with a point is seconds. A whole number of 10, 13, 16 or 19 digits is seconds, milliseconds, microseconds
    or nanoseconds. Any other whole number only counts the images.

    Parameters
    ----------
    stem : str
        Name without suffix.

    Returns
    -------
    t : float or None [s]
        None where there is no time.
    """
    found = TIME.fullmatch(stem)
    if found is None:
        return None
    digits = found[1]
    if "." in digits:
        return float(digits)
    places = UNITS[len(digits)]
    return float(f"{digits}e-{places}")  # rounded once, not twice


def times_beside(folder: Path, names: Sequence[str]) -> dict[str, float] | None:
    """Times from a file in the folder.

    ``times.csv`` has the columns ``file`` and ``t_s``; images that it does not name are left out. ``timestamps.txt``
    and ``times.txt`` have one time [s] on each line, for the images in the order of their names.

    Parameters
    ----------
    folder : Path
        Where the images are.
    names : sequence of str
        The images in order.

    Returns
    -------
    times : dict of str to float, or None [s]
        By name of the image; None where there is no such file.

    Raises
    ------
    FileError
        If the file is wrong.
    """
    if (folder / TABLE).is_file():
        return _table(folder / TABLE, set(names))
    for name in TIME_LISTS:
        if (folder / name).is_file():
            return _list(folder / name, names)
    return None


def _table(path: Path, names: set[str]) -> dict[str, float]:
    times: dict[str, float] = {}
    rows = csv.reader(_text(path).splitlines())
    header = [cell.strip() for cell in next(rows, [])]
    if "file" not in header or "t_s" not in header:
        raise FileError(
            str(path), f"expected the columns file and t_s, found {','.join(header)}", line=1
        )
    file_column, time_column = header.index("file"), header.index("t_s")
    for row in rows:
        if not row:
            continue
        if len(row) < len(header):
            raise FileError(
                str(path), f"expected {len(header)} cells, found {len(row)}", line=rows.line_num
            )
        name = row[file_column].strip()
        if name not in names:
            raise FileError(
                str(path),
                f"there is no image {name} in the folder",
                line=rows.line_num,
                column="file",
            )
        if name in times:
            raise FileError(str(path), f"{name} is named twice", line=rows.line_num, column="file")
        times[name] = _number(path, row[time_column], rows.line_num)
    return times


def _list(path: Path, names: Sequence[str]) -> dict[str, float]:
    lines = [(k, line) for k, line in enumerate(_text(path).splitlines(), 1)]
    filled = [(k, line) for k, line in lines if line.strip() and not line.lstrip().startswith("#")]
    if len(filled) != len(names):
        raise FileError(
            str(path),
            f"has {len(filled)} times for {len(names)} images; expected one line for each",
        )
    return {name: _number(path, line, k) for name, (k, line) in zip(names, filled, strict=True)}


def _number(path: Path, cell: str, line: int) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise FileError(str(path), f"expected a time in seconds, found {cell.strip()!r}", line=line)
    return value


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise FileError(str(path), "is not text in UTF-8") from None
    except OSError as error:
        raise FileError(str(path), f"cannot read it: {error.strerror or error}") from None
