"""A leg to drive by compass and odometer, what its driver is told at each tick, and what it says."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, pi
from typing import TYPE_CHECKING, Literal

from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand

__all__ = ["DriveLeg", "DrivenLeg", "LegDriveOptions", "LegInput", "LegPhase", "LegTick"]

LegPhase = Literal["wait", "turn", "drive", "settle", "brake", "back", "lost"]
"""What a robot does: waits for a leg, turns to its heading, drives it, comes to rest at its end; brakes before its end,
backs out; stands as its mark or its readings are missing, and goes on when they are back."""


@dataclass(frozen=True, slots=True)
class DriveLeg:
    """A straight leg."""

    heading_rad: float
    """By the robot's compass [rad]; any number of turns."""

    length_m: float
    """How far [m]."""

    speed_mps: float | None = None
    """How fast [m/s]; the driver's own where None."""

    def __post_init__(self) -> None:
        if not isfinite(self.heading_rad):
            raise InputError(f"heading_rad must be finite, not {self.heading_rad}")
        if not 0 < self.length_m < inf:
            raise InputError(f"length_m must be positive and finite, not {self.length_m}")
        if self.speed_mps is not None and not 0 < self.speed_mps < inf:
            raise InputError(f"speed_mps must be positive and finite, not {self.speed_mps}")


@dataclass(frozen=True, slots=True)
class DrivenLeg:
    """A leg that was driven, or a part of one."""

    heading_rad: float
    """That was held [rad]."""

    length_m: float
    """By odometer, to where it came to rest, or turned back [m]."""

    whole: bool
    """Whether to its end."""


@dataclass(frozen=True, slots=True)
class LegDriveOptions:
    """How legs are driven."""

    speed_mps: float = 0.3
    """Where a leg does not say another [m/s]."""

    careful_mps: float = 0.12
    """While it is not known how far a metre along the heading goes in the image [m/s]."""

    back_mps: float = 0.15
    """Backing out, and on a car's arcs [m/s]."""

    turn_radps: float = 1.0
    """Turning on the spot [rad/s]."""

    heading_tolerance_rad: float = 2 * pi / 180
    """At which a turn is over [rad]."""

    response_s: float = 0.15
    """How late the robot follows its commands [s]."""

    latency_s: float = 0.15
    """How late the picture is beyond its stamp and its age [s]."""

    lost_s: float = 0.3
    """Age of a sighting after which the robot stands and waits [s]."""

    silent_s: float = 0.4
    """The same of a reading [s]."""

    inside_share: float = 0.08
    """How far from the margin it backs out to, over the image's smaller side."""

    def __post_init__(self) -> None:
        for name in (
            "speed_mps",
            "careful_mps",
            "back_mps",
            "turn_radps",
            "heading_tolerance_rad",
            "lost_s",
            "silent_s",
        ):
            if not 0 < getattr(self, name) < inf:
                raise InputError(f"{name} must be positive and finite, not {getattr(self, name)}")
        for name in ("response_s", "latency_s", "inside_share"):
            if not 0 <= getattr(self, name) < inf:
                raise InputError(f"{name} must be 0 or more, not {getattr(self, name)}")


@dataclass(frozen=True, slots=True)
class LegInput:
    """All that a leg's driver is told at one tick."""

    t: float
    """Now [s]."""

    dt: float
    """Until the next tick [s]."""

    image_size_px: tuple[int, int]
    """Width and height [px]."""

    heading_rad: float | None = None
    """Newest of the compass [rad]; None where there is none."""

    speed_mps: float | None = None
    """Newest of the odometer, along the heading [m/s]; None where there is none."""

    reading_t: float | None = None
    """When both were read [s]; None for now."""

    turn_radps: float | None = None
    """Of the heading [rad/s]; told by its changes where None."""

    uv: tuple[float, float] | None = None
    """Where its mark is in the image [px]; None where it is not seen."""

    uv_dot: tuple[float, float] | None = None
    """How that moves [px/s]."""

    seen_t: float | None = None
    """Of the picture that this comes from [s]; None for now."""

    margin_px: float = 40.0
    """Distance that the mark shall keep from the image's border [px]."""

    others: tuple[tuple[float, float, float], ...] = ()
    """Everything else in view: u, v, and the distance to keep from it [px]."""

    held: bool = False
    """Whether something else holds the robot at rest."""


@dataclass(frozen=True, slots=True)
class LegTick:
    """A driver's answer."""

    command: VelocityCommand
    """What the robot shall do; it still has to pass what keeps it safe."""

    phase: LegPhase
    """What it is doing."""

    wants_leg: bool
    """Whether it stands and waits for a leg."""

    line: str
    """The same for a person."""

    aborted: bool
    """Whether the last leg was given up before its end; until the next one."""
