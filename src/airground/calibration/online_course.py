"""From the first sighting to a running estimator, and on, also after the camera was moved."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from airground.calibration.online_answer import uncertainty
from airground.calibration.online_begin import begin, begin_again
from airground.calibration.online_recent import Recent
from airground.calibration.online_state import OnlineEvent

if TYPE_CHECKING:
    from airground.calibration.bump import Bump
    from airground.calibration.online_intake import Intake, Seen
    from airground.calibration.online_path import PathPoint
    from airground.calibration.online_state import OnlineOptions
    from airground.calibration.online_tracker import Tracker

__all__ = ["Course"]

FIRST_TRY = 40  # sightings before a start is looked for
TRY_AGAIN = 1.25  # times as many before the next look
TRY_AT_LEAST_S = 0.5
SETTLED = 0.02  # relative deviation beyond which linearising anew changes nothing
SETTLE_AGAIN = 1.5  # times as many sightings before linearising anew
ACCEPTED = 0.3  # relative deviation of a first g: a weak one, to be known as such
RECENT_S = 20.0  # kept while running, to start from if the camera is moved


class Course:
    """Looks for a first g, follows it, and begins anew where it must.

    Parameters
    ----------
    intake : Intake
        That has the readings.
    options : OnlineOptions
        Noise and priors.
    """

    def __init__(self, intake: Intake, options: OnlineOptions) -> None:
        self._intake, self._options = intake, options
        self._recent = Recent()
        self.tracker: Tracker | None = None
        self.events: list[OnlineEvent] = []
        self.since = math.nan
        self._next_try = float(FIRST_TRY)
        self._next_time = -math.inf
        self._arrived = 0
        self._settled = False
        self._trimmed = -math.inf

    @property
    def relative_sigma(self) -> float:
        """Relative standard deviation of a ground velocity, where robots were seen; infinite while there is no g."""
        return math.inf if self.tracker is None else uncertainty(self.tracker)

    def take(self, group: list[tuple[Seen, PathPoint]]) -> None:
        """Take sightings of different robots.

        Parameters
        ----------
        group : list of (Seen, PathPoint)
            Sightings and what the readings say.
        """
        for seen, _ in group:
            self._recent.add(seen)
        if math.isnan(self.since):
            self.since = group[0][0].t
        self._arrived += len(group)
        tracker = self.tracker
        t = group[-1][0].t
        if tracker is None:
            self._try(t)
            return
        bump = tracker.take(group)
        if bump is not None:
            self._restart(bump)
        elif tracker.doubt is not None:
            self._doubt(tracker, t)
        elif not self._settled and self._arrived >= self._next_try:
            self._settle()
        elif self._settled and t > self._trimmed + RECENT_S:
            self._trimmed = t
            self._recent.keep_after(t - RECENT_S)

    def _try(self, t: float) -> None:
        """Look for a first g, at a cost that stays a share of all time."""
        if self._arrived < self._next_try or t < self._next_time:
            return
        self._next_try, self._next_time = self._arrived * TRY_AGAIN, t + TRY_AT_LEAST_S
        tracker = begin(self._recent, self._intake, self._options)
        if tracker is None:
            return
        self.tracker = tracker
        if not self.relative_sigma <= ACCEPTED:
            self.tracker = None
            return
        self.since = t
        self._settled = False
        self._next_try = self._arrived * SETTLE_AGAIN
        self.events.append(
            OnlineEvent("started", t, t, f"relative deviation {self.relative_sigma:.2g}")
        )

    def _settle(self) -> None:
        """Linearise all data anew at the better estimate, until it is good."""
        assert self.tracker is not None
        self._next_try = self._arrived * SETTLE_AGAIN
        again = begin_again(self.tracker, self._recent, self._intake)
        if again is not None:
            self.tracker = again
        self._settled = uncertainty(self.tracker, scale=False) < SETTLED

    def _doubt(self, tracker: Tracker, t: float) -> None:
        """A robot alone jumped: go on with less faith in what is known, and linearise anew as more comes."""
        assert tracker.doubt is not None
        self.events.append(
            OnlineEvent("doubted", tracker.doubt, t, "the only robot in sight jumped")
        )
        self._recent.keep_after(tracker.doubt)
        tracker.doubt = None
        self._settled = False
        self._arrived = len(self._recent)
        self._next_try = max(self._arrived * SETTLE_AGAIN, float(FIRST_TRY))

    def _restart(self, bump: Bump) -> None:
        """Forget all that is from before the camera was moved."""
        self.events.append(
            OnlineEvent("bumped", bump.t_s, bump.noticed_s, f"seen by {bump.reason}")
        )
        self.tracker = None
        self._settled = False
        self.since = bump.noticed_s
        self._recent.keep_after(bump.t_s)
        self._arrived = len(self._recent)
        self._next_try = max(float(FIRST_TRY), self._arrived * TRY_AGAIN)
        self._next_time = -math.inf
