"""Tracks under the names of the robots that they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.identify_types import TrackSpan
from airground.calibration.recordings import Tracks

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from airground.calibration.identify_types import RobotIdentity

__all__ = ["renamed", "track_spans"]


def track_spans(tracks: Tracks, name: str, first_s: float, last_s: float) -> TrackSpan | None:
    """Sightings of a track between two times.

    Parameters
    ----------
    tracks : Tracks
        All tracks.
    name : str
        Which track.
    first_s : float [s]
        From when on.
    last_s : float [s]
        Until when.

    Returns
    -------
    span : TrackSpan or None
        None where there are none.
    """
    t = tracks.t[tracks.rows(name)]
    t = t[(t >= first_s) & (t <= last_s)]
    return TrackSpan(name, float(t[0]), float(t[-1]), len(t)) if len(t) else None


def renamed(
    tracks: Tracks,
    robots: Sequence[str],
    identities: Sequence[RobotIdentity],
    say: Callable[[str], None],
) -> Tracks:
    """Give identified stretches their robot's name.

    Parameters
    ----------
    tracks : Tracks
        Under any names.
    robots : sequence of str
        Names that are reserved for robots.
    identities : sequence of RobotIdentity
        What was found.
    say : callable
        Is given a remark where a track had the name of a robot that it is not.

    Returns
    -------
    tracks : Tracks
        The same rows; where two tracks of a robot have a sighting at one time, the later track's is kept.
    """
    names = np.array(tracks.targets, dtype=object)[tracks.target_index]
    taken = set(tracks.targets) | set(robots)
    for robot in robots:
        if robot in tracks.targets:
            other = f"{robot}?"
            while other in taken:
                other += "?"
            taken.add(other)
            names[tracks.rows(robot)] = other
    keep = np.ones(len(tracks), dtype=bool)
    for identity in identities:
        mine = np.zeros(len(tracks), dtype=bool)
        for span in identity.spans:
            rows = np.arange(len(tracks))[tracks.rows(span.track)]
            rows = rows[(tracks.t[rows] >= span.first_s) & (tracks.t[rows] <= span.last_s)]
            before = np.flatnonzero(mine & keep)
            doubled = before[tracks.t[before] >= span.first_s]
            keep[doubled] = False
            mine[rows] = True
        names[mine] = identity.robot
    for robot in robots:
        own = names[tracks.rows(robot)]
        if len(own) and (own != robot).any():
            say(
                f"the track named {robot} is not, or not all of it, that robot: it is now {own[own != robot][0]}"
            )
    sigma = None if tracks.sigma is None else tracks.sigma[keep]
    return Tracks.from_rows(tracks.t[keep], names[keep].astype(str), tracks.uv[keep], sigma)
