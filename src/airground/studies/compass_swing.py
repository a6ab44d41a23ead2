"""A compass swung: iron on a robot turns its heading to and fro once per turn; turning on the spot shows by how much.

With the heading h read and the angle a turned by the wheels since the start::

    h - a = h0 + k a + c cos h + s sin h

k is what the wheels' track is taken too wide or too narrow, and what they slip.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, remainder, sin, tau

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray

__all__ = ["CompassSwing", "swing_compass"]

LEAST_RAD = 4.0  # of turning


@dataclass(frozen=True, slots=True)
class CompassSwing:
    """By how much a compass reads too much."""

    cosine: float
    """Times the cosine of the heading read [rad]."""

    sine: float
    """Times its sine [rad]."""

    def corrected(self, heading: float) -> float:
        """Take the swing out of a heading.

        Parameters
        ----------
        heading : float [rad]
            As read.

        Returns
        -------
        heading : float [rad]
            Within -pi..pi; what is wrong by the same everywhere stays.
        """
        return remainder(heading - self.cosine * cos(heading) - self.sine * sin(heading), tau)


def swing_compass(t: FloatArray, heading: FloatArray, turn_rate: FloatArray) -> CompassSwing:
    """Learn a compass's swing from a turn on the spot.

    Parameters
    ----------
    t : (N,) array [s]
        Times of the readings.
    heading : (N,) array [rad]
        As the compass read.
    turn_rate : (N,) array [rad/s]
        As the wheels turned, each since the reading before.

    Returns
    -------
    swing : CompassSwing
        By least squares.

    Raises
    ------
    InputError
        If less than two thirds of a turn was made.
    """
    turned = np.concatenate([[0.0], np.cumsum(turn_rate[1:] * np.diff(t))])
    if not np.ptp(turned) >= LEAST_RAD:
        raise InputError(f"a compass is swung by a turn of {LEAST_RAD} rad or more")
    off = np.unwrap(heading - turned)
    A = np.column_stack([np.ones(len(t)), turned, np.cos(heading), np.sin(heading)])
    found = np.linalg.lstsq(A, off, rcond=None)[0]
    return CompassSwing(float(found[2]), float(found[3]))
