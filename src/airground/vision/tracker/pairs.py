"""Which sightings could belong to which tracks, and how much speaks for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.vision.tracker.beliefs import log_normal_2

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.beliefs import Beliefs
    from airground.vision.tracker.looks import Looks
    from airground.vision.tracker.options import TrackerOptions

__all__ = ["Pairs", "find_pairs"]

SAME_LABEL = 100.0  # outweighs any other evidence
ONE_LABEL = -1.5  # one of both has a label: tags are read most of the time
REACH = 6.0  # standard deviations of the fiercest motion: a label read farther off is not the same thing


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """P pairs of a track and a sighting."""

    tracks: IntArray
    """(P,). Rows of tracks."""

    sightings: IntArray
    """(P,). Rows of sightings."""

    gain: FloatArray
    """(P,). Logarithm of how much likelier it is that they belong together than that neither belongs to anything."""


def find_pairs(
    beliefs: Beliefs,
    looks: Looks,
    labels: tuple[str, ...],
    *,
    chance: FloatArray,
    sightings: Sightings,
    options: TrackerOptions,
    combined: tuple[FloatArray, FloatArray] | None = None,
) -> Pairs:
    """All pairs within the gates.

    Parameters
    ----------
    beliefs : Beliefs
        Of R tracks, predicted.
    looks : Looks
        Theirs.
    labels : tuple of str
        Theirs; empty where there is none.
    chance : (R,) array
        How probable it is that each is seen.
    sightings : Sightings
        Of the frame.
    options : TrackerOptions
        Gates and clutter.
    combined : tuple of array, optional
        ``beliefs.combined(2)``, where it is known.

    Returns
    -------
    pairs : Pairs
        In the order of tracks, then sightings.
    """
    middle, spread = beliefs.combined(2) if combined is None else combined
    square = -2 * np.log1p(-options.gate)  # chi-square with two degrees of freedom
    noise = sightings.covariance
    loudest = float((noise[:, 0, 0] + noise[:, 1, 1]).max(initial=0.0))
    reach = square * (spread[:, 0, 0] + spread[:, 1, 1] + loudest)

    codes = {label: k for k, label in enumerate(sorted({*labels, *sightings.labels} - {""}), 1)}
    code_of_track = np.array([codes.get(label, 0) for label in labels], dtype=np.intp)
    code_of_sighting = np.array([codes.get(label, 0) for label in sightings.labels], dtype=np.intp)
    fiercest = beliefs.covariance[:, -1]
    fierce = REACH * np.sqrt(fiercest[:, 0, 0] + fiercest[:, 1, 1])
    fierce += REACH * np.sqrt(loudest) + 0.5 * options.merge_px
    reach = np.where(code_of_track > 0, np.maximum(reach, fierce**2), reach)

    aside = sightings.uv[:, 0] - middle[:, :1]
    down = sightings.uv[:, 1] - middle[:, 1:]
    tracks, columns = np.nonzero(aside * aside + down * down <= reach[:, None])
    off = sightings.uv[columns] - middle[tracks]
    mine, theirs = code_of_track[tracks], code_of_sighting[columns]
    same = (mine == theirs) & (mine > 0)
    one = (mine == 0) != (theirs == 0)
    seen = spread[tracks] + noise[columns]
    along, across, down = seen[:, 0, 0], seen[:, 0, 1], seen[:, 1, 1]
    u, v = off[:, 0], off[:, 1]
    far = (down * u * u - 2 * across * u * v + along * v * v) / (along * down - across * across)
    keep = same | ((far <= square) & (one | (mine == theirs)))
    tracks, columns, same, one = tracks[keep], columns[keep], same[keep], one[keep]

    modes = log_normal_2(
        sightings.uv[columns, None] - beliefs.x[tracks, :, :2],
        beliefs.covariance[tracks, :, :2, :2] + noise[columns, None],
    )
    modes += np.log(beliefs.mode[tracks])
    top = modes.max(axis=1, initial=-np.inf)
    log = top + np.log(np.exp(modes - top[:, None]).sum(axis=1))
    alone = 1e-6 * options.clutter_per_mpx  # density of all else [1/px2]; new things are few
    seen_or_not = np.log(chance) - np.log1p(-chance)
    gain = log - np.log(alone) + seen_or_not[tracks]
    gain += np.log(np.maximum(sightings.score[columns], 0.01))
    gain += looks.evidence(tracks, sightings, columns) + np.where(one, ONE_LABEL, 0.0)
    gain = np.where(same, np.maximum(gain, 0.0) + SAME_LABEL, gain)
    return Pairs(tracks.astype(np.intp), columns.astype(np.intp), gain)
