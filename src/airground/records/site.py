"""What ``site.toml`` says: camera, robots, links, limits, fences of a live site. docs/site.md describes each key."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from airground.control.limits import Limits
from airground.control.safety.bounds import SafetyBounds

if TYPE_CHECKING:
    from pathlib import Path

__all__ = [
    "CalibrationSite",
    "CameraSite",
    "ConsoleSite",
    "ControlSite",
    "FenceSite",
    "RecordSite",
    "RobotSite",
    "SeparationSite",
    "Site",
    "TimingSite",
]

EMBEDDED = "embedded"
"""Source of a camera and link of a robot that are played by the embedded world."""


@dataclass(frozen=True, slots=True)
class CameraSite:
    """A camera."""

    source: str
    """As `airground track --video` takes it, or `embedded`; a path is made absolute."""

    name: str = "camera"
    """What it is called."""

    detector: str = "auto"
    """As `airground track --detector` takes it."""

    rate_hz: float | None = None
    """Pictures a second, where the source does not say; None leaves it to the source."""

    stabilize: bool = False
    """Whether the camera moves: sightings are then referred to the first picture."""


@dataclass(frozen=True, slots=True)
class CalibrationSite:
    """What is known of the camera at the start, and when a calibration is good enough."""

    file: Path | None = None
    """calibration.json to begin with; None for none."""

    wanted_sigma: float = 0.05
    """Relative deviation of ground velocities at which a calibration drive is good enough."""

    lens: Literal["auto", "none", "division"] = "none"
    """Whether a calibration looks for a lens."""


@dataclass(frozen=True, slots=True)
class TimingSite:
    """How late a robot follows commands."""

    actuation_delay_s: float = 0.05
    """From sending a command to its effect [s]."""

    speed_lag_s: float = 0.15
    """Time constant with which the speed follows [s]."""

    turn_lag_s: float = 0.1
    """Time constant with which the turn rate follows [s]."""


@dataclass(frozen=True, slots=True)
class RobotSite:
    """A robot of ours."""

    name: str
    """What it is called."""

    track: str
    """Label of its mark, such as the number of its tag."""

    link: str
    """How it is reached: as `open_robot` takes it, or `embedded`."""

    kind: Literal["unicycle", "differential", "ackermann", "omni"] = "differential"
    """How it drives."""

    radius_m: float = 0.35
    """Of the disc around its axle that holds all of it [m]."""

    color: str = ""
    """In which it is drawn, as #rrggbb; empty leaves that to the console."""

    speed_mps: float | None = None
    """How fast it drives until the operator says otherwise [m/s]; its limit where None."""

    compass: Literal["absolute", "relative"] = "absolute"
    """Whether its heading has the same zero every day."""

    lever_arm_m: tuple[float, float] = (0.0, 0.0)
    """Where its mark is, seen from the axle's middle: forward, left [m]."""

    limits: Limits = field(default_factory=Limits)
    """What it may do."""

    timing: TimingSite = field(default_factory=TimingSite)
    """How late it follows."""


@dataclass(frozen=True, slots=True)
class ControlSite:
    """The control loop."""

    rate_hz: float = 50.0
    """Commands a second."""


@dataclass(frozen=True, slots=True)
class FenceSite:
    """A polygon in the image."""

    kind: Literal["stay_inside", "keep_out"]
    """Which side of it robots may be on."""

    corners_px: tuple[tuple[float, float], ...]
    """Its corners, as they are clicked [px]."""


@dataclass(frozen=True, slots=True)
class SeparationSite:
    """Keeping apart."""

    margin_m: float = 0.03
    """Gap to keep between robots, and to fences [m]."""

    others_radius_m: float = 0.4
    """Of the disc that holds a thing that is not ours [m]."""


@dataclass(frozen=True, slots=True)
class RecordSite:
    """Recordings of sessions."""

    folder: Path
    """Where they go."""

    images: Literal["none", "some", "all"] = "some"
    """Whether images are kept: none, some (`image_hz`), or all."""

    image_hz: float = 2.0
    """Images a second that are kept of `some`."""


@dataclass(frozen=True, slots=True)
class ConsoleSite:
    """The operator's console."""

    host: str = "127.0.0.1"
    """Address to serve on."""

    port: int = 8000
    """Port to serve on."""

    token_file: Path | None = None
    """File that holds the token; needed beyond this computer."""


@dataclass(frozen=True, slots=True)
class Site:
    """All of it."""

    name: str
    """What it is called."""

    cameras: tuple[CameraSite, ...]
    """Exactly one for now."""

    robots: tuple[RobotSite, ...]
    """One or more; names, tracks and links differ."""

    calibration: CalibrationSite = field(default_factory=CalibrationSite)
    """What is known of the camera."""

    control: ControlSite = field(default_factory=ControlSite)
    """The control loop."""

    safety: SafetyBounds = field(default_factory=SafetyBounds)
    """When robots stop."""

    fences: tuple[FenceSite, ...] = ()
    """Where robots may be at first."""

    separation: SeparationSite = field(default_factory=SeparationSite)
    """Keeping apart."""

    record: RecordSite | None = None
    """Recordings; None for none."""

    console: ConsoleSite = field(default_factory=ConsoleSite)
    """The operator's console."""
