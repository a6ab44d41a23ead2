"""Does the robot do what it is told? A blocked wheel, a wrong robot, motors connected the wrong way round.

Both what was told and what is seen pass through the same average over a window, so that neither delay nor noise of
single sightings counts; what was told is also delayed by the time in which a robot follows.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.control.safety.bounds import SafetyBounds

__all__ = ["Obedience", "excess"]

Motion = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Obedience:
    """Averages of what was told and of what was seen, and how long they have differed."""

    following: Motion = (0.0, 0.0, 0.0)
    """What was told, as a robot follows it: speed, sideways speed [m/s], turn rate [rad/s]."""

    told: Motion = (0.0, 0.0, 0.0)
    """Average of that."""

    seen: Motion = (0.0, 0.0, 0.0)
    """Average of what was seen."""

    differs_s: float = 0.0
    """For how long they have differed [s]."""

    def after(
        self,
        sent: VelocityCommand,
        seen: Motion | None,
        dt: float,
        bounds: SafetyBounds,
    ) -> Obedience:
        """Go on by one tick.

        Parameters
        ----------
        sent : VelocityCommand
            What held since the last tick.
        seen : (float, float, float) or None
            Speed and sideways speed [m/s] and turn rate [rad/s] since then; None where nothing was seen.
        dt : float [s]
            How long.
        bounds : SafetyBounds
            Windows and tolerances.

        Returns
        -------
        obedience : Obedience
            With what is known now.
        """
        keep = exp(-dt / bounds.response_s) if bounds.response_s > 0 else 0.0
        window = exp(-dt / bounds.window_s)
        (v, side, omega), (a, b, c), new = self.following, self.told, 1 - keep
        v = keep * v + new * sent.v
        side = keep * side + new * sent.lateral
        omega = keep * omega + new * sent.omega
        new = 1 - window
        told = (window * a + new * v, window * b + new * side, window * c + new * omega)
        if seen is None:
            # What was not seen is taken as done: a lost track has a stop of its own.
            return Obedience((v, side, omega), told, told)
        (a, b, c), (p, q, r) = self.seen, seen
        average = (window * a + new * p, window * b + new * q, window * c + new * r)
        speed, turn = excess(told, average, bounds)
        differs_s = self.differs_s + dt if speed > 0 or turn > 0 else 0.0
        return Obedience((v, side, omega), told, average, differs_s)


def excess(told: Motion, seen: Motion, bounds: SafetyBounds) -> tuple[float, float]:
    """By how much two motions differ beyond what is allowed.

    Parameters
    ----------
    told, seen : (float, float, float) [m/s, m/s, rad/s]
        Speed, sideways speed and turn rate.
    bounds : SafetyBounds
        What is allowed.

    Returns
    -------
    speed : float [m/s]
        Positive where they differ.
    turn : float [rad/s]
        The same of the turn rate.
    """
    v, side, omega = told
    speed = hypot(seen[0] - v, seen[1] - side) - bounds.speed_error_share * hypot(v, side)
    turn = abs(seen[2] - omega) - bounds.turn_error_share * abs(omega)
    return speed - bounds.speed_error_mps, turn - bounds.turn_error_radps
