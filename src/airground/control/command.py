"""What a robot is told to do."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

__all__ = ["STOP", "VelocityCommand"]


@dataclass(frozen=True, slots=True)
class VelocityCommand:
    """How fast a robot shall drive and turn from now on, in its own axes.

    Numbers are taken as they come, NaN too: it is the safety layer that lets none of those out.
    """

    v: float
    """Speed along the heading [m/s]; negative in reverse."""

    omega: float
    """Rate of the heading [rad/s], in the sense in which the robot's own heading is counted."""

    lateral: float = 0.0
    """Speed along the heading plus 90 degrees [m/s]; only what drives in all directions can."""

    @property
    def finite(self) -> bool:
        """Whether all of it are numbers."""
        return isfinite(self.v) and isfinite(self.omega) and isfinite(self.lateral)

    @property
    def at_rest(self) -> bool:
        """Whether it says to stand still."""
        return self.v == 0 and self.omega == 0 and self.lateral == 0


STOP = VelocityCommand(0.0, 0.0)
"""Stand still."""
