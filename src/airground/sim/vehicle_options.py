"""How a simulated vehicle differs from one that does at once and exactly what it is told."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, pi

from airground.errors import InputError

__all__ = ["PlantOptions", "Span"]

Span = tuple[float, float]

POSITIVE = (
    "speed_mps",
    "turn_rate_radps",
    "acceleration_mps2",
    "turn_acceleration_radps2",
    "slip_s",
    "track_width_m",
    "wheelbase_m",
    "steering_rad",
    "steering_rate_radps",
    "watchdog_s",
)
NOT_NEGATIVE = (
    "reverse_mps",
    "latency_s",
    "speed_lag_s",
    "turn_lag_s",
    "slip",
    "turn_slip",
    "dead_band_mps",
    "dead_band_radps",
    "speed_quantum_mps",
    "turn_quantum_radps",
)


@dataclass(frozen=True, slots=True)
class PlantOptions:
    """A vehicle's own nature: what limits, delays and falsifies its motion, whatever it is told."""

    latency_s: float = 0.05
    """From a command's sending to its effect [s]: radio and motor controller."""

    speed_lag_s: float = 0.12
    """Time constant with which the speed follows [s]; 0 for at once, within the acceleration."""

    turn_lag_s: float = 0.08
    """The same of the turn rate, or of a car's steering [s]; wheels of a differential drive follow the speed's."""

    speed_mps: float = 1.2
    """Fastest [m/s]; of each wheel, where two wheels steer by their difference."""

    reverse_mps: float = 0.6
    """Fastest in reverse [m/s]."""

    turn_rate_radps: float = 3.0
    """Fastest turn [rad/s]."""

    acceleration_mps2: float = 2.0
    """Largest change of speed, either way [m/s^2]; of each wheel, where two wheels steer by their difference."""

    turn_acceleration_radps2: float = 12.0
    """Largest change of the turn rate [rad/s^2]."""

    speed_scale: float = 1.0
    """True speed over that of the command: a wrong wheel radius; -1 for motors connected the wrong way round."""

    turn_scale: float = 1.0
    """The same of the turn rate."""

    pull_per_m: float = 0.0
    """Curvature that it drives when told straight on [1/m]: wheels that are not alike."""

    slip: float = 0.0
    """Standard deviation of the relative slip of the speed, which changes slowly; its own readings do not see it."""

    turn_slip: float = 0.0
    """The same of the turn rate."""

    slip_s: float = 4.0
    """Correlation time of both [s]."""

    side_slip_s: float = 0.0
    """Speed outwards in a curve per lateral acceleration [s]: tyres that give."""

    dead_band_mps: float = 0.0
    """Commanded speeds below it, of a wheel or of the vehicle, do not move it [m/s]."""

    dead_band_radps: float = 0.0
    """Commanded turn rates below it do not turn it [rad/s]; not for two wheels or a car."""

    speed_quantum_mps: float = 0.0
    """Speeds are rounded to multiples of it on their way [m/s]; 0 for none."""

    turn_quantum_radps: float = 0.0
    """The same for turn rates [rad/s]."""

    track_width_m: float = 0.35
    """Between the two wheels of a differential drive [m]."""

    wheelbase_m: float = 0.35
    """Between the axles of a car [m]; its position is the rear axle's."""

    steering_rad: float = 0.5
    """Largest steering angle of a car [rad]."""

    steering_rate_radps: float = 3.0
    """How fast a car steers [rad/s]."""

    watchdog_s: float = 0.5
    """It stops by itself when it has heard nothing for so long [s]; infinite for never."""

    deaf_s: Span | None = None
    """From when to when commands that are sent do not reach it [s]."""

    blocked_s: Span | None = None
    """From when to when it stands, while its wheels turn [s]: it has run into something."""

    def __post_init__(self) -> None:
        for name in POSITIVE:
            value = getattr(self, name)
            if not value > 0 or (value == inf and name != "watchdog_s"):
                raise InputError(f"{name} must be positive, not {value}")
        for name in NOT_NEGATIVE:
            value = getattr(self, name)
            if not (value >= 0 and isfinite(value)):
                raise InputError(f"{name} must be 0 or more, not {value}")
        for name in ("speed_scale", "turn_scale", "pull_per_m", "side_slip_s"):
            if not isfinite(getattr(self, name)):
                raise InputError(f"{name} must be finite, not {getattr(self, name)}")
        if not self.steering_rad < pi / 2:
            raise InputError(f"steering_rad must be below pi/2, not {self.steering_rad}")
        for name in ("deaf_s", "blocked_s"):
            span = getattr(self, name)
            if span is not None and not span[0] <= span[1]:
                raise InputError(f"{name} must be (from, to), not {span}")
