"""Several answers to the question who is who, followed side by side until the motion tells.

Two things that met may have passed each other or turned back, and a sighting near where a lost thing may be may be
clutter. The answers are the hypotheses of D. Reid, An algorithm for tracking multiple targets, IEEE TAC 1979, but only
of the few tracks that a question is about, and only for a while: each hypothesis has filters of its own, is worth what
its filters foretold, and those that come to believe the same are one.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from airground.vision.tracker.beliefs import Beliefs, log_normal_2
from airground.vision.tracker.merging import may_share, share, shared_noise

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.beliefs import MotionModel
    from airground.vision.tracker.options import TrackerOptions
    from airground.vision.tracker.roster import BoolArray

__all__ = ["Child", "Hypothesis", "elsewhere", "grow", "prune"]

FORGET = 1e-4  # a hypothesis that is less probable is dropped
ALIKE = 0.5  # squared distance for each track, in standard deviations, below which two hypotheses are one
APART_PX = 3.0  # a track is elsewhere in another hypothesis when it is farther off than this

Rows = tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """One answer about n tracks."""

    log_weight: float
    """Logarithm of how much speaks for it, up to what all have in common."""

    beliefs: Beliefs
    """Of the n tracks."""

    visible: FloatArray
    """(n,). How probable it is that each track is in plain view."""

    past: tuple[tuple[float, Rows], ...]
    """Times [s], and rows of their sightings that were each track's own; -1 for none."""

    leading: bool
    """Whether it goes on from what was told to the outside last."""

    own: Rows = ()
    """Sighting of each track in the last frame; -1 for none."""

    host: Rows = ()
    """Track, of the n, whose sighting each shared in the last frame; -1 for none."""


@dataclass(frozen=True, slots=True, eq=False)
class Child:
    """A hypothesis with a choice about one more frame."""

    parent: Hypothesis
    """What it goes on from, predicted for the frame."""

    log_weight: float
    """With the frame."""

    own: Rows
    """Sighting of each track; -1 for none."""

    host: Rows
    """Track, within the question, whose sighting each shares; -1 for none."""


def grow(
    parents: list[Hypothesis],
    gain: FloatArray,
    columns: Rows,
    sizes: FloatArray,
    *,
    fresh: BoolArray,
    free: BoolArray,
    sightings: Sightings,
    options: TrackerOptions,
) -> list[Child]:
    """All ways to go on that are worth it, best first.

    Parameters
    ----------
    parents : list of Hypothesis
        H of n tracks each, predicted.
    gain : (H, n, S) array
        What each pair of a track and a sighting is worth; minus infinity where it cannot be.
    columns : tuple of int
        Rows of the S sightings.
    sizes : (n,) array [px]
        Sizes of the tracks; NaN where unknown.
    fresh : (n,) array of bool
        Tracks that were seen lately, alone or not, and so may share a sighting now.
    free : (N,) array of bool
        Sightings of the frame that are to be had.
    sightings : Sightings
        Of the frame.
    options : TrackerOptions
        What looks like one.

    Returns
    -------
    children : list of Child
        Each with a choice of its own.
    """
    _, n, count = gain.shape
    choices = np.array(list(product(range(count + 1), repeat=n)), dtype=np.intp)
    several = np.sort(choices, axis=1)
    twice = ((several[:, 1:] == several[:, :-1]) & (several[:, 1:] < count)).any(axis=1)
    choices = choices[~twice]
    padded = np.concatenate([gain, np.zeros((*gain.shape[:2], 1))], axis=2)
    children: dict[tuple[int, Rows, tuple[bool, ...]], Child] = {}
    for h, parent in enumerate(parents):
        chance = parent.visible * options.detection
        unseen = parent.log_weight + float(np.log1p(-chance).sum())
        worth = padded[h, np.arange(n), choices].sum(axis=1)
        best = np.argsort(-worth, kind="stable")[: 2 * options.hypotheses]
        x, covariance = parent.beliefs.combined(2)
        together = may_share(x, sizes, options)
        for row in best[np.isfinite(worth[best])]:
            own = np.array([(*columns, -1)[k] for k in choices[row]], dtype=np.intp)
            unused = free.copy()
            unused[own[own >= 0]] = False
            host = np.full(n, -1, dtype=np.intp)
            if together:
                own, host = share(
                    x,
                    covariance,
                    sizes,
                    fresh,
                    partner=own,
                    free=unused,
                    sightings=sightings,
                    options=options,
                )
            value = float(worth[row])
            for boss in sorted(set(host[host >= 0].tolist())):
                mates = np.flatnonzero((host == boss) | (np.arange(n) == boss))
                value -= float(padded[h, boss, choices[row][boss]])
                value += _shared_gain(
                    x,
                    covariance,
                    sizes,
                    mates,
                    column=int(own[boss]),
                    chance=chance,
                    sightings=sightings,
                    options=options,
                )
            # Who of those that share a sighting it is said to belong to is no difference.
            key_own = tuple(int(k) for k in np.where(host >= 0, own[host], own))
            child = Child(parent, unseen + value, tuple(own.tolist()), tuple(host.tolist()))
            key = (h, key_own, tuple(host[k] >= 0 or k in host for k in range(n)))
            if key not in children or children[key].log_weight < child.log_weight:
                children[key] = child
    return sorted(children.values(), key=lambda child: -child.log_weight)


