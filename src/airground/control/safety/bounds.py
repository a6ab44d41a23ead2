"""When the safety layer stops a robot."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf, isfinite, isnan

from airground.errors import InputError

__all__ = ["SafetyBounds"]

POSITIVE = ("tick_s", "clock_jump_s", "jump_m", "jump_rad", "window_s", "persist_s")


@dataclass(frozen=True, slots=True)
class SafetyBounds:
    """Bounds beyond which a robot stops; infinite for no bound."""

    tick_s: float = 0.25
    """Longest time between two ticks [s]."""

    clock_jump_s: float = 2.0
    """A longer one is taken as a jump of the clock [s]."""

    track_s: float = 0.5
    """Oldest that the newest sighting may be [s]."""

    camera_s: float = 0.5
    """Oldest that the newest picture may be [s]."""

    operator_s: float = 1.0
    """Longest silence of the operator [s]."""

    robot_s: float = 0.5
    """Longest silence of the robot [s]."""

    state_s: float = 0.5
    """Largest distance of the state's time from now, either way [s]."""

    future_s: float = 0.05
    """How far ahead of now what was seen or heard may be stamped [s]: clocks that do not quite agree."""

    jump_m: float = 0.3
    """Farthest that the state may move in a tick beyond what the speed limit explains [m]."""

    jump_rad: float = 0.8
    """The same of the heading [rad]."""

    position_sigma_m: float = 0.15
    """Largest standard deviation of the position, in its worst direction [m]; a state without any is not let pass."""

    heading_sigma_rad: float = 0.5
    """The same of the heading [rad]."""

    calibration_sigma: float = 0.2
    """Largest relative standard deviation of ground velocities at the robot's place."""

    image_margin_px: float = 0.0
    """How far inside the image it must be [px]; negative for outside."""

    fence_margin_m: float = 0.0
    """Clearance it must have from the fence [m], what its body takes; with less, it does not go at all."""

    fence_sigmas: float = 2.0
    """Standard deviations of the position that it must have on top where it goes; with less, it may only go inwards."""

    reaction_s: float = 0.2
    """How long it goes on at its speed before it brakes [s]: a tick, motors' lag, latency that is not in the state."""

    speed_error_mps: float = 0.08
    """Largest difference of seen and commanded velocity [m/s]; infinite not to compare."""

    speed_error_share: float = 0.5
    """What is allowed on top, per commanded speed."""

    turn_error_radps: float = 0.4
    """Largest difference of seen and commanded turn rate [rad/s]; infinite not to compare."""

    turn_error_share: float = 0.5
    """What is allowed on top, per commanded turn rate."""

    window_s: float = 0.4
    """Time over which both are averaged before they are compared [s]."""

    response_s: float = 0.25
    """How late the robot follows [s], beyond the latency that is in the state already."""

    persist_s: float = 1.0
    """How long they may differ [s]."""

    search_mps: float = 0.1
    """Fastest while the heading is unknown and is looked for by driving [m/s]; 0 forbids that."""

    search_m: float = 0.4
    """Clearance from the fence that such a robot must have, as it may go any way [m]."""

    good_ticks: int = 5
    """Ticks without any cause before it goes, at the start and after a stop."""

    gentle: bool = False
    """Whether it brakes within its limits where the cause allows it: for cargo."""

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if isnan(value):
                raise InputError(f"{one.name} must be a number, not {value}")
            if one.name in POSITIVE and not value > 0:
                raise InputError(f"{one.name} must be positive, not {value}")
            if one.name != "image_margin_px" and not value >= 0:
                raise InputError(f"{one.name} must be 0 or more, not {value}")
        finite = (
            "search_mps",
            "search_m",
            "window_s",
            "response_s",
            "reaction_s",
            "fence_margin_m",
            "fence_sigmas",
        )
        for name in (*finite, "image_margin_px", "speed_error_share", "turn_error_share"):
            if not isfinite(getattr(self, name)):
                raise InputError(f"{name} must be finite, not {getattr(self, name)}")
        if not (self.good_ticks >= 1 and self.good_ticks == int(self.good_ticks)):
            raise InputError(f"good_ticks must be a whole number, 1 or more, not {self.good_ticks}")
        if self.tick_s == inf:
            raise InputError("tick_s must be finite: accelerations are limited by it")
