"""What a calibration is made from, out of the log of a session.

Of each step's inputs it needs two kinds, whose entries are those of the session's own records:

- ``{"kind": "seen", "t", "size_px", "sightings": {"uv", "covariance"}, "tracks": {"names", "labels", "confirmed",
  "sighting", "merged_with", "swap_probability"}}``: a frame; `sighting` is the row of each track's, -1 for none;
- ``{"kind": "heard", "robot", "readings": [{"t", "heading", "speed"}]}``: what a robot told, null for what it did not.

The header's ``"robots": [{"name", "track"}]`` says which track is which robot, by its label or name. Both clocks are
the session's.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration.recordings import Motion, Tracks
from airground.errors import FileError
from airground.records.session_log_reader import SessionRecording, read_session

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.geometry.arrays import FloatArray
    from airground.records.access import StrPath

__all__ = ["RecordedDrive", "read_recording"]

LONGEST_GAP_S = 0.5  # between two headings, for one in between
AMBIGUOUS = 0.02  # a track that is likelier than this to be another one tells nothing of a robot
_COLUMNS = ("names", "labels", "confirmed", "sighting", "merged_with", "swap_probability")


@dataclass(frozen=True, slots=True, eq=False)
class RecordedDrive:
    """Sightings and readings of a session."""

    tracks: Tracks
    """Where everything was seen; robots by their names, all else by its track's."""

    motion: Motion
    """What robots told."""

    image_size_px: tuple[int, int] | None
    """Width and height of the newest frame [px]."""


def read_recording(path: StrPath, *, note: Callable[[str], None] | None = None) -> RecordedDrive:
    """Read sightings and readings from the log of a session, whole or cut off.

    Sightings are those that the tracker took, in their frame, for a confirmed track's own and was sure of.

    Parameters
    ----------
    path : path-like
        The log.
    note : callable, optional
        Given remarks of one line each on what was accepted but may surprise.

    Returns
    -------
    drive : RecordedDrive
        For `calibrate`.

    Raises
    ------
    FileError
        If it is no log of a session, or holds no sightings, or no readings of heading and speed.
    """
    log = read_session(path)
    names = _robots(log)
    seen, heard = _Seen(names), _Heard()
    for step in log.steps():
        for one in step.inputs:
            try:
                if one["kind"] == "seen":
                    seen.add(one)
                elif one["kind"] == "heard":
                    heard.add(one)
            except (KeyError, TypeError, IndexError, ValueError) as error:
                problem = f"step {step.number}: an input cannot be read ({error!r})"
                raise FileError(log.path, problem) from error
    if log.cut and note is not None:
        note(f"{log.path}: {log.cut}; all before is used")
    tracks = seen.tracks()
    if tracks is None:
        raise FileError(log.path, "holds no sightings of confirmed tracks")
    motion = heard.motion()
    if motion is None:
        raise FileError(log.path, "holds no readings of heading and speed")
    if not set(tracks.targets) & set(motion.targets):
        told, found = ", ".join(motion.targets), ", ".join(tracks.targets[:8])
        problem = f"no robot that told its motion ({told}) was seen; tracks are {found}"
        raise FileError(log.path, problem)
    return RecordedDrive(tracks, motion, seen.size)


def _robots(log: SessionRecording) -> dict[str, str]:
    """Names of robots by their tracks'."""
    try:
        return {str(one["track"]): str(one["name"]) for one in log.header["robots"]}
    except (KeyError, TypeError) as error:
        raise FileError(
            log.path, "its header does not list the robots with their tracks"
        ) from error


class _Seen:
    """Sightings as columns: hours of them fit into memory."""

    def __init__(self, robots: dict[str, str]) -> None:
        self._robots = robots
        self._codes: dict[str, int] = {}
        self._newest: dict[str, float] = {}
        self._code, self._numbers = array("q"), array("d")
        self.size: tuple[int, int] | None = None

    def add(self, frame: dict[str, Any]) -> None:
        t = float(frame["t"])
        width, height = frame["size_px"]
        self.size = int(width), int(height)
        uv, covariance = frame["sightings"]["uv"], frame["sightings"]["covariance"]
        columns = (frame["tracks"][key] for key in _COLUMNS)
        for track, label, confirmed, row, merged, swapped in zip(*columns, strict=True):
            name = self._robots.get(label) or self._robots.get(track) or track
            newer = t > self._newest.get(name, -np.inf)
            if row < 0 or merged or swapped > AMBIGUOUS or not (confirmed and newer):
                continue
            self._newest[name] = t
            self._code.append(self._codes.setdefault(name, len(self._codes)))
            (uu, _), (_, vv) = covariance[row]
            u, v = uv[row]
            self._numbers.extend((t, u, v, (0.5 * (uu + vv)) ** 0.5))

    def tracks(self) -> Tracks | None:
        if not self._code:
            return None
        names = np.array(list(self._codes))[np.array(self._code)]
        t, u, v, sigma = np.array(self._numbers).reshape(-1, 4).T
        return Tracks.from_rows(t, names, np.column_stack([u, v]), sigma)


class _Heard:
    """Readings as columns, robot by robot."""

    def __init__(self) -> None:
        self._headings: dict[str, array[float]] = {}
        self._speeds: dict[str, array[float]] = {}

    def add(self, heard: dict[str, Any]) -> None:
        robot = str(heard["robot"])
        for reading in heard["readings"]:
            t = float(reading["t"])
            for key, kept in (("heading", self._headings), ("speed", self._speeds)):
                if reading[key] is not None:
                    kept.setdefault(robot, array("d")).extend((t, float(reading[key])))

    def motion(self) -> Motion | None:
        parts = []
        for robot in self._speeds:
            if robot in self._headings:
                t, heading, speed = _together(
                    _series(self._headings[robot]), _series(self._speeds[robot])
                )
                parts.append((t, [robot] * len(t), heading, speed))
        parts = [part for part in parts if len(part[0])]
        if not parts:
            return None
        t, heading, speed = (np.concatenate([part[k] for part in parts]) for k in (0, 2, 3))
        names = [name for part in parts for name in part[1]]
        return Motion.from_rows(t, names, heading=heading, speed=speed)


def _series(pairs: array[float]) -> tuple[FloatArray, FloatArray]:
    """Times and values, in order, each time once."""
    t, value = np.array(pairs).reshape(-1, 2).T
    t, first = np.unique(t, return_index=True)
    return t, value[first]


def _together(
    heading: tuple[FloatArray, FloatArray], speed: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Headings at the times of the speeds: a robot may tell them apart from each other."""
    t_heading, value = heading[0], np.unwrap(heading[1])
    t, speeds = speed
    before = np.clip(np.searchsorted(t_heading, t, side="right") - 1, 0, None)
    after = np.clip(np.searchsorted(t_heading, t, side="left"), None, len(t_heading) - 1)
    near = (t_heading[before] <= t) & (t <= t_heading[after])
    near &= t_heading[after] - t_heading[before] <= LONGEST_GAP_S
    at = t[near]
    return at, np.interp(at, t_heading, value), speeds[near]
