"""A question who is who, from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from airground.vision.tracker.beliefs import Beliefs
from airground.vision.tracker.hypotheses import Hypothesis, elsewhere, grow, prune
from airground.vision.tracker.pairs import find_pairs
from airground.vision.tracker.state import Revision

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.beliefs import MotionModel
    from airground.vision.tracker.looks import Looks
    from airground.vision.tracker.options import TrackerOptions
    from airground.vision.tracker.roster import BoolArray

__all__ = ["MOST_TRACKS", "Question", "Subject", "Verdict", "begin", "resolve"]

LINGER = 1.5  # what was told stands until something else is likelier by this, as a logarithm
MOST_TRACKS = 4  # in a question; of more, each frame decides for itself
MOST_SIGHTINGS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """Who is who among some tracks."""

    serials: tuple[int, ...]
    """Numbers of the tracks."""

    hypotheses: list[Hypothesis]
    """Best first."""

    doubted: float
    """When it was last unclear who is who [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """What a question is about in a frame."""

    index: IntArray
    """(n,). Rows of the tracks."""

    serials: tuple[int, ...]
    """(n). Their numbers."""

    parents: list[Hypothesis]
    """Answers so far, predicted for the frame; best first."""

    taken: FloatArray
    """(N,). What each sighting is worth to others; infinite where it is not to be had."""

    unclear: bool
    """Whether the frame itself leaves open who is who."""

    doubted: float | None
    """When it was last unclear [s]; None for a new question."""


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What a question says about a frame."""

    rows: IntArray
    """(n,). Rows of the tracks."""

    beliefs: Beliefs
    """Of those, with the frame, by the best hypothesis."""

    visible: FloatArray
    """(n,). How probable it is that each is in plain view."""

    own: IntArray
    """(n,). Sighting of each; -1 for none."""

    host: IntArray
    """(n,). Row of the track whose sighting each shares; -1 for none."""

    doubt: FloatArray
    """(n,). How probable it is that each is elsewhere."""

    question: Question | None
    """What stays open; None once it is answered."""

    revisions: tuple[Revision, ...]
    """What was decided otherwise about earlier frames."""


def begin(
    rows: tuple[int, ...],
    serials: IntArray,
    old: list[Question],
    *,
    beliefs: Beliefs,
    visible: FloatArray,
    taken: FloatArray,
    unclear: bool,
    options: TrackerOptions,
) -> Subject:
    """Put together what is open about some tracks.

    Parameters
    ----------
    rows : tuple of int
        Rows of n tracks.
    serials : (R,) array of int
        Numbers of all tracks.
    old : list of Question
        What was open about some of them, with beliefs predicted for the frame.
    beliefs : Beliefs
        Of all tracks, predicted.
    visible : (R,) array
        How probable it is that each is in plain view.
    taken : (N,) array
        What each sighting is worth to a track that the question is not about; infinite where it is not to be had.
    unclear : bool
        Whether this frame itself leaves open who is who.
    options : TrackerOptions
        Settings.

    Returns
    -------
    subject : Subject
        Of a question.
    """
    index = np.array(rows, dtype=np.intp)
    parents = _parents(index, serials, old, beliefs, visible=visible, options=options)
    numbers = tuple(int(serials[k]) for k in index)
    return Subject(
        index, numbers, parents, taken, unclear, max((q.doubted for q in old), default=None)
    )


def resolve(
    subjects: list[Subject],
    *,
    looks: Looks,
    labels: tuple[str, ...],
    fresh: BoolArray,
    sightings: Sightings,
    model: MotionModel,
    options: TrackerOptions,
    dt: float,
) -> list[Verdict]:
    """Go on with questions by a frame.

    Parameters
    ----------
    subjects : list of Subject
        Of disjoint sets of tracks.
    looks : Looks
        Of all tracks.
    labels : tuple of str
        Of all tracks.
    fresh : (R,) array of bool
        Which may share a sighting.
    sightings : Sightings
        Of the frame.
    model : MotionModel
        How tracks move.
    options : TrackerOptions
        Settings.
    dt : float [s]
        Time since the last frame.

    Returns
    -------
    verdicts : list of Verdict
        One for each.
    """
    parents = [parent for subject in subjects for parent in subject.parents]
    if not parents:
        return []
    many = np.concatenate([np.tile(subject.index, len(subject.parents)) for subject in subjects])
    pairs = find_pairs(  # all at once is fast
        parents[0].beliefs.join(*(parent.beliefs for parent in parents[1:])),
        looks.take(many),
        tuple(labels[k] for k in many),
        chance=options.detection * np.concatenate([parent.visible for parent in parents]),
        sightings=sightings,
        options=options,
    )
    verdicts, at = [], 0
    for subject in subjects:
        n, count = len(subject.index), len(subject.parents)
        first, last = np.searchsorted(pairs.tracks, [at, at + n * count])
        tracks, columns = pairs.tracks[first:last] - at, pairs.sightings[first:last]
        worth = pairs.gain[first:last] - subject.taken[columns]
        at += n * count
        usable = np.isfinite(worth) & (worth > 0)
        columns, place = np.unique(columns[usable], return_inverse=True)
        gain = np.full((count, n, len(columns)), -np.inf)
        gain[tracks[usable] // n, tracks[usable] % n, place] = worth[usable]
        if len(columns) > MOST_SIGHTINGS:
            best = np.argsort(-gain.max(axis=(0, 1)), kind="stable")[:MOST_SIGHTINGS]
            columns, gain = columns[best], gain[:, :, best]
        sizes = np.exp(looks.size[subject.index, 0])
        children = grow(
            subject.parents,
            gain,
            tuple(columns.tolist()),
            sizes,
            fresh=fresh[subject.index],
            free=np.isfinite(subject.taken),
            sightings=sightings,
            options=options,
        )
        hypotheses = prune(children, model, sizes, sightings=sightings, dt=dt, options=options)
        verdicts.append(_verdict(subject, hypotheses, t=sightings.t, options=options))
    return verdicts


def _parents(
    index: IntArray,
    serials: IntArray,
    old: list[Question],
    beliefs: Beliefs,
    *,
    visible: FloatArray,
    options: TrackerOptions,
) -> list[Hypothesis]:
    """Every way to put the open questions and the tracks that were clear together."""
    numbers = [int(serials[k]) for k in index]
    parents = []
    for parts in product(*(question.hypotheses for question in old)):
        mine, seen = beliefs.take(index), visible[index]
        for question, part in zip(old, parts, strict=True):
            where = np.array([numbers.index(s) for s in question.serials], dtype=np.intp)
            mine = mine.put(where, part.beliefs)
            seen[where] = part.visible
        past = parts[0].past if len(old) == 1 and len(old[0].serials) == len(numbers) else ()
        if old and not past:
            past = _joined_past(numbers, old, parts)
        parents.append(
            Hypothesis(
                sum(part.log_weight for part in parts),
                mine,
                seen,
                past,
                all(part.leading for part in parts),
            )
        )
    parents.sort(key=lambda parent: -parent.log_weight)
    return parents[: options.hypotheses]


def _joined_past(
    numbers: list[int], old: list[Question], parts: tuple[Hypothesis, ...]
) -> tuple[tuple[float, tuple[int, ...]], ...]:
    """Pasts side by side; -2 where a track was not part of a question."""
    rows: dict[float, list[int]] = {}
    for question, part in zip(old, parts, strict=True):
        places = [numbers.index(s) for s in question.serials]
        for t, own in part.past:
            line = rows.setdefault(t, [-2] * len(numbers))
            for place, row in zip(places, own, strict=True):
                line[place] = row
    return tuple((t, tuple(rows[t])) for t in sorted(rows))


def _verdict(
    subject: Subject, hypotheses: list[Hypothesis], *, t: float, options: TrackerOptions
) -> Verdict:
    index = subject.index
    told = next((k for k, h in enumerate(hypotheses) if h.leading), 0)
    if hypotheses[told].log_weight > hypotheses[0].log_weight - LINGER:
        hypotheses.insert(0, hypotheses.pop(told))
    best = hypotheses[0]
    host = np.array([-1 if k < 0 else index[k] for k in best.host], dtype=np.intp)
    revisions: tuple[Revision, ...] = ()
    if not best.leading:
        revisions = tuple(
            Revision(serial, tuple((when, own[j]) for when, own in best.past if own[j] > -2))
            for j, serial in enumerate(subject.serials)
        )
    doubted = t if subject.unclear or subject.doubted is None else subject.doubted
    doubt = elsewhere(hypotheses)
    question = None
    if len(hypotheses) > 1 and t - doubted <= options.defer_s:
        question = Question(
            subject.serials,
            [replace(h, leading=k == 0) for k, h in enumerate(hypotheses)],
            doubted,
        )
    return Verdict(
        index,
        best.beliefs,
        best.visible,
        np.array(best.own, dtype=np.intp),
        host,
        doubt,
        question,
        revisions,
    )
