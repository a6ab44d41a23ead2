"""Whether a robot that is told to drive gets on: one that is blocked while told little disobeys in no other way."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.control.safety.types import Place

__all__ = ["Headway"]

TOLD_M = 0.25  # a robot that was told to go so far ...
MOVED_M = 0.05  # ... must have got so far
ARM_M = 0.3  # turning by a radian counts as so many metres


class Headway:
    """Compares how far one robot was told to go with how far it went."""

    def __init__(self) -> None:
        self._from: Place | None = None
        self._told = (0.0, 0.0, 0.0)

    def rest(self) -> None:
        """Begin anew: it is not told to drive."""
        self._from = None

    def stuck(self, place: Place | None, command: VelocityCommand, dt: float) -> bool:
        """Take a step, and say whether it does not get on.

        Parameters
        ----------
        place : Place or None
            Where it is; None where that is not known.
        command : VelocityCommand
            What it is told.
        dt : float [s]
            For how long.

        Returns
        -------
        stuck : bool
            Whether it was told to go, and has not gone.
        """
        if place is None:
            self._from = None
            return False
        began = self._from
        moved = 0.0
        if began is not None:
            moved = hypot(place.x - began.x, place.y - began.y)
            moved += ARM_M * abs(place.theta - began.theta)
        if began is None or not moved < MOVED_M:
            self._from, self._told = place, (0.0, 0.0, 0.0)
            return False
        ahead, aside, turn = self._told
        # To and fro on the spot is no way to go, so signs count.
        ahead += command.v * dt
        aside += command.lateral * dt
        turn += command.omega * dt
        self._told = ahead, aside, turn
        return hypot(ahead, aside) + ARM_M * abs(turn) > TOLD_M
