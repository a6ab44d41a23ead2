"""A vehicle of the MuJoCo world: motors, senses, and the truth about it."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.sim3d.motors import Motors
from airground.sim3d.senses import Senses
from airground.sim3d.truth import TruthLog

if TYPE_CHECKING:
    from airground.robots.protocol import RobotReading
    from airground.sim3d.options import Other3d, Robot3d

__all__ = ["TRUTH_HZ", "Vehicle3d"]

TRUTH_HZ = 100.0
"""How often the truth is noted."""

MOST_READINGS = 500  # that nobody asks for


class Vehicle3d:
    """One of ours or of others.

    Parameters
    ----------
    one : Robot3d or Other3d
        What it is.
    rng : Generator
        Of its wheels and of all its noise.
    """

    def __init__(self, one: Robot3d | Other3d, rng: np.random.Generator) -> None:
        built = one.options
        self.name = one.name
        left, right, track = (1 + built.wheel_share * rng.standard_normal(3)).tolist()
        told = built.wheel_radius_m * left, built.wheel_radius_m * right
        self.motors = Motors(one.name, built, told, built.track_m * track)
        """What it is told goes here."""
        self.log = TruthLog(TRUTH_HZ)
        """Where it was."""
        self._senses = Senses(one.name, built, told, built.track_m * track, rng)
        self._heard: deque[RobotReading] = deque(maxlen=MOST_READINGS)

    def note(self, data: Any, t: float) -> None:
        """Note the truth.

        Parameters
        ----------
        data : MjData
            Of now.
        t : float [s]
            Now.
        """
        body = data.body(self.name)
        tag = np.array(data.site(f"{self.name}_tag").xpos[:2])
        theta = float(np.arctan2(body.xmat[3], body.xmat[0]))
        self.log.note(t, tag, np.array(body.xpos[:2]), theta)

    def measure(self, data: Any, t: float) -> None:
        """Let it take a reading, which arrives later.

        Parameters
        ----------
        data : MjData
            Of now.
        t : float [s]
            Now.
        """
        reading = self._senses.read(data, t)
        if reading is not None:
            self._heard.append(reading)

    def readings(self, t: float) -> list[RobotReading]:
        """Give what has arrived, once.

        Parameters
        ----------
        t : float [s]
            Now.

        Returns
        -------
        readings : list of RobotReading
            In order.
        """
        found = []
        while self._heard and self._heard[0].t <= t + 1e-9:
            found.append(self._heard.popleft())
        return found
