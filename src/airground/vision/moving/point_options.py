"""How points that somebody else finds are judged."""

from __future__ import annotations

from dataclasses import dataclass

from airground.errors import InputError

__all__ = ["PointOptions"]


@dataclass(frozen=True, slots=True)
class PointOptions:
    """How points are judged."""

    least: int = 4
    """Points that must agree; four is what the method needs, and with four nothing can be checked."""

    sigma_px: float = 0.5
    """Deviation of a point where no covariance is given [px]."""

    known_noise: bool = False
    """Whether stated covariances are exact; if not, a common factor is found from the residuals."""

    wander_px_per_sqrt_s: float = 0.3
    """How far a fixed point seems to wander: a box around a parked car is not always drawn alike [px/sqrt(s)]."""

    patience: int = 5
    """Frames in a row in which a point may not fit before it counts as moving."""

    largest_map: int = 400
    """Points in the map; those not seen for longest go first."""

    def __post_init__(self) -> None:
        if self.least < 4:
            raise InputError(f"least must be 4 or more: a homography needs them, not {self.least}")
        if not self.sigma_px > 0:
            raise InputError(f"sigma_px must be positive, not {self.sigma_px}")
        if not self.wander_px_per_sqrt_s >= 0:
            raise InputError(
                f"wander_px_per_sqrt_s must be zero or more, not {self.wander_px_per_sqrt_s}"
            )
        if self.patience < 1:
            raise InputError(f"patience must be 1 or more, not {self.patience}")
        if self.largest_map < self.least:
            raise InputError(f"largest_map must be {self.least} or more, not {self.largest_map}")
