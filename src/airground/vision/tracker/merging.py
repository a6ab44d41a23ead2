"""Things so near to each other that they look like one: who shares whose sighting, and what it is worth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.options import TrackerOptions
    from airground.vision.tracker.roster import BoolArray

__all__ = ["find_hosts", "may_share", "share", "shared_noise"]

RIM = 1.3  # of the size: at most so far apart things are seen as one
SIDE = 0.75  # of the size: how far from the middle of several things each may be
WANDER_S = 0.25  # how long the middle of two things keeps its place between them [s]


def may_share(middle: FloatArray, sizes: FloatArray, options: TrackerOptions) -> bool:
    """Whether any two of some tracks are near enough to share a sighting, however uncertain they are.

    Parameters
    ----------
    middle : (R, 2) array [px]
        Predicted positions.
    sizes : (R,) array [px]
        Sizes; NaN where unknown.
    options : TrackerOptions
        How near is too near.

    Returns
    -------
    near : bool
        False spares the trouble of looking closer.
    """
    if len(middle) < 2:
        return False
    reach = max(2 * SIDE, RIM) * float(np.fmax(sizes, options.merge_px).max()) + options.merge_px
    apart = _distances(middle, middle)
    return bool((apart[np.triu_indices(len(middle), 1)] <= reach).any())


def share(
    middle: FloatArray,
    spread: FloatArray,
    sizes: FloatArray,
    eligible: BoolArray,
    *,
    partner: IntArray,
    free: BoolArray,
    sightings: Sightings,
    options: TrackerOptions,
) -> tuple[IntArray, IntArray]:
    """Give sightings to several tracks where they look like one.

    Where things have just come together, their common sighting is some way from where each of them should be, so that
    none may have it for its own. Two or more that are not seen, around a sighting that is nobody's, share it.

    Parameters
    ----------
    middle : (R, 2) array [px]
        Predicted positions.
    spread : (R, 2, 2) array [px2]
        Their covariances.
    sizes : (R,) array [px]
        Sizes; NaN where unknown.
    eligible : (R,) array of bool
        Which may share.
    partner : (R,) array of int
        Sighting of each; -1 for none.
    free : (N,) array of bool
        Sightings that are nobody's.
    sightings : Sightings
        Of the frame.
    options : TrackerOptions
        How near is too near.

    Returns
    -------
    partner : (R,) array of int
        With those sightings given to the nearest of the tracks that share them.
    host : (R,) array of int
        Row of the track whose sighting each shares; -1 for none.
    """
    partner = partner.copy()
    lonely = np.flatnonzero(eligible & (partner < 0))
    if len(lonely) == 0:
        return partner, np.full(len(partner), -1, dtype=np.intp)
    blobs = [j for j in np.flatnonzero(free) if sightings.labels[j] == ""]
    if len(lonely) > 1 and blobs:
        sigma = np.sqrt(np.trace(spread[lonely], axis1=1, axis2=2))
        reach = np.fmax(sizes[lonely], options.merge_px) * SIDE
        reach = reach + np.minimum(sigma, 0.5 * options.merge_px)
        aside = _distances(middle[lonely], sightings.uv[blobs])
        aside[aside > reach[:, None]] = np.inf
        # Each track considers the nearest only.
        nearest = np.argmin(aside, axis=1)
        hit = np.isfinite(aside[np.arange(len(lonely)), nearest])
        for column in np.unique(nearest[hit]):
            around = np.flatnonzero(hit & (nearest == column))
            if len(around) > 1:
                boss = around[np.argmin(aside[around, column])]
                partner[lonely[boss]] = blobs[column]
    host = find_hosts(
        middle, spread, sizes, eligible, partner=partner, sightings=sightings, options=options
    )
    return partner, host


def find_hosts(
    middle: FloatArray,
    spread: FloatArray,
    sizes: FloatArray,
    eligible: BoolArray,
    *,
    partner: IntArray,
    sightings: Sightings,
    options: TrackerOptions,
) -> IntArray:
    """Tracks that were not seen because they look like one with another that was.

    Parameters
    ----------
    middle : (R, 2) array [px]
        Predicted positions.
    spread : (R, 2, 2) array [px2]
        Their covariances.
    sizes : (R,) array [px]
        Sizes; NaN where unknown.
    eligible : (R,) array of bool
        Which may share.
    partner : (R,) array of int
        Sighting of each; -1 for none.
    sightings : Sightings
        Of the frame.
    options : TrackerOptions
        How near is too near.

    Returns
    -------
    host : (R,) array of int
        Row of the track whose sighting each shares; -1 for none.
    """
    host = np.full(len(middle), -1, dtype=np.intp)
    labelled = np.array([label != "" for label in sightings.labels], dtype=np.bool_)
    hosts = np.flatnonzero(eligible & (partner >= 0))
    hosts = hosts[~labelled[partner[hosts]]]  # a label is of one thing
    guests = np.flatnonzero(eligible & (partner < 0))
    if len(hosts) == 0 or len(guests) == 0:
        return host
    apart = _distances(middle[guests], middle[hosts])
    blob = sightings.uv[partner[hosts]]
    aside = _distances(middle[guests], blob)
    sigma = np.sqrt(np.trace(spread, axis1=1, axis2=2))
    slack = np.minimum(0.5 * sigma[guests][:, None], 0.5 * options.merge_px)
    sizes = np.where(np.isnan(sizes), options.merge_px, sizes)
    near = np.maximum(0.5 * (sizes[guests][:, None] + sizes[hosts][None]), options.merge_px)
    rim = RIM * near + slack
    # Well apart, a sighting where the host alone should be is the host's alone.
    off = np.linalg.norm(middle[hosts] - blob, axis=1)
    alone = (off < 3 * sigma[hosts])[None] & (off[None] < 0.5 * aside) & (apart > 0.8 * near)
    fits = (apart < rim) & (aside < rim) & ~alone
    best = np.argmin(np.where(fits, aside, np.inf), axis=1)
    found = fits[np.arange(len(guests)), best]
    host[guests[found]] = hosts[best[found]]
    return host


def shared_noise(covariance: FloatArray, near_px: FloatArray, dt: float) -> FloatArray:
    """Covariance of a shared sighting as a sighting of one of those who share it.

    The offset stays alike for some `WANDER_S`, so a sighting is worth the less the sooner it follows the last.

    Parameters
    ----------
    covariance : (K, 2, 2) array [px2]
        Of the sightings.
    near_px : (K,) array [px]
        Distance at which things look like one.
    dt : float [s]
        Time since the last frame.

    Returns
    -------
    covariance : (K, 2, 2) array [px2]
        With the offset of the middle from each.
    """
    repeats = max(1.0, 2 * WANDER_S / dt) if dt > 0 else 1.0
    offset = (near_px / 4) ** 2 * repeats
    noise: FloatArray = covariance + offset[:, None, None] * np.eye(2)
    return noise


def _distances(one: FloatArray, other: FloatArray) -> FloatArray:
    """Of each to each."""
    distances: FloatArray = np.hypot(one[:, :1] - other[:, 0], one[:, 1:] - other[:, 1])
    return distances