def _shared_gain(
    x: FloatArray,
    covariance: FloatArray,
    sizes: FloatArray,
    mates: IntArray,
    *,
    column: int,
    chance: FloatArray,
    sightings: Sightings,
    options: TrackerOptions,
) -> float:
    """What a sighting that several share is worth."""
    middle = x[mates].mean(axis=0)
    near = np.fmax(sizes[mates], options.merge_px).mean()
    spread = covariance[mates].mean(axis=0) / len(mates) + (near / 4) ** 2 * np.eye(2)
    log = log_normal_2(sightings.uv[column] - middle, spread + sightings.covariance[column])
    seen = np.log(chance[mates]) - np.log1p(-chance[mates])
    return float(log - np.log(1e-6 * options.clutter_per_mpx) + seen.sum())


def prune(
    children: list[Child],
    model: MotionModel,
    sizes: FloatArray,
    *,
    sightings: Sightings,
    dt: float,
    options: TrackerOptions,
) -> list[Hypothesis]:
    """Bring the frame into the best children, and keep those that differ.

    Parameters
    ----------
    children : list of Child
        Best first; at least one.
    model : MotionModel
        How tracks move.
    sizes : (n,) array [px]
        Sizes of the tracks; NaN where unknown.
    sightings : Sightings
        Of the frame.
    dt : float [s]
        Time since the last frame.
    options : TrackerOptions
        How many to keep.

    Returns
    -------
    hypotheses : list of Hypothesis
        Best first; the weights of those that were dropped for being alike are in those that they are like.
    """
    least = children[0].log_weight + np.log(FORGET)
    children = [c for c in children if c.log_weight >= least][: 2 * options.hypotheses]
    beliefs = children[0].parent.beliefs
    for child in children[1:]:
        beliefs = beliefs.join(child.parent.beliefs)
    n = len(sizes)
    own = np.array([c.own for c in children])
    host = np.array([c.host for c in children])
    guest = host >= 0
    column = np.where(guest, np.take_along_axis(own, np.maximum(host, 0), axis=1), own)
    loose = guest.copy()
    for k in range(n):
        loose[:, k] |= (host == k).any(axis=1)
    rows = np.flatnonzero(column.ravel() >= 0)
    noise = sightings.covariance[column.ravel()[rows]].copy()
    wide = loose.ravel()[rows]
    near = np.tile(np.fmax(sizes, options.merge_px), len(children))[rows][wide]
    noise[wide] = shared_noise(noise[wide], near, dt)
    uv = sightings.uv[column.ravel()[rows]]
    after, _ = model.update(beliefs.take(rows), uv, noise)
    beliefs = beliefs.put(rows, after)

    x, covariance = beliefs.combined()
    before = np.stack([c.parent.visible for c in children])
    missed = before * (1 - options.detection) / (1 - before * options.detection)
    visible = np.where(column < 0, missed, np.where(loose, before, 1.0))
    state = x[:, :4].reshape(len(children), n, 4)
    inverse = np.linalg.inv(covariance[:, :4, :4]).reshape(len(children), n, 4, 4)
    kept: list[int] = []
    weights: list[float] = []
    for k, child in enumerate(children):
        like = None
        for place, other in enumerate(kept):
            off = state[k] - state[other]
            square = np.einsum("ni,nij,nj->n", off, inverse[other], off)
            if (square < ALIKE).all():
                like = place
                break
        if like is not None:
            weights[like] = float(np.logaddexp(weights[like], child.log_weight))
        elif len(kept) < options.hypotheses:
            kept.append(k)
            weights.append(child.log_weight)
    top = max(weights)
    hypotheses = [
        Hypothesis(
            weight - top,
            beliefs.take(np.arange(k * n, (k + 1) * n)),
            visible[k],
            (*children[k].parent.past, (sightings.t, _alone(children[k]))),
            children[k].parent.leading,
            children[k].own,
            children[k].host,
        )
        for k, weight in zip(kept, weights, strict=True)
    ]
    order = sorted(range(len(kept)), key=lambda j: -weights[j])
    return [hypotheses[j] for j in order]


def _alone(child: Child) -> Rows:
    """Sightings that are a track's own and nobody else's."""
    bosses = set(child.host)
    return tuple(-1 if k in bosses else row for k, row in enumerate(child.own))


def elsewhere(hypotheses: list[Hypothesis]) -> FloatArray:
    """How probable it is that each track is somewhere else than the first hypothesis says.

    Parameters
    ----------
    hypotheses : list of Hypothesis
        Of n tracks; one or more.

    Returns
    -------
    probability : (n,) array
        Zero where all agree.
    """
    weights = np.exp([h.log_weight for h in hypotheses])
    weights /= weights.sum()
    places = np.stack([h.beliefs.combined(2)[0] for h in hypotheses])
    off = np.linalg.norm(places - places[0], axis=-1) > APART_PX
    probability: FloatArray = weights @ off
    return probability
