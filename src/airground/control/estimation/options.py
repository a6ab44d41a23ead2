"""What a state filter is told about a vehicle, its sensors and the delays between camera, robot and command."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf, isfinite

from airground.errors import InputError

__all__ = ["StateOptions"]

_MAY_BE_ZERO = {
    "actuation_delay_s",
    "speed_lag_s",
    "turn_lag_s",
    "heading_bias_sigma_rad",
    "scale_sigma",
    "speed_noise",
    "turn_rate_noise",
    "speed_stray",
    "turn_stray",
}


@dataclass(frozen=True, slots=True)
class StateOptions:
    """A vehicle as the filter models it. Sources are not announced: what is never read is never used.

    The vehicle regulates what its own odometer reads, so one unknown scale stands for both: true speed over read speed,
    and true speed over commanded speed once it has settled. Likewise for the turn rate.
    """

    lever_arm_m: tuple[float, float] = (0.0, 0.0)
    """Where the mark is, seen from the axle's middle: (forward, heading plus 90 degrees) [m]."""

    actuation_delay_s: float = 0.05
    """From sending a command to its effect [s]."""

    speed_lag_s: float = 0.15
    """Time constant with which the speed follows a command [s]."""

    turn_lag_s: float = 0.1
    """Time constant with which the turn rate follows a command [s]."""

    time_offset_s: float = 0.0
    """The robot's clock minus the camera's [s]: taken off the stamps of its readings."""

    sighting_sigma_px: float = 1.0
    """Standard deviation of a sighting that brings no covariance, per axis [px]."""

    heading_sigma_rad: float = 0.05
    """Standard deviation of a compass reading about its bias [rad]."""

    heading_bias_sigma_rad: float = 0.1
    """Standard deviation of that bias, which wanders over the place [rad]; 0 where there is none."""

    speed_sigma_mps: float = 0.01
    """Standard deviation of a speed reading at rest [m/s]."""

    speed_noise: float = 0.1
    """Further deviation of a speed reading, as a share of the speed."""

    turn_rate_sigma_radps: float = 0.03
    """Standard deviation of a turn rate reading at rest [rad/s]."""

    turn_rate_noise: float = 0.1
    """Further deviation of a turn rate reading, as a share of the turn rate."""

    scale_sigma: float = 0.15
    """Standard deviation of the unknown scales of speed and turn rate: wheel radius, slip."""

    drift_time_s: float = 60.0
    """Time over which scales and bias wander through their deviations [s]."""

    speed_stray_mps: float = 0.01
    """How far the speed strays from what commands make it, at rest [m/s]."""

    speed_stray: float = 0.08
    """Further straying, as a share of the commanded speed."""

    turn_stray_radps: float = 0.01
    """How far the turn rate strays from what commands make it, at rest [rad/s]."""

    turn_stray: float = 0.08
    """Further straying, as a share of the commanded turn rate, and of the speed in rad/m."""

    free_speed_mps: float = 0.4
    """How far the speed wanders in 1 s where no command is known [m/s]."""

    free_turn_radps: float = 1.0
    """How far the turn rate wanders in 1 s where no command is known [rad/s]."""

    path_walk_m: float = 0.005
    """How far a metre of driving ends from where heading and speed lead [m]: side slip, bumps."""

    heading_walk_rad: float = 0.015
    """How far a metre of driving turns the heading beyond the turn rate [rad]."""

    gate_sigma: float = 5.0
    """Sightings further from what is expected are refused, readings count for little [standard deviations]."""

    jump_after: int = 6
    """So many refused sightings in a row that agree are a robot carried elsewhere."""

    fastest_mps: float = 5.0
    """No vehicle is faster [m/s]; readings and commands beyond are refused."""

    fastest_radps: float = 20.0
    """None turns faster [rad/s]."""

    start_sigma_rad: float = 0.1
    """Heading is known from the image's motion once its deviation is below this [rad]."""

    lost_rad: float = 0.6
    """Heading is unknown again once its deviation is above this [rad]."""

    lost_m: float = 1.0
    """Position is unknown again once its deviation is above this [m]."""

    window_s: float = 1.0
    """Data may arrive so late [s] behind the newest; later ones are refused."""

    longest_gap_s: float = 20.0
    """After a longer silence of all sources, and further ahead than that, nothing is known [s]."""

    future_s: float = 5.0
    """Data stamped so far [s] after the latest time asked for are refused: a wrong clock."""

    def __post_init__(self) -> None:
        if [isfinite(x) for x in self.lever_arm_m] != [True, True]:
            raise InputError(f"lever_arm_m must be two finite numbers, not {self.lever_arm_m}")
        if not isfinite(self.time_offset_s):
            raise InputError(f"time_offset_s must be finite, not {self.time_offset_s}")
        for one in fields(self):
            if one.name in ("lever_arm_m", "time_offset_s"):
                continue
            value = getattr(self, one.name)
            least = one.name in _MAY_BE_ZERO
            if not (0 <= value < inf) or (value == 0 and not least):
                wanted = "0 or more" if least else "positive"
                raise InputError(f"{one.name} must be {wanted} and finite, not {value}")
        if not self.start_sigma_rad < self.lost_rad:
            raise InputError(
                f"start_sigma_rad must be below lost_rad = {self.lost_rad}, not {self.start_sigma_rad}"
            )
