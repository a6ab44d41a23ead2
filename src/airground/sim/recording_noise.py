"""Everything that can be wrong with a recording, each with a size; all of it off by default."""

from __future__ import annotations

from dataclasses import dataclass

from airground.errors import InputError

__all__ = ["RecordingNoise"]

Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class RecordingNoise:
    """How badly things are measured, and how often; a constant given as a tuple holds one entry for each robot.

    Readings are of the axle: ``speed = (1 + slip + white) scale true + white``, ``heading = true + bias + drift +
    white``. A sighting is of the tracked point, through the lens, with white noise.
    """

    tracks_hz: float = 30.0
    """Sightings per second, of each robot."""

    motion_hz: float = 30.0
    """Readings per second, of each robot."""

    pixel_px: float = 0.0
    """Standard deviation of a sighting, in u and in v [px]; white, normal."""

    speed_mps: float = 0.0
    """Standard deviation of a speed reading, absolute [m/s]; white from reading to reading."""

    speed_share: float = 0.0
    """Standard deviation of a speed reading, relative to the speed; white from reading to reading."""

    heading_rad: float = 0.0
    """Standard deviation of a heading reading [rad]; white from reading to reading."""

    slip: float = 0.0
    """Standard deviation of a relative error of speed and distance that changes slowly (Ornstein-Uhlenbeck)."""

    slip_s: float = 4.0
    """Correlation time of the slip [s]."""

    heading_drift: float = 0.0
    """Random walk of the heading reading [rad/sqrt(s)]; zero at the first reading."""

    heading_bias_rad: float | tuple[float, ...] = 0.0
    """What a heading reads too much [rad]."""

    speed_scale: float | tuple[float, ...] = 1.0
    """What speed and distance read, over the truth."""

    time_offset_s: float = 0.0
    """What to add to a time of the tracks for the time of the motion [s]."""

    lens_k1: float = 0.0
    """Of the division model, ``r_u = r_d / (1 + k1 r_d^2)``, r in half diagonals of the image; barrel if negative."""

    lens_centre_px: tuple[float, float] | None = None
    """Where the lens does not distort [px]; the middle of the image where not given."""

    lever_m: tuple[float, float] = (0.0, 0.0)
    """Of the tracked point from the axle, forward and to the left [m]."""

    outlier_share: float = 0.0
    """Share of sightings that are anywhere in the image instead."""

    swapped_s: Span | None = None
    """From when to when the first two robots carry each other's name [s, clock of the tracks]."""

    stuck_s: Span | None = None
    """From when to when the first robot's speed reads 0 and its odometer stands [s, clock of the tracks]."""

    duplicate_share: float = 0.0
    """Share of frames in which the tracker repeats its last position at a new time."""

    whole_pixels: bool = False
    """Are sightings rounded to whole pixels?"""

    dropout_share: float = 0.0
    """Share of the time in which a robot is not seen."""

    dropout_s: float = 0.5
    """Mean duration of a dropout [s]."""

    states_sigma: bool = False
    """Do tracks and motion carry the standard deviations of their white noise?"""

    def __post_init__(self) -> None:
        for name in ("tracks_hz", "motion_hz", "slip_s", "dropout_s"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} must be positive, not {getattr(self, name)}")
        for name in (
            "pixel_px",
            "speed_mps",
            "speed_share",
            "heading_rad",
            "slip",
            "heading_drift",
        ):
            if not getattr(self, name) >= 0:
                raise InputError(f"{name} must not be negative, not {getattr(self, name)}")
        for name in ("outlier_share", "duplicate_share", "dropout_share"):
            if not 0 <= getattr(self, name) < 1:
                raise InputError(f"{name} must be in 0..1, not {getattr(self, name)}")
