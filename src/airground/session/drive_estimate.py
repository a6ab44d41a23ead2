"""What a calibration drive has found out by now: the online estimate, and that of the whole drive now and then."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Any

from airground.errors import AirgroundError
from airground.session.drive_data import DriveData
from airground.session.image_sigma import image_sigma
from airground.session.live_estimate import ROUGH, LegQuestion, LiveAnswer, LiveEstimate

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.calibration import Calibration
    from airground.session.session import Session

__all__ = ["DriveEstimate"]

ASK_S = 0.25  # between two batches
PROMISING, MORE = 1.5, 1.3
"""The whole drive is solved once the online estimate is within so many times the wanted deviation, and again after so
many times the sightings."""


class DriveEstimate:
    """Collects data, has them worked on outside the loop, and keeps what came of it.

    Parameters
    ----------
    session : Session
        Whose drive it is.
    size_px : (int, int) [px]
        Of the image.
    answered : callable
        Told of each answer of the online estimate, in the loop.
    """

    def __init__(
        self, session: Session, size_px: tuple[int, int], answered: Callable[[LiveAnswer], None]
    ) -> None:
        options = session.options
        rate = session.camera.view(session.t, 0.0).rate_hz
        self.data = DriveData()
        self.answer: LiveAnswer | None = None
        """Of the online estimate."""
        self.whole: Calibration | None = None
        """Of the whole drive, when that was last asked for."""
        self.solving = False
        """Whether the final calibration is being made."""
        self.trouble = ""
        """Why there is none, in one line."""
        self._session, self._size_px = session, size_px
        self._online = LiveEstimate(size_px, rate, options.border_px)
        self._answered = answered
        self._asked_t = -1e9
        self._solved_sightings = 0
        self._whole_sigma = inf

    @property
    def good(self) -> bool:
        """Whether it is good enough, by the whole drive: that finds out how noisy readings are; the other is told."""
        return self.whole is not None and self._whole_sigma <= self._session.options.wanted_sigma

    @property
    def sigma(self) -> float:
        """Relative deviation of ground velocities over the image; infinite while nothing is known."""
        if self.whole is not None:
            return self._whole_sigma
        return inf if self.answer is None else self.answer.relative_sigma

    @property
    def known(self) -> bool:
        """Whether there is an estimate that legs can be planned with."""
        return self.answer is not None and self.answer.relative_sigma < ROUGH

    def bias(self, robot: str) -> float:
        """Tell what a robot's compass reads more than the heading on the ground [rad], as far as it is known.

        Parameters
        ----------
        robot : str
            Which.

        Returns
        -------
        bias : float [rad]
            0 where nothing is known.
        """
        if self.answer is None or self.answer.calibration is None:
            return 0.0
        target = self.answer.calibration.targets.get(robot)
        return 0.0 if target is None else target.heading_bias_rad or 0.0

    def ask(self, t: float, question: Callable[[], LegQuestion | None]) -> None:
        """Have the online estimate take what came in, if it is time to.

        Parameters
        ----------
        t : float [s]
            Now.
        question : callable
            Gives what is wanted to be known, if anything.
        """
        desk = self._session.desk
        if t - self._asked_t < ASK_S or desk.waits_for("estimate"):
            return
        if not self.data.news or self.solving:
            return
        self._asked_t = t
        batch, online, wanted = self.data.batch(), self._online, question()
        desk.give("estimate", lambda: online.advance(batch, wanted), self._take)

    def finish(self, then: Callable[[Calibration | AirgroundError], None]) -> None:
        """Make the calibration of all that was driven.

        Parameters
        ----------
        then : callable
            Is given it, or why there is none, in the loop.
        """
        if self.solving:
            return
        if self.good and self.whole is not None:
            then(self.whole)
            return
        self.solving = True
        self._session.desk.cancel("check")

        def solved(result: Any) -> None:
            self.solving = False
            if isinstance(result, AirgroundError):
                self.trouble = str(result)
            then(result)

        self._session.desk.give("calibration", self._solution(), solved, heavy=True)

    def _take(self, answer: Any) -> None:
        if isinstance(answer, AirgroundError):
            self._session.say(f"calibration drive: {answer}", "error")
            return
        self.answer = answer
        self.trouble = answer.leg_trouble
        self._solve_now_and_then(answer)
        self._answered(answer)

    def _solve_now_and_then(self, answer: LiveAnswer) -> None:
        desk = self._session.desk
        promising = answer.relative_sigma <= PROMISING * self._session.options.wanted_sigma
        due = answer.sightings >= MORE * self._solved_sightings and promising
        if not due or self.solving or desk.waits_for("check"):
            return
        self._solved_sightings = answer.sightings

        def then(result: Any) -> None:
            if isinstance(result, AirgroundError):
                return  # too little yet; what is missing will be driven
            was_good, self.whole = self.good, result
            self._whole_sigma = self._over_image(result)
            if self.good and not was_good:
                self._session.say(f"calibration drive: good enough, {self.sigma:.1%}")

        desk.give("check", self._solution(), then, heavy=True)

    def _over_image(self, calibration: Calibration) -> float:
        return image_sigma(calibration, self._size_px, self._session.options.border_px)

    def _solution(self) -> Callable[[], Calibration]:
        options = self._session.options
        said = f"live session of {options.name}"
        return self.data.solution(self._size_px, options.distortion, said)
