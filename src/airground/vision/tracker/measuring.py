"""What a frame's sightings do to beliefs and looks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.vision.tracker.merging import shared_noise

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.beliefs import Beliefs, MotionModel
    from airground.vision.tracker.looks import Looks
    from airground.vision.tracker.options import TrackerOptions
    from airground.vision.tracker.roster import BoolArray

__all__ = ["measure"]


def measure(
    beliefs: Beliefs,
    looks: Looks,
    sightings: Sightings,
    *,
    partner: IntArray,
    host: IntArray,
    asked: BoolArray,
    model: MotionModel,
    options: TrackerOptions,
    dt: float,
) -> tuple[Beliefs, Looks]:
    """Bring sightings into what is believed of tracks.

    Parameters
    ----------
    beliefs : Beliefs
        Of R tracks, predicted.
    looks : Looks
        Theirs, predicted.
    sightings : Sightings
        Of the frame.
    partner : (R,) array of int
        Sighting of each; -1 for none.
    host : (R,) array of int
        Row of the track whose sighting each shares; -1 for none.
    asked : (R,) array of bool
        Tracks that are in question: looks are evidence of who is who, so theirs must wait.
    model : MotionModel
        How tracks move.
    options : TrackerOptions
        How near things look like one.
    dt : float [s]
        Time since the last frame.

    Returns
    -------
    beliefs : Beliefs
        With the sightings.
    looks : Looks
        With the sightings.
    """
    guests = np.flatnonzero(host >= 0)
    shared = np.zeros(len(partner), dtype=np.bool_)
    shared[guests] = shared[host[guests]] = True
    column = partner.copy()
    column[guests] = partner[host[guests]]
    rows = np.flatnonzero(column >= 0)
    noise = sightings.covariance[column[rows]].copy()
    if len(guests):
        loose = shared[rows]
        near = np.fmax(np.exp(looks.size[rows[loose], 0]), options.merge_px)
        noise[loose] = shared_noise(noise[loose], near, dt)
    own = np.flatnonzero((partner >= 0) & ~shared & ~asked)
    fresh = looks.update(own, sightings, partner[own])
    if len(rows) == len(beliefs):
        return model.update(beliefs, sightings.uv[column], noise)[0], fresh
    after, _ = model.update(beliefs.take(rows), sightings.uv[column[rows]], noise)
    return beliefs.put(rows, after), fresh
