"""What a session is told before it begins."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from typing import Literal

from airground.control import Limits
from airground.control.estimation.options import StateOptions
from airground.control.safety.bounds import SafetyBounds
from airground.errors import InputError

__all__ = ["RobotOptions", "SessionOptions"]

Polygons = tuple[tuple[tuple[float, float], ...], ...]


@dataclass(frozen=True, slots=True)
class RobotOptions:
    """One robot of ours."""

    name: str
    """What it is called."""

    track: str
    """Label of its mark, such as the number of its tag, or the name of its track."""

    kind: Literal["unicycle", "differential", "ackermann", "omni"] = "differential"
    """How it drives."""

    radius_m: float = 0.35
    """Of the disc around its axle that holds all of it [m]."""

    limits: Limits = field(default_factory=Limits)
    """What it may do."""

    speed_mps: float | None = None
    """How fast it drives until the operator says otherwise [m/s]; its limit where None."""

    state: StateOptions = field(default_factory=StateOptions)
    """Its delays and sensors."""

    compass: Literal["absolute", "relative"] = "absolute"
    """Whether its heading has the same zero every day; a gyroscope's has not, and counts only with a calibration that
    was made in this session."""

    def __post_init__(self) -> None:
        if not (isfinite(self.radius_m) and self.radius_m > 0):
            raise InputError(f"radius_m of {self.name} must be positive, not {self.radius_m}")
        if self.speed_mps is not None and not 0 < self.speed_mps <= self.limits.speed_mps:
            raise InputError(
                f"speed_mps of {self.name} must be above 0 and at most its limit {self.limits.speed_mps:g}, "
                f"not {self.speed_mps}"
            )


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """All of it."""

    robots: tuple[RobotOptions, ...]
    """Ours; names and tracks differ."""

    name: str = "site"
    """Of the site."""

    control_hz: float = 50.0
    """Commands a second."""

    bounds: SafetyBounds = field(default_factory=SafetyBounds)
    """When robots stop."""

    stay_inside: Polygons = ()
    """Where robots may be, at first [px]."""

    keep_out: Polygons = ()
    """Where they may not be, at first [px]."""

    margin_m: float = 0.03
    """Gap to keep between robots, and to fences [m]."""

    others_radius_m: float = 0.4
    """Of the disc that holds a thing that is not ours [m]."""

    wanted_sigma: float = 0.05
    """Relative deviation of ground velocities over the image at which a calibration is good enough."""

    border_px: float = 40.0
    """How far from the image's border robots are kept while calibrating [px]."""

    distortion: Literal["auto", "none", "division"] = "none"
    """Whether calibration looks for a lens."""

    def __post_init__(self) -> None:
        for what in ("name", "track"):
            names = [getattr(robot, what) for robot in self.robots]
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise InputError(f"two robots have the {what} {twice[0]!r}")
        if not 5 <= self.control_hz <= 1000:
            raise InputError(f"control_hz must lie in 5..1000, not {self.control_hz}")
        if not 0 < self.wanted_sigma < 1:
            raise InputError(f"wanted_sigma must lie in 0..1, not {self.wanted_sigma}")

    @property
    def period_s(self) -> float:
        """From one command to the next [s]."""
        return 1.0 / self.control_hz
