"""Read tracks.csv and motion.csv."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.recordings import Motion, Tracks
from airground.records.csv_table import Column, Header, Table, read_table
from airground.records.rows import sort_rows

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from airground.records.access import StrPath

__all__ = ["read_motion", "read_tracks"]

_KEYS = (Column("t_s"), Column("target", text=True))
_TRACKS = (
    *_KEYS,
    Column("u_px"),
    Column("v_px"),
    Column("sigma_px", required=False, positive=True),
)
_VELOCITY = ("x_dot_mps", "y_dot_mps")
_ALONG = ("speed_mps", "distance_m")
_MOTION = (
    *_KEYS,
    *(Column(name, required=False) for name in (*_VELOCITY, "heading_rad", *_ALONG)),
    Column("sigma_speed_mps", required=False, positive=True),
    Column("sigma_heading_rad", required=False, positive=True),
)


def read_tracks(path: StrPath, *, note: Callable[[str], None] | None = None) -> Tracks:
    """Read sightings from a CSV file.

    Its columns are t_s, target, u_px, v_px and, optionally, sigma_px. Rows and columns may be in
    any order.

    Parameters
    ----------
    path : path-like
        The file.
    note : callable, optional
        Called with a remark of one line on each thing that was accepted but may surprise: unknown
        columns, repeated rows, a file that may have been cut off.

    Returns
    -------
    tracks : Tracks
        Sorted by target and time; targets in order of first appearance.

    Raises
    ------
    FileError
        If the file cannot be read, or a line of it is wrong.
    """
    table = read_table(path, _TRACKS)
    targets, index, numbers, notes = sort_rows(table, "sightings")
    _tell(note, [*table.notes, *notes])
    del table  # Tracks copies what it is given: do not hold everything three times
    return Tracks(
        targets=targets,
        target_index=index,
        t=numbers.pop("t_s"),
        uv=np.column_stack([numbers.pop("u_px"), numbers.pop("v_px")]),
        sigma=numbers.pop("sigma_px", None),
    )


def read_motion(path: StrPath, *, note: Callable[[str], None] | None = None) -> Motion:
    """Read readings of how targets move on the ground from a CSV file.

    Its columns are t_s, target, and either x_dot_mps and y_dot_mps, or heading_rad with speed_mps
    or distance_m or both; optionally sigma_speed_mps and sigma_heading_rad. Where both forms are
    there, x_dot_mps and y_dot_mps are used. Rows and columns may be in any order.

    Parameters
    ----------
    path : path-like
        The file.
    note : callable, optional
        Called with a remark of one line on each thing that was accepted but may surprise: columns
        that are not used, repeated rows, a file that may have been cut off.

    Returns
    -------
    motion : Motion
        Sorted by target and time; targets in order of first appearance.

    Raises
    ------
    FileError
        If the file cannot be read, or a line of it is wrong.
    """
    table = read_table(path, _MOTION, leave_out=_second_form)
    targets, index, numbers, notes = sort_rows(table, "readings")
    _tell(note, [*table.notes, *_not_used(table), *notes])
    del table
    velocity = [numbers.pop(name) for name in _VELOCITY if name in numbers]
    return Motion(
        targets=targets,
        target_index=index,
        t=numbers.pop("t_s"),
        xy_dot=np.column_stack(velocity) if velocity else None,
        heading=numbers.pop("heading_rad", None),
        speed=numbers.pop("speed_mps", None),
        distance=numbers.pop("distance_m", None),
        sigma_speed=numbers.pop("sigma_speed_mps", None),
        sigma_heading=numbers.pop("sigma_heading_rad", None),
    )


def _second_form(header: Header) -> Collection[str]:
    """Check that the columns make up one of the two forms; if both, leave out the second."""
    velocity = [name for name in _VELOCITY if name in header.names]
    along = [name for name in _ALONG if name in header.names]
    heading = "heading_rad" in header.names
    if len(velocity) == 2:
        return ("heading_rad", *_ALONG)
    if velocity:
        missing = next(name for name in _VELOCITY if name not in velocity)
        raise header.error(f"{velocity[0]} needs {missing} beside it")
    if heading and not along:
        raise header.error("heading_rad needs speed_mps or distance_m beside it")
    if along and not heading:
        raise header.error(f"{along[0]} needs heading_rad beside it")
    if not heading:
        raise header.error(
            "expected x_dot_mps and y_dot_mps, or heading_rad with speed_mps or distance_m"
        )
    return ()


def _not_used(table: Table) -> list[str]:
    header = table.header
    unused = [c.name for c in _MOTION if c.name in header.names and not _has(table, c.name)]
    if not unused:
        return []
    return [f"{header.path}: used x_dot_mps and y_dot_mps, not {', '.join(unused)}"]


def _has(table: Table, name: str) -> bool:
    return name in table.numbers or name in table.codes


def _tell(note: Callable[[str], None] | None, remarks: Iterable[str]) -> None:
    if note is not None:
        for remark in remarks:
            note(remark)
