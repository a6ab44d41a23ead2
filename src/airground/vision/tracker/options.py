"""What a tracker takes for granted about detectors and about what they look at."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, log

from airground.errors import InputError

__all__ = ["TrackerOptions"]

FRAME_S = 0.05  # usual time between frames, for the odds of new things only [s]


@dataclass(frozen=True, slots=True)
class TrackerOptions:
    """Settings of a tracker. The defaults suit vehicles of 10 to 200 px in 10 to 60 images a second."""

    accelerations_pxps2: tuple[float, ...] = (10.0, 100.0, 1000.0)
    """Root mean square accelerations of the ways to move that a track chooses between [px/s2]: cruise, turn, jolt."""

    manoeuvre_s: float = 0.5
    """How long an acceleration lasts [s], as the time constant of its correlation."""

    switch_s: float = 0.7
    """How long a track stays with one way to move [s], as the time constant of its choice."""

    speed_pxps: float = 300.0
    """Usual speed [px/s]: the standard deviation of each coordinate's, for a thing seen once."""

    detection: float = 0.9
    """Chance that a thing in plain view is seen in a frame."""

    hidden_per_s: float = 0.05
    """How often a thing passes out of view without leaving [1/s]."""

    hidden_s: float = 1.0
    """How long it stays so [s], on average."""

    clutter_per_mpx: float = 5.0
    """False sightings in a frame and a million pixels."""

    births_per_mpx_s: float = 0.1
    """New things in a second and a million pixels."""

    gate: float = 0.99999
    """Share of a thing's own sightings that is let through to be its own."""

    confirm_hits: int = 3
    """Fewest sightings of a track before it is taken for a thing."""

    confirm_odds: float = 1e4
    """Odds of a thing against clutter at which a track is taken for a thing."""

    lost_s: float = 2.0
    """A track that was not seen for longer than this is ended [s]."""

    merge_px: float = 20.0
    """Two things nearer to each other than this may look like one [px]; outlines, where known, say it better."""

    merged_s: float = 5.0
    """A track that shares the sighting of another for longer than this is ended [s]."""

    defer_s: float = 1.0
    """How long a question of who is who may stay open [s]."""

    hypotheses: int = 6
    """Most answers to such a question that are followed at once; 1 decides on the spot."""

    def __post_init__(self) -> None:
        levels = tuple(float(level) for level in self.accelerations_pxps2)
        if not levels or not all(0 < level < 1e9 for level in levels):
            raise InputError(f"accelerations_pxps2 must be positive numbers, not {levels}")
        object.__setattr__(self, "accelerations_pxps2", levels)
        positive = (
            "manoeuvre_s switch_s speed_pxps hidden_per_s hidden_s clutter_per_mpx births_per_mpx_s "
            "lost_s merged_s confirm_odds"
        )
        for name in positive.split():
            if not (isfinite(value := getattr(self, name)) and value > 0):
                raise InputError(f"{name} must be a positive number, not {value}")
        for name in ("merge_px", "defer_s"):
            if not (isfinite(value := getattr(self, name)) and value >= 0):
                raise InputError(f"{name} must be zero or a positive number, not {value}")
        for name in ("detection", "gate"):
            if not 0 < (value := getattr(self, name)) < 1:
                raise InputError(f"{name} must lie between 0 and 1, not {value}")
        for name in ("confirm_hits", "hypotheses"):
            if (value := getattr(self, name)) < 1:
                raise InputError(f"{name} must be 1 or more, not {value}")

    @property
    def first_score(self) -> float:
        """Logarithm of the odds that a sighting that belongs to nobody is of a new thing."""
        return log(self.births_per_mpx_s * FRAME_S / self.clutter_per_mpx)
