"""Robots whose sightings do not fit: outliers, or a robot that goes on elsewhere.

Wrong sightings are scattered. A robot that was lifted, mistaken for another or seen by a camera that was knocked goes
on consistently with its readings, from where it is now. So each refused sighting predicts the next one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

__all__ = ["Strays"]

NEEDED = 4  # refused sightings in a row that fit each other
SLACK = 5.0  # sigma, between two sightings
SHARE = 0.3  # of the way between them: the camera may have turned
LONGEST = 25  # refused sightings in a row that do not fit each other either


class _Stray(NamedTuple):
    """A robot's last refused sighting."""

    t: float
    """[s]. Of the first that fits."""

    u: float
    """[px]."""

    v: float
    """[px]."""

    pu: float
    """[px]. Where the filter expected it."""

    pv: float
    """[px]."""

    fitting: int
    """How many fit each other."""

    refused: int
    """How many were refused in a row."""


class Strays:
    """Chains of refused sightings, robot by robot."""

    def __init__(self) -> None:
        self._chains: dict[int, _Stray] = {}

    def __len__(self) -> int:
        return len(self._chains)

    def fits(self, robot: int) -> None:
        """Note that a sighting was taken: what was refused before was wrong.

        Parameters
        ----------
        robot : int
            Whose.
        """
        self._chains.pop(robot, None)

    def refused(
        self,
        robot: int,
        t: float,
        uv: tuple[float, float],
        expected: tuple[float, float],
        sigma: float,
    ) -> tuple[bool, float | None]:
        """Take a refused sighting.

        Parameters
        ----------
        robot : int
            Whose.
        t : float [s]
            When.
        uv : (float, float) [px]
            Where it was seen.
        expected : (float, float) [px]
            Where the filter expected it.
        sigma : float [px]
            Of each coordinate.

        Returns
        -------
        lost : bool
            Whether the robot is not where it was believed to be.
        since : float or None [s]
            From when on it is consistently elsewhere; None if it is nowhere in particular.
        """
        old = self._chains.get(robot)
        fitting, first, refused = 1, t, 1
        if old is not None:
            refused = old.refused + 1
            way = (expected[0] - old.pu, expected[1] - old.pv)
            off = np.hypot(uv[0] - old.u - way[0], uv[1] - old.v - way[1])
            if off < SLACK * np.sqrt(2.0) * sigma + SHARE * np.hypot(*way):
                fitting, first = old.fitting + 1, old.t
        if fitting >= NEEDED or refused >= LONGEST:
            self._chains.pop(robot, None)
            return True, first if fitting >= NEEDED else None
        self._chains[robot] = _Stray(first, *uv, *expected, fitting, refused)
        return False, None
