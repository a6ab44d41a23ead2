"""Stretches of sightings that do not move as the readings say: swapped names, an odometer that stands.

A robust loss does not find them. What is wrong for seconds is wrong in each sighting and in each increment between
two, and to believe the sightings and none of the increments costs as little as the other way round. But over most of
a second the way seen and the way read differ by as much as they are long, under any g that is nearly right.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.ground_path import ground_path

if TYPE_CHECKING:
    from airground.calibration.ground_path import GroundPath
    from airground.calibration.recordings import Motion, Tracks
    from airground.calibration.trajectory.start import Start
    from airground.geometry.arrays import FloatArray

__all__ = ["following"]

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

LAG_S = (
    0.6  # over which ways are compared: noise is small on them, and few cross the ends of a stretch
)
GROSS = 0.5  # relative difference: no start is as wrong as that
LONG_S = 1.0  # shorter stretches are left to the robust loss
MOVING = 0.1  # of the longest way


def following(tracks: Tracks, motion: Motion, start: Start, keep: BoolArray) -> BoolArray:
    """Tell sightings of stretches that move as the readings say.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    start : Start
        First estimate.
    keep : (N,) array of bool
        Plausible sightings.

    Returns
    -------
    following : (N,) array of bool
        Those of `keep` that do.
    """
    found = keep.copy()
    middle = np.median(tracks.uv[keep], axis=0)
    turns = dict(zip(start.targets, start.turns, strict=True))
    for name in tracks.targets:
        path = ground_path(motion, name) if name in turns else None
        mine = tracks.rows(name)
        rows = np.arange(mine.start, mine.stop)[keep[mine]]
        if path is None or len(rows) < 2:
            continue
        with np.errstate(divide="ignore", invalid="ignore"):  # a sighting on the estimate's horizon
            seen = start.fit.model.ground_position(tracks.uv[rows], middle)
        astray = _astray(tracks.t[rows], seen, path, start.offset, float(turns[name]))
        found[rows[astray]] = False
    return found


def _astray(
    t: FloatArray, seen: FloatArray, path: GroundPath, offset: float, turn: float
) -> BoolArray:
    """Sightings most of whose ways, from before them to after them, are grossly wrong; in long stretches only."""
    read, stretch = path.at(t + offset)
    cos, sin = np.cos(turn), np.sin(turn)
    read = read @ np.array([[cos, sin], [-sin, cos]])
    first = np.arange(len(t))
    last = np.minimum(np.searchsorted(t, t + LAG_S), len(t) - 1)
    told = (t[last] - t >= LAG_S) & (t[last] - t < 2 * LAG_S)
    told &= (stretch >= 0) & (stretch[last] == stretch)
    if not told.any():
        return np.zeros(len(t), dtype=bool)
    by_eye, by_wheel = seen[last] - seen, read[last] - read
    off = np.linalg.norm(by_eye - by_wheel, axis=1)
    eye, wheel = np.linalg.norm(by_eye, axis=1), np.linalg.norm(by_wheel, axis=1)
    moving = told & (wheel > MOVING * float(wheel[told].max()))
    # A robot that creeps or stands is seen to move by the noise of its sightings.
    usual = float(np.median(wheel[moving])) if moving.any() else np.inf
    gross = told & ~(off <= GROSS * np.maximum(np.maximum(eye, wheel), usual))  # NaN is gross
    across, wrong = (_spanning(which, first, last) for which in (told, gross))
    astray = 2 * wrong > across
    ends = np.flatnonzero(np.diff(np.concatenate([[0], astray, [0]])))
    for begin, end in ends.reshape(-1, 2):
        if t[end - 1] - t[begin] < LONG_S:
            astray[begin:end] = False
    return np.asarray(astray)


def _spanning(
    which: BoolArray,
    first: np.ndarray[tuple[int, ...], np.dtype[np.intp]],
    last: np.ndarray[tuple[int, ...], np.dtype[np.intp]],
) -> np.ndarray[tuple[int, ...], np.dtype[np.intp]]:
    """(N,). How many of some ways go past each sighting."""
    count = len(which)
    begins = np.bincount(first[which], minlength=count)
    ends = np.bincount(last[which], minlength=count)
    return np.cumsum(begins - ends)
