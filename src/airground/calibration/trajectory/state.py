"""What is unknown in a whole drive, what of it is estimated, and how noisy the measurements are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.geometry.arrays import FloatArray

__all__ = ["Free", "Layout", "Noise", "Priors", "Robot", "State"]


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of everything that is measured or drifts."""

    pixel: float = 1.0
    """Of a sighting whose spread is 1 [px]."""

    along: float = 0.02
    """Of the speed, relative, white: per square root of the time [sqrt(s)]."""

    across: float = 0.02
    """Of the heading, white: per square root of the time [rad sqrt(s)]."""

    slip: float = 0.0
    """Of the speed's scale where it wanders; 0 for a scale that stays."""

    slip_s: float = 3.0
    """How long the scale remembers [s]."""

    drift: float = 0.0
    """Of the heading where it wanders [rad]; 0 for a heading that does not."""

    drift_s: float = 3.0
    """How long the heading remembers [s]."""


@dataclass(frozen=True, slots=True)
class Priors:
    """Standard deviations of what is known beforehand."""

    offset_s: float = 0.5
    """Of the clocks' offset about the one that the search found [s]."""

    scale: float = 0.02
    """Of a robot's speed scale, relative."""

    bend: float = 0.1
    """Of the lens's k1, in normalised units: how much it moves a point at the usual distance from the middle."""

    lever_s: float = 0.5
    """Of the tracked point's place, as the time that the robot needs to cover it [s]."""


@dataclass(frozen=True, slots=True)
class Free:
    """What is estimated beside g and the positions."""

    offset: bool = True
    """The clocks' offset."""

    lens: bool = False
    """k1 of the division model."""

    turn: tuple[int, ...] = ()
    """Robots whose headings count from a zero of their own."""

    lever: tuple[int, ...] = ()
    """Robots whose tracked point is not where the odometry's is."""

    slip: bool = False
    """Whether speed scales wander."""

    drift: bool = False
    """Whether headings wander."""

    @property
    def width(self) -> int:
        """Numbers that are unknown at each sighting."""
        return 2 + int(self.drift) + int(self.slip)


@dataclass(frozen=True, slots=True, eq=False)
class Robot:
    """What is unknown about one robot."""

    xy: FloatArray
    """(N, 2) [m]. Where it was at its sightings."""

    drift: FloatArray
    """(N,) [rad]. By how much its heading reads too little there, beside `turn`."""

    slip: FloatArray
    """(N,). Logarithm of the way it went over the way it read there, beside `scale`."""

    turn: float = 0.0
    """What to add to its headings [rad]."""

    scale: float = 0.0
    """Logarithm of the way it went over the way it read."""

    lever: tuple[float, float] = (0.0, 0.0)
    """Where the tracked point is, forward and left of the odometry's [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """One value for everything that is unknown."""

    g: FloatArray
    """(3, 2). In normalised pixels, with unit determinant."""

    offset: float
    """To be added to times of the tracks [s]."""

    robots: tuple[Robot, ...]
    """One for each chain."""

    bend: float = 0.0
    """k1 of the lens in normalised units."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each global unknown stands in the vector of all of them."""

    free: Free
    """What is estimated."""

    robots: int
    """How many robots there are."""

    @property
    def shared(self) -> int:
        """How many unknowns all robots share: g, then the offset, then the lens."""
        return 6 + int(self.free.offset) + int(self.free.lens)

    @property
    def offset(self) -> int | None:
        """Place of the clocks' offset."""
        return 6 if self.free.offset else None

    @property
    def bend(self) -> int | None:
        """Place of the lens's k1."""
        return 6 + int(self.free.offset) if self.free.lens else None

    def own_size(self, robot: int) -> int:
        """How many unknowns a robot has of its own.

        Parameters
        ----------
        robot : int
            Which.

        Returns
        -------
        size : int
            Its scale, then its turn, then its lever's two.
        """
        return 1 + int(robot in self.free.turn) + 2 * int(robot in self.free.lever)

    def own(self, robot: int) -> int:
        """Place of a robot's first own unknown, its speed scale.

        Parameters
        ----------
        robot : int
            Which.

        Returns
        -------
        place : int
            In the vector.
        """
        return self.shared + sum(self.own_size(k) for k in range(robot))

    def turn(self, robot: int) -> int | None:
        """Place of a robot's turn.

        Parameters
        ----------
        robot : int
            Which.

        Returns
        -------
        place : int or None
            None where it is not estimated.
        """
        return self.own(robot) + 1 if robot in self.free.turn else None

    def lever(self, robot: int) -> int | None:
        """Place of a robot's lever.

        Parameters
        ----------
        robot : int
            Which.

        Returns
        -------
        place : int or None
            Of its first number; None where it is not estimated.
        """
        if robot not in self.free.lever:
            return None
        return self.own(robot) + 1 + int(robot in self.free.turn)

    @property
    def size(self) -> int:
        """How many global unknowns there are."""
        return self.own(self.robots)

    def columns(self, robot: int) -> np.ndarray[tuple[int, ...], np.dtype[np.intp]]:
        """Places of all unknowns that a robot's measurements depend on.

        Parameters
        ----------
        robot : int
            Which.

        Returns
        -------
        columns : (B,) array of int
            The shared ones, then its own.
        """
        start = self.own(robot)
        return np.concatenate(
            [np.arange(self.shared), np.arange(start, start + self.own_size(robot))]
        ).astype(np.intp)
