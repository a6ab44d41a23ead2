"""Speed and turn rate towards a point, for what turns on the spot and for what needs room.

The paper's law (section 4.2) steers a point p at distance L ahead of the axle: with w_p = s (cos a, sin a), a the
goal's bearing from the heading, ``v = s cos a`` and ``omega = s sin a / L``. It brings p to the goal and leaves the
axle L short of it. Here L shrinks with the distance d, ``L = d s / (d k)``, so that the axle itself arrives:
``omega = k sin a`` whatever the distance; and a stands for sin a, so that a goal behind is not an equilibrium.
The bearing then decays faster than the distance (k above the distance's own gain), so that the end is driven straight.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, hypot, pi, sin, sqrt
from typing import TYPE_CHECKING

from airground.control.drive_laws import closing_rate, toward, wrapped

if TYPE_CHECKING:
    from airground.control.limits import Limits

__all__ = ["Aim", "PointLaw"]

BRAKING = 0.7  # of the deceleration: the rest is for what was not foreseen
ROOM = 1.25  # turn radii between goal and circle's centre, before it turns towards the goal again
FLOW = 0.3  # of the speed, round a corner
STAY_S = 0.5  # by how much the other gear must be quicker


@dataclass(frozen=True, slots=True)
class Aim:
    """A goal as the robot sees it."""

    ahead: float
    """Along the heading [m]."""

    left: float
    """Along the heading plus 90 degrees [m]."""

    tolerance_m: float
    """How near is near enough [m]."""

    speed_there: float = 0.0
    """At which it may be passed [m/s]; 0 to stop there."""

    final_turn: float | None = None
    """Heading wanted there, from the present one [rad]; None for any."""

    flowing: bool = False
    """Whether it comes round a corner, which is no place to stop and turn."""

    @property
    def distance(self) -> float:
        """To the goal [m]."""
        return hypot(self.ahead, self.left)

    def turned_round(self) -> Aim:
        """Give the same goal, seen backwards."""
        return replace(self, ahead=-self.ahead, left=-self.left)


@dataclass(frozen=True, slots=True)
class PointLaw:
    """What to drive for a goal; no state."""

    limits: Limits
    """Of the robot."""

    distance_gain: float
    """Of the last decimetres [1/s]."""

    heading_gain: float
    """Of the bearing [1/s]."""

    reverse_within_m: float
    """Goals nearer than this may be reached in reverse [m]."""

    def wanted(self, aim: Aim, speed_now: float) -> tuple[float, float]:
        """Speed and turn rate, before limits on their changes.

        Parameters
        ----------
        aim : Aim
            The goal.
        speed_now : float [m/s]
            A robot that already drives one way rather stays with it.

        Returns
        -------
        v : float [m/s]
            Negative in reverse.
        omega : float [rad/s]
            Turn rate.
        """
        if self.backwards(aim, speed_now):
            v, omega = self._drive(aim.turned_round(), self.limits.reverse_mps)
            return -v, omega
        return self._drive(aim, self.limits.speed_mps)

    def _drive(self, aim: Aim, top: float) -> tuple[float, float]:
        limits, d = self.limits, aim.distance
        if d == 0:
            return 0.0, 0.0
        bearing = atan2(aim.left, aim.ahead)
        omega = toward(bearing, self.heading_gain, limits)
        way, radius = d, limits.turn_radius_m
        if radius > 0 and abs(bearing) > pi / 2:
            way = max(d, radius * abs(bearing))  # it has to drive round
        slow = 1.0
        if radius == 0:
            slow = max(0.0, aim.ahead / d) ** 2
            if aim.flowing:
                slow = max(slow, FLOW)
        v = self.speed(way, top, aim)
        # The arc that leads through the goal from here, or the tightest: faster, and it would be orbited.
        if bearing != 0:
            arc = d / (2 * max(abs(sin(bearing)), 1e-9)) if abs(bearing) < pi / 2 else d / 2
            arc = max(0.8 * arc, radius)
            v = min(v, limits.turn_rate_radps * arc, sqrt(limits.lateral_acceleration_mps2 * arc))
        if aim.speed_there == 0:
            # So near, the bearing is made of noise: what is beside is left, what is ahead is driven.
            omega *= min(max((d / aim.tolerance_m - 0.9) / 1.5, 0.0), 1.0)
        return v * slow, omega

    def speed(self, way: float, top: float, aim: Aim) -> float:
        """Speed at a distance from a goal.

        Parameters
        ----------
        way : float [m]
            Distance.
        top : float [m/s]
            Largest speed.
        aim : Aim
            What is wanted there.

        Returns
        -------
        v : float [m/s]
            0 or more.
        """
        braking = BRAKING * self.limits.deceleration_mps2
        if aim.speed_there == 0:
            return closing_rate(way, self.distance_gain, top, braking)
        return min(top, sqrt(aim.speed_there**2 + 2 * braking * max(0.0, way - aim.tolerance_m)))

    def backwards(self, aim: Aim, speed_now: float) -> bool:
        """Whether reverse is the quicker way.

        Parameters
        ----------
        aim : Aim
            The goal.
        speed_now : float [m/s]
            Of the robot.

        Returns
        -------
        backwards : bool
            False where reverse is forbidden or the goal is too far for it.
        """
        d, limits = aim.distance, self.limits
        if limits.reverse_mps == 0 or d >= self.reverse_within_m or d == 0:
            return False
        bearing = atan2(aim.left, aim.ahead)
        behind = wrapped(bearing + pi)
        if limits.turn_radius_m > 0:
            behind_is_near = abs(behind) < pi / 2 and not self.cramped(aim.turned_round())
            return behind_is_near and aim.final_turn is None
        ways = []
        for turn, top in ((bearing, limits.speed_mps), (behind, limits.reverse_mps)):
            last = 0.0 if aim.final_turn is None else abs(wrapped(aim.final_turn - turn))
            ways.append((abs(turn) + last) / limits.turn_rate_radps + d / top)
        forward, back = ways
        if abs(speed_now) > 0.01:
            forward += -STAY_S if speed_now > 0 else STAY_S
        return back < forward

    def cramped(self, aim: Aim) -> bool:
        """Whether the goal lies inside the turning circle, so that it would be circled for ever.

        Parameters
        ----------
        aim : Aim
            The goal.

        Returns
        -------
        cramped : bool
            False for what turns on the spot.
        """
        radius = self.limits.turn_radius_m
        return radius - hypot(aim.ahead, abs(aim.left) - radius) > aim.tolerance_m

    def roomy(self, aim: Aim) -> bool:
        """Whether it may turn towards the goal again.

        Parameters
        ----------
        aim : Aim
            The goal.

        Returns
        -------
        roomy : bool
            With a margin to `cramped`, so that the two do not alternate.
        """
        radius = self.limits.turn_radius_m
        return hypot(aim.ahead, abs(aim.left) - radius) >= ROOM * radius

    def make_room(self) -> tuple[float, float]:
        """Straight away from the goal: back, or on where reverse is forbidden.

        Returns
        -------
        v : float [m/s]
            Speed.
        omega : float [rad/s]
            Zero.
        """
        limits = self.limits
        slow = min(limits.speed_mps, limits.turn_rate_radps * limits.turn_radius_m)
        return (-limits.reverse_mps if limits.reverse_mps > 0 else slow), 0.0
