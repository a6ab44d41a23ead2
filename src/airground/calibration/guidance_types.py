"""A leg to drive, and what decides about it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from airground.calibration.calibrate import SPEED_SCALE_SIGMA
from airground.errors import InputError

__all__ = ["Leg", "LegOptions"]


@dataclass(frozen=True, slots=True)
class LegOptions:
    """How the robot drives and is seen, and which legs to consider."""

    sigma_px: float = 1.0
    """Standard deviation of each coordinate of a sighting [px]."""

    speed_mps: float = 0.3
    """Of the robot [m/s]."""

    sightings_hz: float = 30.0
    """How often it is seen [1/s]."""

    odometry_noise: float = 0.01
    """Relative noise density of its velocity readings [sqrt(s)]."""

    shortest_m: float = 0.3
    """Shortest leg [m]."""

    longest_m: float | None = None
    """Longest leg [m]; None for as long as the image allows."""

    turn_cost_m: float = 0.1
    """What a turn between two legs costs, in metres of driving."""

    scripted_m: float = 0.6
    """Length of a leg while nothing is known [m]."""

    headings: int = 36
    """How many headings to consider, over the whole turn."""

    lengths: int = 8
    """How many lengths to consider on each."""

    criterion: Literal["mean", "max"] = "mean"
    """What to shrink: the mean of the relative variance of a ground velocity over the image, or its largest."""

    speed_scale_sigma: float = SPEED_SCALE_SIGMA
    """Prior on the speeds' scale that the calibration was made with: no leg can tell it."""

    def __post_init__(self) -> None:
        for name in (
            "sigma_px",
            "speed_mps",
            "sightings_hz",
            "odometry_noise",
            "shortest_m",
            "scripted_m",
        ):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"{name} must be positive, not {getattr(self, name)}")
        if self.longest_m is not None and not self.longest_m >= self.shortest_m:
            raise InputError("longest_m must not be less than shortest_m")
        if not self.turn_cost_m >= 0 or not 0 <= self.speed_scale_sigma <= 1:
            raise InputError("turn_cost_m must not be negative, speed_scale_sigma in 0..1")
        if self.headings < 3 or self.lengths < 1:
            raise InputError("headings must be 3 or more, lengths 1 or more")
        if self.criterion not in ("mean", "max"):
            raise InputError(f"criterion must be mean or max, not {self.criterion!r}")


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A straight leg to drive."""

    heading_rad: float
    """On the ground, counter-clockwise from x [rad]."""

    length_m: float
    """How far [m]."""

    start_px: tuple[float, float]
    """Where the robot is in the image."""

    end_px: tuple[float, float] | None
    """Where it will be; None while no calibration can tell."""

    relative_sigma: float
    """Of a ground velocity, over the image, as it is now; infinite while nothing is known."""

    expected_sigma: float
    """The same after the leg."""

    @property
    def step_m(self) -> tuple[float, float]:
        """Displacement on the ground [m]."""
        return (
            self.length_m * math.cos(self.heading_rad),
            self.length_m * math.sin(self.heading_rad),
        )
