"""What the recursive estimator is told, and what it says about itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.calibration.calibrate import SPEED_SCALE_SIGMA
from airground.errors import InputError

if TYPE_CHECKING:
    from airground.geometry.lens import DivisionLens

__all__ = ["Counts", "OnlineEvent", "OnlineOptions", "OnlineState"]


@dataclass(frozen=True, slots=True)
class OnlineOptions:
    """Noise of what comes in, unknowns beside g, and memory. Deviations of 0 mean that a thing is known."""

    sigma_px: float = 1.0
    """Standard deviation of each coordinate of a sighting that does not state its own [px]."""

    speed_noise: float = 0.01
    """Relative noise density of the speeds [sqrt(s)]: 0.01 loses 1 % of the way in one second."""

    heading_noise: float = 0.01
    """Noise density of the headings [rad sqrt(s)]."""

    slip_floor: float = 1e-4
    """Random walk of the position that does not depend on the speed [m/sqrt(s)]."""

    heading_bias_sigma_rad: float = 0.0
    """Prior deviation of each robot's heading zero from the first robot's [rad]; only small ones, up to about 0.3."""

    heading_drift_rad_per_sqrt_s: float = 0.0
    """Random walk of each robot's headings [rad/sqrt(s)]."""

    time_offset_s: float = 0.0
    """To be added to a sighting's time to get the time of the readings [s]."""

    time_offset_sigma_s: float = 0.0
    """Its prior deviation [s]; the offset is estimated if this is positive."""

    speed_scale_sigma: float = SPEED_SCALE_SIGMA
    """Relative deviation of the speeds' scale: no data tell it, so it widens the stated covariance of g."""

    memory_s: float | None = None
    """Driving time after which old data count only 1/e [s]; None to keep all."""

    wait_s: float = 0.0
    """How long sightings that may come out of order are waited for [s]."""

    lens: DivisionLens | None = None
    """Of the camera, if it is known and distorts."""

    image_size_px: tuple[int, int] | None = None
    """Width and height of the image [px], to be kept with the calibration."""

    def __post_init__(self) -> None:
        for name in ("sigma_px", "memory_s"):
            value = getattr(self, name)
            if value is not None and not 0 < value < np.inf:
                raise InputError(f"{name} must be positive, not {value}")
        for name in (
            "speed_noise",
            "heading_noise",
            "slip_floor",
            "heading_bias_sigma_rad",
            "heading_drift_rad_per_sqrt_s",
            "time_offset_sigma_s",
            "speed_scale_sigma",
            "wait_s",
        ):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"{name} must not be negative, not {getattr(self, name)}")
        if not self.speed_noise + self.heading_noise + self.slip_floor > 0:
            raise InputError("speed_noise, heading_noise and slip_floor must not all be 0")
        if not np.isfinite(self.time_offset_s):
            raise InputError(f"time_offset_s must be finite, not {self.time_offset_s}")


@dataclass(frozen=True, slots=True)
class OnlineEvent:
    """Something that happened, once."""

    kind: Literal["started", "doubted", "bumped"]
    """A first g was found; the only robot in sight jumped, so it was lifted or the camera moved; the camera has moved,
    and all that was known is void."""

    t_s: float
    """When [s]: of a bump, when it happened as far as can be told."""

    noticed_s: float
    """Time of the data on which it was noticed [s]."""

    detail: str
    """One clause."""


@dataclass(frozen=True, slots=True)
class Counts:
    """What became of the sightings and readings."""

    sightings: int = 0
    """Taken in."""

    used: int = 0
    """That counted for the estimate, since the last start."""

    refused: int = 0
    """That did not fit, since the last start."""

    late: int = 0
    """That came after newer ones of the same robot had been used."""

    duplicates: int = 0
    """At a time that the robot was already seen at."""

    unread: int = 0
    """Of robots without readings at that time, or of none."""

    late_readings: int = 0
    """Readings not newer than the robot's newest."""


@dataclass(frozen=True, slots=True)
class OnlineState:
    """Where the estimator stands."""

    phase: Literal["starting", "running", "bumped"]
    """Looking for a first g; following; or looking for a new one, as the camera was moved."""

    since_s: float
    """Time at which this phase began [s]; NaN before any data."""

    relative_sigma: float
    """Relative standard deviation of a ground velocity where robots were seen; infinite while there is no g."""

    counts: Counts
    """What became of the data."""
