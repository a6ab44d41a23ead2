"""Which tracks could be mistaken for each other now, and what is still open from before."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from airground.vision.tracker.questions import (
    MOST_TRACKS,
    Question,
    Subject,
    Verdict,
    begin,
    resolve,
)

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.sightings import Sightings
    from airground.vision.tracker.beliefs import Beliefs, MotionModel
    from airground.vision.tracker.looks import Looks
    from airground.vision.tracker.options import TrackerOptions
    from airground.vision.tracker.pairs import Pairs
    from airground.vision.tracker.roster import BoolArray, Roster

__all__ = ["ask", "asked_about", "carry_on", "doubtful", "heaps"]

OPEN = 6.0  # an exchange that costs less than this opens a question
MOST_QUESTIONS = 12  # that are gone on with in a frame; what is beyond is decided on the spot, and said to be in doubt


def ask(
    questions: list[Question],
    pairs: Pairs,
    partner: IntArray,
    host: IntArray,
    *,
    roster: Roster,
    beliefs: Beliefs,
    looks: Looks,
    visible: FloatArray,
    fresh: BoolArray,
    sightings: Sightings,
    model: MotionModel,
    options: TrackerOptions,
    dt: float,
) -> tuple[list[Verdict], FloatArray]:
    """Open questions of who is who, and go on with those that are open.

    Parameters
    ----------
    questions : list of Question
        Those that are open, with beliefs predicted for the frame.
    pairs : Pairs
        Of all tracks.
    partner : (R,) array of int
        Sighting of each track if the frame is taken for itself; -1 for none.
    host : (R,) array of int
        Track whose sighting each shares, likewise; -1 for none.
    roster : Roster
        All tracks.
    beliefs : Beliefs
        Theirs, predicted.
    looks : Looks
        Theirs, predicted.
    visible : (R,) array
        How probable it is that each is in plain view.
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
        Of disjoint sets of tracks.
    doubt : (R,) array
        How probable it is that tracks were exchanged in this frame that no verdict is about.
    """
    costs = doubtful(pairs, partner, roster.confirmed)
    if not costs and not questions:
        return [], np.zeros(len(roster))
    row_of = {int(serial): k for k, serial in enumerate(roster.serial)}
    alive = [q for q in questions if all(serial in row_of for serial in q.serials)]
    old = [tuple(row_of[serial] for serial in question.serials) for question in alive]
    edges = [edge for edge, _ in costs]
    together = [(int(k), int(host[k])) for k in np.flatnonzero(host >= 0)]
    asked = {k for rows in [*edges, *old] for k in rows}
    value = np.zeros(len(roster))
    own = partner[pairs.tracks] == pairs.sightings
    value[pairs.tracks[own]] = np.maximum(pairs.gain[own], 0.0)
    owners = np.flatnonzero(partner >= 0)
    subjects: list[Subject] = []
    for heap in heaps([*edges, *together], old) if asked else ():
        mine = set(heap)
        if not mine & asked:
            continue  # near each other, but there is no doubt who is who
        if len(heap) > MOST_TRACKS or options.hypotheses == 1 or len(subjects) == MOST_QUESTIONS:
            continue
        taken = np.zeros(len(sightings))
        theirs = owners[~np.isin(owners, heap)]
        taken[partner[theirs]] = np.where(roster.confirmed[theirs], np.inf, value[theirs])
        subjects.append(
            begin(
                heap,
                roster.serial,
                [q for q, rows in zip(alive, old, strict=True) if mine & set(rows)],
                beliefs=beliefs,
                visible=visible,
                taken=taken,
                unclear=any(set(edge) & mine for edge in edges),
                options=options,
            )
        )
    verdicts = resolve(
        subjects,
        looks=looks,
        labels=tuple(roster.labels),
        fresh=fresh,
        sightings=sightings,
        model=model,
        options=options,
        dt=dt,
    )
    doubt = np.zeros(len(roster))
    open_now = {k for subject in subjects for k in subject.index.tolist()}
    for edge, cost in costs:
        if len(edge) > 1 and not open_now & set(edge):
            rows = list(edge)
            doubt[rows] = 1 - (1 - doubt[rows]) * (1 - 1 / (1 + np.exp(cost)))
    return verdicts, doubt


def asked_about(questions: list[Question], serial: IntArray) -> BoolArray:
    """Which tracks are in question.

    Parameters
    ----------
    questions : list of Question
        Those that are open.
    serial : (R,) array of int
        Numbers of all tracks.

    Returns
    -------
    asked : (R,) array of bool
        Those.
    """
    asked = np.zeros(len(serial), dtype=np.bool_)
    for question in questions:
        asked |= np.isin(serial, question.serials)
    return asked


def doubtful(
    pairs: Pairs, partner: IntArray, confirmed: BoolArray
) -> list[tuple[tuple[int, ...], float]]:
    """Tracks whose sightings could be exchanged, or could belong to nothing.

    Parameters
    ----------
    pairs : Pairs
        Of all tracks.
    partner : (R,) array of int
        Sighting of each; -1 for none.
    confirmed : (R,) array of bool
        Only these count.

    Returns
    -------
    doubtful : list of tuple
        Rows of one or two tracks, ascending, and what it costs to decide otherwise, as a logarithm.
    """
    mine = confirmed[pairs.tracks]
    tracks, columns, gain = pairs.tracks[mine], pairs.sightings[mine], pairs.gain[mine]
    wanted = np.bincount(columns, minlength=1)
    busy = np.flatnonzero(wanted > 1)
    faint = (partner[tracks] == columns) & (gain < OPEN)
    alone: list[tuple[tuple[int, ...], float]] = [
        ((int(k),), float(g)) for k, g in zip(tracks[faint], gain[faint], strict=True)
    ]
    if len(busy) == 0:
        return sorted(alone)
    value = {(int(a), int(i)): float(g) for a, i, g in zip(tracks, columns, gain, strict=True)}
    found: dict[tuple[int, ...], float] = {}
    order = np.argsort(columns, kind="stable")
    first = np.searchsorted(columns[order], busy)
    for start, number in zip(first, wanted[busy], strict=True):
        rivals = sorted(int(k) for k in tracks[order[start : start + number]])
        for place, a in enumerate(rivals):
            for b in rivals[place + 1 :]:
                i, j = int(partner[a]), int(partner[b])
                if (a, b) in found or i == j:
                    continue
                kept = value.get((a, i), 0.0) + value.get((b, j), 0.0)
                swapped = _value(value, a, j) + _value(value, b, i)
                if kept - swapped < OPEN:
                    found[a, b] = kept - swapped
    return sorted([*alone, *found.items()])


def _value(value: dict[tuple[int, int], float], track: int, column: int) -> float:
    return 0.0 if column < 0 else value.get((track, column), -np.inf)


def heaps(edges: list[tuple[int, ...]], sets: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Join what touches.

    Parameters
    ----------
    edges : list of tuple of int
        Sets.
    sets : list of tuple of int
        More sets.

    Returns
    -------
    heaps : list of tuple of int
        Disjoint, each ascending.
    """
    out: list[set[int]] = []
    for item in [*edges, *sets]:
        mine = set(item)
        rest = []
        for other in out:
            if other & mine:
                mine |= other
            else:
                rest.append(other)
        out = [*rest, mine]
    return sorted(tuple(sorted(heap)) for heap in out)


