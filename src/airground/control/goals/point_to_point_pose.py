"""A goal with a heading, for what needs room to turn: a shortest way to a run-in, then along its line to the goal."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import TYPE_CHECKING

from airground.control.drive_laws import closing_rate, toward, turn_reach
from airground.control.goals.dubins import shortest_way
from airground.control.goals.point_to_point_law import BRAKING, Aim, PointLaw

if TYPE_CHECKING:
    from airground.control.goals.arrival import Grade

__all__ = ["PoseLaw"]

MARGIN = 1.15  # turn radii planned with, so that what it lags can be made up
RUN_IN = 1.0  # length of the run-in, in turn radii
SETTLE = 0.3  # distance in which the line is joined, in lengths of the run-in
WAY, LINE, BACK = 0.0, 0.5, 0.75  # fractional parts of progress


@dataclass(frozen=True, slots=True)
class PoseLaw:
    """What to drive; the manoeuvre is told by the fractional part of progress."""

    law: PointLaw
    """Limits and gains."""

    tolerance_rad: float
    """Of the heading [rad]."""

    def wanted(
        self, aim: Aim, progress: float, count: int, grade: Grade
    ) -> tuple[tuple[float, float], float]:
        """Speed and turn rate before limits on their changes, and where it has got.

        Parameters
        ----------
        aim : Aim
            The goal, with a heading.
        progress : float
            The last goal's index and the manoeuvre.
        count : int
            Of goals: the progress of one who has arrived.
        grade : str
            How near the goal is.

        Returns
        -------
        wanted : (float, float) [m/s, rad/s]
            Speed and turn rate.
        progress : float
            For the next step.
        """
        limits, index = self.law.limits, count - 1
        turn = aim.final_turn if aim.final_turn is not None else 0.0
        # The robot in the goal's frame: x along the wanted heading.
        c, s = cos(turn), sin(turn)
        x, y = -(c * aim.ahead + s * aim.left), -(c * aim.left - s * aim.ahead)
        phi = -turn
        straight = abs(phi) <= self.tolerance_rad
        if straight and (grade == "there" or (grade == "near" and x >= 0)):
            return (0.0, 0.0), float(count)
        length = RUN_IN * limits.turn_radius_m + 4 * aim.tolerance_m
        phase = progress - index
        lined = abs(y) < 0.15 * limits.turn_radius_m and abs(phi) < 0.5
        if phase == WAY and lined and -1.8 * length < x < -0.5 * length:
            phase = LINE
        elif phase == LINE and not lined:
            phase = WAY
        elif phase == LINE and x > 0.0:  # it has missed: again
            phase = BACK if limits.reverse_mps > 0 else WAY
        elif phase == BACK and (x < -1.5 * length or abs(phi) > 0.8):
            phase = LINE if lined else WAY
        if phase == WAY:
            return self._way(x, y, phi, length), float(index)
        gear = -1.0 if phase == BACK else 1.0
        top = limits.reverse_mps if phase == BACK else limits.speed_mps
        gap = 1.5 * length + x + 0.1 if phase == BACK else -x
        v = closing_rate(gap, self.law.distance_gain, top, BRAKING * limits.deceleration_mps2)
        v = gear * max(v, 0.02)
        # Critically damped in the distance driven.
        lam = SETTLE * length
        curvature = -(gear * y / lam**2 + 2 * sin(phi) / lam)
        reach = turn_reach(limits, v)
        omega = min(max(abs(v) * curvature, -reach), reach)
        return (v, omega), index + phase

    def _way(self, x: float, y: float, phi: float, length: float) -> tuple[float, float]:
        """The first piece of the shortest way, begun anew at each step."""
        limits = self.law.limits
        radius = MARGIN * limits.turn_radius_m
        first, way = shortest_way(x + length, y, phi, radius)
        omega = toward(first, self.law.heading_gain, limits)
        cap = min(
            limits.speed_mps,
            limits.turn_rate_radps * radius,
            sqrt(limits.lateral_acceleration_mps2 * radius),
        )
        braking = BRAKING * limits.deceleration_mps2
        v = closing_rate(way + length, self.law.distance_gain, limits.speed_mps, braking)
        if abs(first) > 0.2:
            v = min(v, cap)
        return v, min(max(omega, -v / radius), v / radius)
