"""Driven by hand: what a person holds the stick at is the wish, for a fraction of a second."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np

from airground.control.command import VelocityCommand
from airground.control.controller import Guidance
from airground.control.state import RobotState

__all__ = ["HOLD_S", "HandDriven"]

HOLD_S = 0.4
"""How long the stick's position holds [s]; a page that repeats it ten times a second may lose three."""


@dataclass(frozen=True, slots=True, eq=False)
class HandDriven:
    """A controller that does what a person says; the safety layer stands behind it as behind all others."""

    command: VelocityCommand
    """The stick's."""

    def step(self, state: RobotState, progress: float, dt: float) -> Guidance:
        """Say what the person says.

        Parameters
        ----------
        state : RobotState
            Of the robot; only whether it is known counts, for the safety layer.
        progress : float
            Not used.
        dt : float [s]
            Not used.

        Returns
        -------
        guidance : Guidance
            Never done.
        """
        del dt
        wanted = np.array(state.uv)
        return Guidance(self.command, progress, False, nan, nan, wanted)
