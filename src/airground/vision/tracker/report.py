"""What a tracker tells the outside."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from airground.vision.tracker.looks import wrap
from airground.vision.tracker.state import Revision, TrackerState

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.tracker.beliefs import Beliefs
    from airground.vision.tracker.looks import Looks
    from airground.vision.tracker.roster import Roster

__all__ = ["report"]

_Scalar = TypeVar("_Scalar", bound=np.generic)


def report(
    roster: Roster,
    beliefs: Beliefs,
    looks: Looks,
    *,
    t: float,
    sighting: IntArray,
    host: IntArray,
    doubt: FloatArray,
    revisions: tuple[Revision, ...] = (),
    joined: tuple[tuple[int, int], ...] = (),
) -> TrackerState:
    """Put together what is known of all tracks at a time.

    Parameters
    ----------
    roster : Roster
        R tracks.
    beliefs : Beliefs
        Where they are, at that time.
    looks : Looks
        What they look like, at that time.
    t : float [s]
        The time.
    sighting : (R,) array of int
        Their sightings of that time; -1 for none.
    host : (R,) array of int
        Row of the track whose sighting each shares; -1 for none.
    doubt : (R,) array
        How probable it is that each is elsewhere, from questions that are open.
    revisions : tuple of Revision
        What was decided otherwise.
    joined : tuple of tuple of int
        Candidates that were tracks.

    Returns
    -------
    state : TrackerState
        Copies that cannot be written to.
    """
    x, covariance = beliefs.combined()
    unknown = np.isnan(looks.angle[:, 0])
    spread = np.sqrt(np.maximum(looks.spread[:, 0], 0.0))
    return TrackerState(
        t=t,
        names=tuple(roster.names),
        labels=tuple(roster.labels),
        serial=_fixed(roster.serial),
        uv=_fixed(x[:, :2]),
        uv_dot=_fixed(x[:, 2:4]),
        covariance=_fixed(covariance[:, :4, :4]),
        angle=_fixed(wrap(looks.angle[:, 0])),
        angle_sigma=_fixed(np.where(unknown, np.nan, spread)),
        confirmed=_fixed(roster.confirmed),
        lost_for=_fixed(t - roster.seen),
        sighting=_fixed(sighting),
        age_s=_fixed(t - roster.born),
        quality=_fixed(roster.quality),
        swap_probability=_fixed(1 - (1 - roster.swap) * (1 - doubt)),
        merged_with=_shared_names(host, roster.names),
        revisions=revisions,
        joined=joined,
    )


def _fixed(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    copy = array.copy()
    copy.flags.writeable = False
    return copy


def _shared_names(host: IntArray, names: list[str]) -> tuple[tuple[str, ...], ...]:
    together: dict[int, list[int]] = {}
    for guest in np.flatnonzero(host >= 0):
        together.setdefault(int(host[guest]), [int(host[guest])]).append(int(guest))
    merged: list[tuple[str, ...]] = [()] * len(names)
    for group in together.values():
        for k in group:
            merged[k] = tuple(names[j] for j in sorted(group) if j != k)
    return tuple(merged)
