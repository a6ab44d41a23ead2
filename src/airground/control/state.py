"""What is believed about a robot at one time."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, numbers

__all__ = ["RobotState"]


@dataclass(frozen=True, slots=True, eq=False)
class RobotState:
    """Where a robot's axle is in the image, and how it moves on the ground.

    A filter's answer, at the time when a command given now takes effect. It may hold NaN: a controller then has no
    answer, and the safety layer stops the robot.
    """

    t: float
    """Time that it is about [s]."""

    uv: FloatArray
    """(2,) [px]. Image of the axle's middle, in the pixels of the model (undistorted)."""

    theta: float
    """Heading in the calibration's ground frame [rad]; may wrap."""

    v: float = 0.0
    """Speed along the heading [m/s]."""

    omega: float = 0.0
    """Rate of the heading [rad/s]."""

    lateral: float = 0.0
    """Speed along the heading plus 90 degrees [m/s]."""

    covariance: FloatArray | None = None
    """(5, 5). Of ground x, y [m], theta, v, omega; None where nothing is known of it."""

    seen_t: float = -inf
    """Time of the newest sighting in it [s]."""

    def __post_init__(self) -> None:
        uv = np.array(numbers(self.uv, "uv"))
        if uv.shape != (2,):
            raise InputError(f"uv must have shape (2,), not {uv.shape}")
        uv.flags.writeable = False
        object.__setattr__(self, "uv", uv)
        if self.covariance is not None:
            covariance = np.array(numbers(self.covariance, "covariance"))
            if covariance.shape != (5, 5):
                raise InputError(f"covariance must have shape (5, 5), not {covariance.shape}")
            covariance.flags.writeable = False
            object.__setattr__(self, "covariance", covariance)
