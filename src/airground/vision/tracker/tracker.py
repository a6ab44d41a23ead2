"""Sightings in, tracks out, frame by frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.vision.sightings import Sightings
from airground.vision.tracker.asking import ask, asked_about, carry_on
from airground.vision.tracker.assignment import assign, prepare
from airground.vision.tracker.beliefs import MotionModel
from airground.vision.tracker.encounters import Encounters, mistaken
from airground.vision.tracker.looks import Looks
from airground.vision.tracker.measuring import measure
from airground.vision.tracker.merging import share
from airground.vision.tracker.naming import Naming
from airground.vision.tracker.options import TrackerOptions
from airground.vision.tracker.pairs import find_pairs
from airground.vision.tracker.rejoining import find_returned
from airground.vision.tracker.report import report
from airground.vision.tracker.roster import Roster, birth_order

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.tracker.questions import Question, Verdict
    from airground.vision.tracker.roster import BoolArray
    from airground.vision.tracker.state import Revision, TrackerState

__all__ = ["Tracker"]

RECENT_S = 0.5  # memory of a track's quality [s]
GIVE_UP = -3.0  # odds that a candidate may lose since its first sighting, as a logarithm


class Tracker:
    """Keeps apart the things that a detector sees.

    Each frame's sightings are paired with the tracks so that the whole is likeliest, given where the tracks should be,
    what they look like and which labels they bear, and given that things are missed and that some sightings are false.

    Parameters
    ----------
    options : TrackerOptions, optional
        Settings.
    """

    def __init__(self, options: TrackerOptions | None = None) -> None:
        self.options = options or TrackerOptions()
        prepare()
        self._model = MotionModel.from_options(self.options)
        self.reset()

    def reset(self) -> None:
        """Forget everything, the numbers of names too."""
        self._naming = Naming(self.options)
        self._clear()

    def restart(self) -> None:
        """Forget all tracks and the time, as after a gap of unknown length; names are not used again.

        Call it when a frame's `segment` grows. The next sightings may have any time.
        """
        self._clear()

    def _clear(self) -> None:
        self._t: float | None = None
        self._roster = Roster()
        self._beliefs = self._model.begin(np.empty((0, 2)), np.empty((0, 2, 2)))
        self._looks = Looks.begin(Sightings.none(0.0))
        self._questions: list[Question] = []
        self._encounters = Encounters(self.options)
        self._revisions: tuple[Revision, ...] = ()
        self._doubt: FloatArray = np.empty(0)
        self._joined: tuple[tuple[int, int], ...] = ()
        self._host: IntArray = np.empty(0, dtype=np.intp)
        self._partner: IntArray = np.empty(0, dtype=np.intp)

    def affirm(self, name: str) -> None:
        """Take a track for the thing that its name says, as somebody has looked.

        Parameters
        ----------
        name : str
            Of the track, whose `swap_probability` becomes zero until there is new doubt.

        Raises
        ------
        InputError
            If there is no track of that name.
        """
        if name not in self._roster.names:
            raise InputError(f"there is no track {name}: expected one of {self._roster.names}")
        row = self._roster.names.index(name)
        serial = int(self._roster.serial[row])
        self._questions = [q for q in self._questions if serial not in q.serials]
        self._roster.swap = self._roster.swap.copy()
        self._roster.swap[row] = self._doubt[row] = 0.0

    @property
    def t(self) -> float | None:
        """Time of the last sightings [s]; None before the first."""
        return self._t

    def update(self, sightings: Sightings) -> TrackerState:
        """Take in what was seen in a frame, even if it is nothing.

        Parameters
        ----------
        sightings : Sightings
            Of the next frame.

        Returns
        -------
        state : TrackerState
            All tracks at the time of the frame.

        Raises
        ------
        InputError
            If the time is not after the last one.
        """
        if self._t is not None and not sightings.t > self._t:
            raise InputError(
                f"sightings at {sightings.t:.6g} s do not follow those at {self._t:.6g} s; "
                "feed frames in order, and call restart() when the camera's clock begins anew"
            )
        dt = 0.0 if self._t is None else sightings.t - self._t
        self._t = sightings.t
        roster, options = self._roster, self.options
        self._looks = self._looks.predict(dt)
        self._beliefs, visible, self._questions = carry_on(
            self._beliefs, roster.visible, self._questions, dt, model=self._model, options=options
        )
        chance = visible * options.detection
        middle, spread = self._beliefs.combined(2)
        pairs = find_pairs(
            self._beliefs,
            self._looks,
            tuple(roster.labels),
            chance=chance,
            sightings=sightings,
            options=options,
            combined=(middle, spread),
        )
        # A candidate may be nothing at all, and then cannot own a sighting.
        doubt = np.where(roster.confirmed, 0.0, -np.log1p(np.exp(-np.clip(roster.score, -50, 50))))
        gain = pairs.gain + doubt[pairs.tracks]
        partner = assign(pairs.tracks, pairs.sightings, gain, (len(roster), len(sightings)))

        fresh = roster.confirmed & (sightings.t - roster.touched < RECENT_S / 2 + dt)
        free = np.ones(len(sightings), dtype=np.bool_)
        free[partner[roster.confirmed & (partner >= 0)]] = False
        partner, host = share(
            middle,
            spread,
            np.exp(self._looks.size[:, 0]),
            fresh,
            partner=partner,
            free=free,
            sightings=sightings,
            options=options,
        )
        verdicts, doubt_now = ask(
            self._questions,
            pairs,
            partner,
            host,
            roster=roster,
            beliefs=self._beliefs,
            looks=self._looks,
            visible=visible,
            fresh=fresh,
            sightings=sightings,
            model=self._model,
            options=options,
            dt=dt,
        )
        self._hear(verdicts, doubt_now)
        for verdict in verdicts:
            partner[verdict.rows], host[verdict.rows] = verdict.own, verdict.host
        if not roster.confirmed.all():
            claimed = partner[roster.confirmed & (partner >= 0)]
            partner[~roster.confirmed & np.isin(partner, claimed)] = -1
        host[(host >= 0) & (partner[host] < 0)] = -1
        won = np.zeros(len(roster))
        own = partner[pairs.tracks] == pairs.sightings
        won[pairs.tracks[own]] = pairs.gain[own] + np.log1p(-chance[pairs.tracks[own]])
        won[partner < 0] = np.log1p(-chance[partner < 0])
        self._beliefs, self._looks = measure(
            self._beliefs,
            self._looks,
            sightings,
            partner=partner,
            host=host,
            asked=asked_about(self._questions, roster.serial),
            model=self._model,
            options=options,
            dt=dt,
        )
        for verdict in verdicts:
            self._beliefs = self._beliefs.put(verdict.rows, verdict.beliefs)
        missed = visible * (1 - options.detection) / (1 - chance)
        roster.visible = np.where(partner >= 0, 1.0, np.where(host >= 0, visible, missed))
        for verdict in verdicts:
            roster.visible[verdict.rows] = verdict.visible
        met = self._encounters.note(
            roster,
            partner,
            host,
            named=self._naming.named(roster, partner, sightings),
            t=sightings.t,
            dt=dt,
            sightings=sightings,
            middle=middle,
            spread=spread,
        )
        roster.swap = 1 - (1 - roster.swap) * (1 - met)
        roster.note(sightings.t, partner, host, won, float(np.exp(-dt / RECENT_S)))
        self._naming.read(roster, partner, sightings)
        used = np.zeros(len(sightings), dtype=np.bool_)
        used[partner[partner >= 0]] = True
        self._partner, self._host = partner, host
        self._confirm()
        self._end(sightings.t)
        self._begin(sightings, ~used)
        return self._state()

    def _hear(self, verdicts: list[Verdict], doubt: FloatArray) -> None:
        """Note what is still open, and what was decided; doubt of a question that was dropped stays."""
        self._questions = [v.question for v in verdicts if v.question is not None]
        self._revisions = tuple(revision for v in verdicts for revision in v.revisions)
        dropped = self._doubt.copy()
        for verdict in verdicts:
            dropped[verdict.rows] = 0.0
        self._doubt = np.zeros(len(self._roster))
        kept = 1 - (1 - self._roster.swap) * (1 - dropped)
        self._roster.swap = np.maximum(kept, doubt)  # the same doubt again is no more doubt
        for verdict in verdicts:
            if verdict.question is not None:
                self._doubt[verdict.rows] = verdict.doubt
            else:
                sure = (1 - self._roster.swap[verdict.rows]) * (1 - verdict.doubt)
                self._roster.swap[verdict.rows] = 1 - sure

    def _confirm(self) -> None:
        """Take candidates for things: for some that were lost, or for new ones."""
        roster = self._roster
        ready = self._naming.ready(roster)
        self._joined = ()
        if not ready.any():
            return
        lost, back, doubt = find_returned(self._beliefs, roster, ready, self.options)
        ready[back] = False
        self._naming.confirm(roster, np.flatnonzero(ready))
        self._joined = tuple(
            (int(roster.serial[c]), int(roster.serial[k])) for k, c in zip(lost, back, strict=True)
        )
        if len(back) == 0:
            return
        away = self._encounters.away(roster, self._t or 0.0, 0.0)
        middle, spread = self._beliefs.combined(2)
        px = self.options.merge_px / 4
        met = mistaken(middle[back], lost, away, middle=middle, spread=spread, px=px)
        self._beliefs = self._beliefs.put(lost, self._beliefs.take(back))
        found = {int(serial) for serial in roster.serial[lost]}
        self._questions = [q for q in self._questions if not found & set(q.serials)]
        roster.adopt(lost, back)
        met[lost] = 1 - (1 - met[lost]) * (1 - doubt)
        roster.swap = 1 - (1 - roster.swap) * (1 - met)
        self._partner[lost], self._host[lost] = self._partner[back], -1
        gone = np.zeros(len(roster), dtype=np.bool_)
        gone[back] = True
        self._drop(gone)

    def _end(self, t: float) -> None:
        """Forget tracks that are lost, and candidates that are nothing."""
        roster = self._roster
        nothing = ~roster.confirmed & (roster.score < self.options.first_score + GIVE_UP)
        self._drop(roster.lost(t, self.options) | nothing | self._naming.superseded(roster))

    def _drop(self, gone: BoolArray) -> None:
        if not gone.any():
            return
        rows = np.flatnonzero(~gone)
        number = np.full(len(gone) + 1, -1, dtype=np.intp)  # the last is for those without a host
        number[rows] = np.arange(len(rows))
        self._host = number[self._host[rows]]
        self._partner = self._partner[rows]
        self._doubt = self._doubt[rows]
        self._beliefs = self._beliefs.take(rows)
        self._looks = self._looks.take(rows)
        self._roster.keep(~gone)

    def _begin(self, sightings: Sightings, free: BoolArray) -> None:
        """Take sightings that belong to nobody for candidates."""
        rows = np.flatnonzero(free)
        if len(rows) == 0:
            return
        rows = rows[birth_order(sightings.uv[rows], sightings.uv.mean(axis=0))]
        fresh = sightings.take(rows)
        score = self.options.first_score + np.log(np.maximum(fresh.score, 0.01))
        self._roster.add(self._naming.serials(len(rows)), fresh.t, score, list(fresh.labels))
        self._beliefs = self._beliefs.join(self._model.begin(fresh.uv, fresh.covariance))
        self._looks = self._looks.join(Looks.begin(fresh))
        self._partner = np.concatenate([self._partner, rows])
        self._doubt = np.concatenate([self._doubt, np.zeros(len(rows))])
        self._host = np.concatenate([self._host, np.full(len(rows), -1, dtype=np.intp)])

    def predict(self, t: float) -> TrackerState:
        """Where the tracks will be if nothing is seen until then; the tracker itself does not change.

        Parameters
        ----------
        t : float [s]
            A time not before the last sightings'.

        Returns
        -------
        state : TrackerState
            The tracks then.

        Raises
        ------
        InputError
            If the time is before the last sightings', or not a number.
        """
        last = t if self._t is None else self._t
        if not (np.isfinite(t) and t >= last):
            raise InputError(f"cannot predict for {t} s: expected a time not before {last:.6g} s")
        return self._state(t)

    def _state(self, t: float | None = None) -> TrackerState:
        now = self._t or 0.0
        nowhere = np.full(len(self._roster), -1, dtype=np.intp)
        later = 0.0 if t is None else t - now
        return report(
            self._roster,
            self._model.predict(self._beliefs, later),
            self._looks.predict(later),
            t=now if t is None else t,
            sighting=self._partner if t is None else nowhere,
            host=self._host,
            doubt=self._doubt,
            revisions=self._revisions if t is None else (),
            joined=self._joined if t is None else (),
        )
