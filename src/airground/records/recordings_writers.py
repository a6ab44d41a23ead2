"""Write tracks.csv, motion.csv and speeds.csv so that every number reads back bit for bit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import readonly
from airground.records.atomic import replacing
from airground.records.cells import LONGEST_NAME, shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike

    from airground.calibration.recordings import IntArray, Motion, Tracks
    from airground.geometry.arrays import FloatArray
    from airground.records.access import StrPath

__all__ = ["SmoothedTrack", "write_motion", "write_smoothed", "write_speeds", "write_tracks"]

_ROWS_AT_ONCE = 10_000


def write_tracks(path: StrPath, tracks: Tracks) -> None:
    """Write sightings to a CSV file that `read_tracks` reads back to the same numbers.

    Parameters
    ----------
    path : path-like
        The file to write or to replace.
    tracks : Tracks
        What to write. A target without rows is not in the file.

    Raises
    ------
    FileError
        If the file cannot be written.
    InputError
        If a target's name would not read back: blanks around it, a line break in it, too long.
    """
    columns = {"u_px": tracks.uv[:, 0], "v_px": tracks.uv[:, 1], "sigma_px": tracks.sigma}
    _write(path, tracks.t, tracks.targets, tracks.target_index, columns)


def write_motion(path: StrPath, motion: Motion) -> None:
    """Write readings to a CSV file that `read_motion` reads back to the same numbers.

    Parameters
    ----------
    path : path-like
        The file to write or to replace.
    motion : Motion
        What to write. A target without rows is not in the file.

    Raises
    ------
    FileError
        If the file cannot be written.
    InputError
        If a target's name would not read back: blanks around it, a line break in it, too long.
    """
    columns = {
        "x_dot_mps": None if motion.xy_dot is None else motion.xy_dot[:, 0],
        "y_dot_mps": None if motion.xy_dot is None else motion.xy_dot[:, 1],
        "heading_rad": motion.heading,
        "speed_mps": motion.speed,
        "distance_m": motion.distance,
        "sigma_speed_mps": motion.sigma_speed,
        "sigma_heading_rad": motion.sigma_heading,
    }
    _write(path, motion.t, motion.targets, motion.target_index, columns)


class SmoothedTrack(Protocol):
    """What is written of a smoothed track."""

    @property
    def t(self) -> FloatArray:
        """(N,) [s]. Times."""
        ...

    @property
    def uv(self) -> FloatArray:
        """(N, 2) [px]. Positions."""
        ...

    @property
    def uv_dot(self) -> FloatArray:
        """(N, 2) [px/s]. Velocities."""
        ...

    @property
    def covariance(self) -> FloatArray:
        """(N, 4, 4). Of both."""
        ...


def write_smoothed(path: StrPath, tracks: Mapping[str, SmoothedTrack]) -> None:
    """Write smoothed tracks: positions and velocities in the image with their standard deviations.

    Parameters
    ----------
    path : path-like
        The file to write or to replace.
    tracks : mapping of str to SmoothedTrack
        By target.

    Raises
    ------
    FileError
        If the file cannot be written.
    InputError
        If a target's name would not read back, or an entry is not finite.
    """
    index = np.repeat(np.arange(len(tracks)), [len(track.t) for track in tracks.values()])
    parts = list(tracks.values())
    t = readonly(np.concatenate([track.t for track in parts]), (len(index),), "t")
    uv = readonly(np.concatenate([track.uv for track in parts]), (len(t), 2), "uv")
    uv_dot = readonly(np.concatenate([track.uv_dot for track in parts]), (len(t), 2), "uv_dot")
    variance = np.diagonal(np.concatenate([track.covariance for track in parts]), axis1=1, axis2=2)
    columns = {
        "u_px": uv[:, 0],
        "v_px": uv[:, 1],
        "sigma_px": np.sqrt(variance[:, :2].mean(axis=1)),
        "u_dot_pxps": uv_dot[:, 0],
        "v_dot_pxps": uv_dot[:, 1],
        "sigma_dot_pxps": np.sqrt(variance[:, 2:].mean(axis=1)),
    }
    _write(path, t, tuple(tracks), index, columns)


def write_speeds(
    path: StrPath,
    *,
    t: ArrayLike,
    targets: Sequence[str],
    target_index: ArrayLike,
    uv: ArrayLike,
    xy_dot: ArrayLike,
    speed_sigma: ArrayLike,
) -> None:
    """Write ground velocities of targets to a CSV file; the speed is the length of the velocity.

    Rows are written in the order given. Leave out those whose velocity is not known: NaN is
    refused, as a program that reads the file could take it for a speed.

    Parameters
    ----------
    path : path-like
        The file to write or to replace.
    t : (N,) array_like [s]
        Times.
    targets : sequence of str
        Names of the targets.
    target_index : (N,) array_like of int
        Which of `targets` a row belongs to.
    uv : (N, 2) array_like [px]
        Positions in the image.
    xy_dot : (N, 2) array_like [m/s]
        Ground velocities.
    speed_sigma : (N,) array_like [m/s]
        Standard deviations of the speeds; zero or more.

    Raises
    ------
    FileError
        If the file cannot be written.
    InputError
        If shapes differ, an entry is not finite, or a target's name would not read back.
    """
    t = readonly(t, (None,), "t")
    index = np.asarray(target_index)
    uv, xy_dot = readonly(uv, (len(t), 2), "uv"), readonly(xy_dot, (len(t), 2), "xy_dot")
    speed_sigma = readonly(speed_sigma, (len(t),), "speed_sigma")
    if index.shape != t.shape or (index.size and index.dtype.kind not in "iu"):
        raise InputError(f"target_index must be integers of shape {t.shape}")
    if index.size and (index.min() < 0 or index.max() >= len(targets)):
        raise InputError(f"target_index must lie in 0..{len(targets) - 1}")
    if (speed_sigma < 0).any():
        raise InputError("speed_sigma must not be negative")
    with np.errstate(over="ignore"):  # too large to be a velocity, but readonly says so
        speed = readonly(np.linalg.norm(xy_dot, axis=1), (len(t),), "the speed")
    columns = {
        "u_px": uv[:, 0],
        "v_px": uv[:, 1],
        "x_dot_mps": xy_dot[:, 0],
        "y_dot_mps": xy_dot[:, 1],
        "speed_mps": speed,
        "speed_sigma_mps": speed_sigma,
    }
    _write(path, t, targets, index.astype(np.intp), columns)


def _write(
    path: StrPath,
    t: FloatArray,
    targets: Sequence[str],
    index: IntArray,
    columns: Mapping[str, FloatArray | None],
) -> None:
    names = [_quoted(name) for name in targets]
    present = {name: column for name, column in columns.items() if column is not None}
    with replacing(path) as temporary, temporary.open("wb") as stream:
        stream.write((",".join(["t_s", "target", *present]) + "\n").encode())
        for start in range(0, len(t), _ROWS_AT_ONCE):  # bounds the memory for text
            rows = slice(start, start + _ROWS_AT_ONCE)
            cells = [_texts(column[rows]) for column in present.values()]
            target = [names[k] for k in index[rows].tolist()]
            lines = map(",".join, zip(_texts(t[rows]), target, *cells, strict=True))
            stream.write(("\n".join(lines) + "\n").encode())


def _texts(column: FloatArray) -> list[str]:
    """Shortest texts that read back to the same bits: what repr of a Python float gives."""
    return list(map(repr, column.tolist()))


def _quoted(name: str) -> str:
    if not 0 < len(name) <= LONGEST_NAME or name != name.strip():
        wanted = f"1 to {LONGEST_NAME} characters and no blanks around them"
        raise InputError(f"target name {shown(name)} must have {wanted}")
    if any(c in "\r\n\0" or "\ud800" <= c <= "\udfff" for c in name):
        raise InputError(f"target name {shown(name)} has a character that a CSV file cannot hold")
    return '"' + name.replace('"', '""') + '"' if "," in name or '"' in name else name
