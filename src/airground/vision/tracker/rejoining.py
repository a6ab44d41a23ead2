"""Things that turn up and are ones that were lost.

A single sighting some way from where a lost track may be by now is more likely clutter than that track. Once a
candidate has several sightings it is no clutter any more, and the question is whether it is new or was known before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.vision.tracker.assignment import assign

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.tracker.beliefs import Beliefs
    from airground.vision.tracker.options import TrackerOptions
    from airground.vision.tracker.roster import BoolArray, Roster

__all__ = ["find_returned"]

SAME_LABEL = 100.0


def find_returned(
    beliefs: Beliefs, roster: Roster, ready: BoolArray, options: TrackerOptions
) -> tuple[IntArray, IntArray, FloatArray]:
    """Pair candidates that are about to be confirmed with tracks that were lost before they turned up.

    Position and velocity of both are compared: the track's as predicted, which has grown uncertain, and the
    candidate's as measured. A new thing may be anywhere, at the usual speed.

    Parameters
    ----------
    beliefs : Beliefs
        Of R tracks, now.
    roster : Roster
        Theirs.
    ready : (R,) array of bool
        Candidates that are good enough to be things.
    options : TrackerOptions
        How frequent new things are.

    Returns
    -------
    lost : (P,) array of int
        Rows of tracks.
    back : (P,) array of int
        Rows of the candidates that they are.
    doubt : (P,) array
        How probable it is that a candidate is another of the lost tracks.
    """
    none = np.empty(0, dtype=np.intp)
    back = np.flatnonzero(ready)
    if len(back) == 0:
        return none, none, np.empty(0)
    lost = np.flatnonzero(roster.confirmed & (roster.seen < roster.born[back].max()))
    if len(lost) == 0:
        return none, none, np.empty(0)
    x, covariance = beliefs.take(back).combined()
    then = beliefs.take(lost)
    off = then.x[:, None, :, :4] - x[None, :, None, :4]
    spread = then.covariance[:, None, :, :4, :4] + covariance[None, :, None, :4, :4]
    same = _log_normal(off, spread) + np.log(then.mode)[:, None]
    top = same.max(axis=2)
    same = top + np.log(np.exp(same - top[..., None]).sum(axis=2))
    square = (x[:, 2:4] ** 2).sum(axis=1) / options.speed_pxps**2
    new = np.log(1e-6 * options.births_per_mpx_s) - 0.5 * square
    new -= np.log(2 * np.pi * options.speed_pxps**2)
    gain = same - new - np.log(options.hidden_s)
    gain[roster.seen[lost][:, None] >= roster.born[back][None]] = -np.inf
    for i, k in enumerate(lost):
        for j, c in enumerate(back):
            if roster.labels[k] and roster.labels[c]:
                alike = roster.labels[k] == roster.labels[c]
                gain[i, j] = gain[i, j] + SAME_LABEL if alike else -np.inf
    rows, columns = np.nonzero(np.isfinite(gain))
    partner = assign(rows, columns, gain[rows, columns], (len(lost), len(back)))
    chosen = np.flatnonzero(partner >= 0)
    mine = gain[chosen, partner[chosen]]
    # Odds against all other tracks that could be this candidate, unless these have gone to others for good reason.
    free = gain[:, partner[chosen]].copy()
    free[chosen, np.arange(len(chosen))] = -np.inf
    rivals = np.exp(np.minimum(free - mine, 0.0)).sum(axis=0)
    return lost[chosen], back[partner[chosen]], rivals / (1 + rivals)


def _log_normal(off: FloatArray, covariance: FloatArray) -> FloatArray:
    square = (off * np.linalg.solve(covariance, off[..., None])[..., 0]).sum(axis=-1)
    log: FloatArray = -0.5 * (
        square + np.linalg.slogdet(covariance)[1] + off.shape[-1] * np.log(2 * np.pi)
    )
    return log