def carry_on(
    beliefs: Beliefs,
    visible: FloatArray,
    questions: list[Question],
    dt: float,
    *,
    model: MotionModel,
    options: TrackerOptions,
) -> tuple[Beliefs, FloatArray, list[Question]]:
    """Bring everything that is believed to a later time.

    Parameters
    ----------
    beliefs : Beliefs
        Of all tracks.
    visible : (R,) array
        How probable it is that each is in plain view.
    questions : list of Question
        Those that are open.
    dt : float [s]
        How much later.
    model : MotionModel
        How tracks move.
    options : TrackerOptions
        How things pass out of view and come back.

    Returns
    -------
    beliefs : Beliefs
        Then.
    visible : (R,) array
        Then.
    questions : list of Question
        Then.
    """
    parts = [h.beliefs for question in questions for h in question.hypotheses]
    # All at once is fast.
    every, at = model.predict(beliefs.join(*parts) if parts else beliefs, dt), len(beliefs)
    hide = -np.expm1(-dt * options.hidden_per_s)
    show = -np.expm1(-dt / options.hidden_s)
    later = []
    for question in questions:
        moved = []
        for old in question.hypotheses:
            rows, at = np.arange(at, at + len(old.beliefs)), at + len(old.beliefs)
            seen = old.visible * (1 - hide) + (1 - old.visible) * show
            moved.append(replace(old, beliefs=every.take(rows), visible=seen))
        later.append(replace(question, hypotheses=moved))
    in_view: FloatArray = visible * (1 - hide) + (1 - visible) * show
    return every.take(np.arange(len(beliefs))) if parts else every, in_view, later
