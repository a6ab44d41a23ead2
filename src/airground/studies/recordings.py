"""Recordings with their truth, below a folder; and what somebody without us would do with one."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration.ground_path import ground_path
from airground.errors import FileError, InputError, UndeterminedError
from airground.geometry.limited import LimitedHomography
from airground.records import read_motion, read_tracks

if TYPE_CHECKING:
    from pathlib import Path

    from airground.calibration import Motion, Tracks
    from airground.geometry.arrays import FloatArray

__all__ = ["FILES", "Recording", "find_recordings", "odometry_homography", "read_recording"]

FILES = ("tracks.csv", "motion.csv", "truth.json")
"""What a recording's folder holds; its name says nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """A drive that somebody filmed, and what is known of its camera."""

    tracks: Tracks
    """Sightings."""

    motion: Motion
    """Readings."""

    g: FloatArray | None
    """(3, 2). Truth; None where nobody knows it."""

    image_size_px: tuple[int, int] | None
    """Width and height of the image [px]; None where not known."""


def find_recordings(folder: Path) -> list[Path]:
    """Folders below that hold a recording whose truth.json says something of g.

    Parameters
    ----------
    folder : Path
        Where to look, at any depth.

    Returns
    -------
    folders : list of Path
        In the order of their names. A truth.json that cannot be read counts: `read_recording` says what is wrong.
    """
    found = []
    for path in sorted(folder.rglob(FILES[2])):
        if not all((path.parent / name).is_file() for name in FILES):
            continue
        try:
            told = _told(path)
        except FileError:
            told = {"g": None}
        if "g" in told:
            found.append(path.parent)
    return found


def read_recording(folder: Path) -> Recording:
    """Read one.

    Parameters
    ----------
    folder : Path
        With the three files.

    Returns
    -------
    recording : Recording
        All of it.

    Raises
    ------
    FileError
        If a file is wrong.
    """
    path = folder / FILES[2]
    told = _told(path)
    try:
        truth = None if told.get("g") is None else LimitedHomography(told["g"]).g
        size = told.get("image_size_px")
        size_px = None if size is None else (int(size[0]), int(size[1]))
    except (ValueError, TypeError, LookupError) as error:
        raise FileError(
            str(path), f"g or image_size_px is not what it should be: {error}"
        ) from None
    return Recording(read_tracks(folder / FILES[0]), read_motion(folder / FILES[1]), truth, size_px)


def odometry_homography(tracks: Tracks, motion: Motion, offset_s: float) -> LimitedHomography:
    """Integrate the odometry over the whole drive, and fit a homography to it by OpenCV's findHomography.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    offset_s : float [s]
        To be added to times of the tracks: this way has no means to find it.

    Returns
    -------
    model : LimitedHomography
        By least squares over all sightings, right or wrong.

    Raises
    ------
    UndeterminedError
        If there are several robots, as odometry gives each an origin of its own, or no homography comes out.
    """
    from airground.vision.homography import find_homography

    driven = [name for name in tracks.targets if name in motion.targets]
    if len(driven) != 1:
        raise UndeterminedError(
            f"{len(driven)} robots: odometry gives each an origin of its own, and this takes one"
        )
    path = ground_path(motion, driven[0])
    matrix = None
    if path is not None:
        rows = tracks.rows(driven[0])
        xy, stretch = path.at(tracks.t[rows] + offset_s)
        keep = stretch >= 0
        matrix = find_homography(xy[keep], tracks.uv[rows][keep])
    try:
        if matrix is not None and np.isfinite(matrix).all():
            return LimitedHomography.from_homography(matrix)
    except InputError:
        pass
    raise UndeterminedError("findHomography gives no homography of this drive")


def _told(path: Path) -> dict[str, Any]:
    try:
        told = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise FileError(str(path), f"cannot be read as JSON: {error}") from None
    if not isinstance(told, dict):
        raise FileError(str(path), "expected an object")
    return told
