"""What a robot may do."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf, isnan

from airground.errors import InputError

__all__ = ["Limits"]


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds on a robot's motion. Controllers plan within them; the safety layer holds them."""

    speed_mps: float = 0.5
    """Forward [m/s]; for what drives in all directions, of the velocity's length."""

    reverse_mps: float = 0.2
    """In reverse [m/s]; 0 forbids it."""

    turn_rate_radps: float = 1.5
    """Of the heading, either way [rad/s]."""

    acceleration_mps2: float = 0.5
    """Gain of speed, either way [m/s^2]."""

    deceleration_mps2: float = 0.8
    """Loss of speed [m/s^2]; a stop for safety may ask for more."""

    turn_acceleration_radps2: float = 4.0
    """Change of the turn rate [rad/s^2]."""

    lateral_acceleration_mps2: float = 1.0
    """Speed times turn rate [m/s^2]: what cargo and tyres bear in a curve."""

    turn_radius_m: float = 0.0
    """Smallest radius that can be driven [m]; 0 for what turns on the spot."""

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            least = one.name in ("reverse_mps", "turn_radius_m")
            if isnan(value) or value < 0 or (value == 0 and not least) or value == inf:
                wanted = "0 or more" if least else "positive"
                raise InputError(f"{one.name} must be {wanted} and finite, not {value}")
