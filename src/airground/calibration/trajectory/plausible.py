"""Sightings that fit in with their neighbours: gross errors out, before velocities are taken.

A sighting is believed if the straight lines through pairs of its neighbours, one before and one after it, often
enough lead to it. Half of the neighbours may be wrong: their lines lead anywhere, those of the others to one place.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.recordings import Tracks
    from airground.geometry.arrays import FloatArray

__all__ = ["plausible_sightings"]

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

SIDE = 5  # neighbours on each side
FEWEST = 4 * SIDE
USUAL_SHARE = 0.25  # quantile of the distances that is good even where half of them are wrong
FACTOR = 12.0
LEAST_PX = 3.0
CLEAN_PX = 30.0  # beyond it a quick look may have taken the errors for the noise


def plausible_sightings(tracks: Tracks, target: str) -> BoolArray:
    """Tell a target's sightings that fit in with their neighbours.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    target : str
        Which target.

    Returns
    -------
    plausible : (N,) array of bool
        All where there are too few to tell.
    """
    rows = tracks.rows(target)
    t, uv = tracks.t[rows], tracks.uv[rows]
    count = len(t)
    if count < FEWEST:
        return np.ones(count, dtype=bool)
    for side in (2, SIDE):  # a clean track shows at the first look
        distance = _second_nearest(t, uv, side)
        usual = max(LEAST_PX, FACTOR * float(np.quantile(distance, USUAL_SHARE)))
        plausible = distance <= usual
        if plausible.all() and usual <= CLEAN_PX:
            break
    return np.asarray(plausible)


def _second_nearest(t: FloatArray, uv: FloatArray, side: int) -> FloatArray:
    """(N,) [px]. Distance to the second nearest of the places to which the lines lead: one alone may be chance."""
    count = len(t)
    nearest = np.full(count, np.inf)
    second = np.full(count, np.inf)
    rows = np.arange(count)
    for before in range(1, side + 1):
        for after in range(1, side + 1):
            # At the ends the neighbours are those that there are.
            i = np.clip(rows - before, 0, count - 1 - before - after)
            j = np.clip(rows + after, before + after, count - 1)
            i = np.where(i == rows, i + before + after - 1, i)
            j = np.where(j == rows, j - before - after + 1, j)
            span = t[j] - t[i]
            share = (t - t[i]) / np.where(span == 0, 1.0, span)
            far = np.abs(share) > 2 * SIDE  # extrapolations that tell nothing
            share = np.where(far, np.nan, share)
            off = uv - uv[i] - share[:, None] * (uv[j] - uv[i])
            d = np.where(span == 0, np.inf, np.hypot(off[:, 0], off[:, 1]))
            d = np.where(np.isfinite(d), d, np.inf)
            second = np.minimum(second, np.maximum(nearest, d))
            nearest = np.minimum(nearest, d)
    return second
