"""Which sighting belongs to which track: the assignment of the greatest total gain."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["assign", "prepare"]


def prepare() -> None:
    """Have all loaded that `assign` ever needs: SciPy takes a second or more, else when things first meet."""
    from scipy.optimize import linear_sum_assignment  # type: ignore[import-untyped,unused-ignore]  # noqa: F401
    from scipy.sparse import csgraph  # type: ignore[import-untyped,unused-ignore]  # noqa: F401


def assign(
    tracks: IntArray, sightings: IntArray, gain: FloatArray, shape: tuple[int, int]
) -> IntArray:
    """Pair tracks with sightings one to one so that the gains of the pairs add up to the most.

    A track or a sighting without a partner gains nothing, so pairs that would cost are left out. Pairs that share no
    track and no sighting with others are taken as they are; the rest is solved group by group.

    Parameters
    ----------
    tracks, sightings : (P,) array of int
        The pairs that are possible.
    gain : (P,) array
        Of each: logarithm of how much likelier the pair is than both being alone.
    shape : tuple of int
        How many tracks and how many sightings there are.

    Returns
    -------
    partner : (tracks,) array of int
        Sighting of each track; -1 for none.
    """
    partner = np.full(shape[0], -1, dtype=np.intp)
    worth = gain > 0
    tracks, sightings, gain = tracks[worth], sightings[worth], gain[worth]
    alone = (np.bincount(tracks, minlength=shape[0])[tracks] == 1) & (
        np.bincount(sightings, minlength=shape[1])[sightings] == 1
    )
    partner[tracks[alone]] = sightings[alone]
    tracks, sightings, gain = tracks[~alone], sightings[~alone], gain[~alone]
    if len(tracks) == 0:
        return partner
    from scipy.optimize import linear_sum_assignment  # type: ignore[import-untyped,unused-ignore]
    from scipy.sparse import coo_array  # type: ignore[import-untyped,unused-ignore]
    from scipy.sparse.csgraph import connected_components  # type: ignore[import-untyped,unused-ignore]

    total = sum(shape)
    graph = coo_array((np.ones(len(tracks)), (tracks, sightings + shape[0])), shape=(total, total))
    group = connected_components(graph, directed=False)[1][tracks]
    order = np.argsort(group, kind="stable")
    for pairs in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        rows, row = np.unique(tracks[pairs], return_inverse=True)
        columns, column = np.unique(sightings[pairs], return_inverse=True)
        table = np.zeros((len(rows), len(columns)))
        table[row, column] = gain[pairs]
        i, j = linear_sum_assignment(table, maximize=True)
        taken = table[i, j] > 0  # zero stands for no pair
        partner[rows[i[taken]]] = columns[j[taken]]
    return partner
