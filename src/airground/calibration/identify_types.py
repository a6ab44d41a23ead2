"""What identification answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from airground.errors import UndeterminedError

if TYPE_CHECKING:
    from airground.calibration.recordings import Tracks
    from airground.geometry.limited import LimitedHomography

__all__ = ["Identification", "RobotIdentity", "TrackSpan"]


@dataclass(frozen=True, slots=True)
class TrackSpan:
    """A stretch of a track that is one robot."""

    track: str
    """Name of the track."""

    first_s: float
    """Time of its first sighting [s]."""

    last_s: float
    """Time of its last sighting [s]."""

    sightings: int
    """How many there are."""


@dataclass(frozen=True, slots=True)
class RobotIdentity:
    """Which tracks are a robot, or why that cannot be told."""

    robot: str
    """Its name in the readings."""

    spans: tuple[TrackSpan, ...]
    """Stretches of tracks, in order of time; none where the robot was not identified."""

    confidence: float
    """Probability that the best answer is right, whether it was accepted or not."""

    margin: float
    """Log odds of the best answer to the next best, which may be that none of the tracks is the robot."""

    candidates: tuple[str, ...]
    """Tracks of the best answer, and then that which competes with it."""

    reason: str
    """Why the robot was not identified; empty where it was."""

    advice: str
    """What to do about it; empty where it was."""

    @property
    def identified(self) -> bool:
        """Whether there is an answer."""
        return bool(self.spans)


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """Which tracks are which robots."""

    robots: tuple[RobotIdentity, ...]
    """One for each robot of the readings."""

    tracks: Tracks
    """All tracks; identified stretches carry their robot's name, all others keep their own."""

    time_offset_s: float | None
    """To be added to times of the tracks to get times of the readings [s]; None where no robot was identified."""

    model: LimitedHomography | None
    """A first g, in the frame of the first identified robot; `calibrate` gives a better one."""

    def of(self, robot: str) -> RobotIdentity:
        """What was found of one robot.

        Parameters
        ----------
        robot : str
            Its name.

        Returns
        -------
        identity : RobotIdentity
            Raises KeyError for a name that is not in the readings.
        """
        for identity in self.robots:
            if identity.robot == robot:
                return identity
        raise KeyError(robot)

    def require(self) -> Identification:
        """Insist on an answer.

        Returns
        -------
        identification : Identification
            Itself, if at least one robot was identified.

        Raises
        ------
        UndeterminedError
            If no robot was; the message says why and what to do.
        """
        if any(identity.identified for identity in self.robots):
            return self
        first = self.robots[0]
        others = len(self.robots) - 1
        more = "" if not others else f" (and {others} more robot{'s' if others > 1 else ''})"
        raise UndeterminedError(
            f"no robot was identified: {first.robot}{more}: {first.reason}; {first.advice}"
        )
