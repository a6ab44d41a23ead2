"""The operator clicks, the robot goes there: point to point in the image (paper, section 4.2)."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, hypot, inf, isfinite, nan, sin, sqrt
from typing import TYPE_CHECKING

from airground.control.command import STOP, VelocityCommand
from airground.control.controller import Guidance
from airground.control.drive_laws import corner_speed, steered, toward, wrapped
from airground.control.goals.arrival import Arrival
from airground.control.goals.point_to_point_law import BRAKING, Aim, PointLaw
from airground.control.goals.point_to_point_pose import PoseLaw
from airground.control.image_law import ImageLaw
from airground.control.limits import Limits
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from airground.control.floor import Floor
    from airground.control.goals.arrival import Grade
    from airground.control.state import RobotState

__all__ = ["PointToPoint", "Sight"]


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """The goal that is aimed at."""

    aim: Aim
    """As the robot sees it."""

    step: tuple[float, float]
    """Displacement to it on the ground [m]."""

    error: tuple[float, float]
    """Distance to it [px, m]."""

    progress: float
    """Its index, and the manoeuvre."""

    goal_uv: FloatArray
    """(2,) [px]. Where it is."""


@dataclass(frozen=True, slots=True, eq=False)
class PointToPoint:
    """Drives the axle through image points and stops at the last.

    `progress` is the index of the goal that it aims at, their number once it has arrived; its fractional part tells
    a manoeuvre: turning at the goal, making room, running in.

    It arrives when the error is within half of both tolerances (or within them, with the goal no longer ahead), and
    sets off again only when it is beyond twice one of them. Where the state's covariance says that robot and goal
    cannot be told apart, three times the tolerances are enough: it does not hunt for what cannot be seen.

    Between goals it neither stops nor slows more than the corner asks for: it counts as passed within `passing_m`.
    A goal inside the turning circle is not circled: the robot makes room first, in reverse if it may.
    """

    floor: Floor
    """What is known of image and ground; its origin plays no part."""

    goals_uv: FloatArray
    """(N, 2) [px]. Where the axle shall be, in order, in the pixels of the model."""

    limits: Limits = field(default_factory=Limits)
    """Of the robot."""

    heading: float | None = None
    """At the last goal, in the ground frame [rad]; None for any. On the spot, or by a run-in where it needs room."""

    tolerance_px: float = 2.0
    """At the last goal [px]."""

    tolerance_m: float = 0.01
    """At the last goal [m]; both are met."""

    tolerance_rad: float = 0.03
    """Of the heading at the last goal [rad]."""

    passing_m: float = 0.15
    """Distance within which another goal counts as passed [m]."""

    reverse_within_m: float = 0.3
    """Goals nearer than this may be reached in reverse, where that is quicker and allowed [m]."""

    distance_gain: float = 1.5
    """Rate at which the last decimetres are closed [1/s]."""

    heading_gain: float = 3.0
    """Rate at which the bearing is closed [1/s]; above `distance_gain`."""

    response_s: float = 0.15
    """By how much commands may lead the speed, in time [s]: how slowly the drive follows; 0 for one that does at once.
    Too small a value makes it late at every corner; the safety layer holds the accelerations in any case."""

    _law: PointLaw = field(init=False, repr=False)
    """Speed and turn rate for a goal."""

    _pose: PoseLaw | None = field(init=False, repr=False)
    """The same for a goal with a heading, where it needs room to turn."""

    _image: ImageLaw = field(init=False, repr=False)
    """Ground vectors of image vectors."""

    _arrival: Arrival = field(init=False, repr=False)
    """Whether it is there."""

    _goals: tuple[tuple[float, float], ...] = field(init=False, repr=False)
    """The goals as plain numbers."""

    _speeds: tuple[float, ...] = field(init=False, repr=False)
    """Largest speed at each goal from which what comes after it can be braked for [m/s]."""

    def __post_init__(self) -> None:
        goals = readonly(self.goals_uv, (None, 2), "goals_uv")
        if len(goals) == 0:
            raise InputError("goals_uv is empty; click one point or more")
        _check_positive(self, "tolerance_px", "tolerance_m", "tolerance_rad", "passing_m")
        _check_positive(self, "distance_gain")
        if not self.distance_gain < self.heading_gain < inf:
            raise InputError(
                f"heading_gain must be above distance_gain ({self.distance_gain}), or it would spiral, "
                f"not {self.heading_gain}"
            )
        for name in ("reverse_within_m", "response_s"):
            if not 0 <= getattr(self, name) < inf:
                raise InputError(f"{name} must be 0 or more, not {getattr(self, name)}")
        if self.heading is not None and not isfinite(self.heading):
            raise InputError(f"heading must be a number or None, not {self.heading}")
        law = PointLaw(self.limits, self.distance_gain, self.heading_gain, self.reverse_within_m)
        room = self.heading is not None and self.limits.turn_radius_m > 0
        put = object.__setattr__
        put(self, "goals_uv", goals)
        put(self, "_law", law)
        put(self, "_pose", PoseLaw(law, self.tolerance_rad) if room else None)
        put(self, "_image", ImageLaw(self.floor))
        put(self, "_arrival", Arrival(self.tolerance_px, self.tolerance_m))
        put(self, "_goals", tuple((u, v) for u, v in goals.tolist()))
        put(self, "_speeds", self._through())

    def _through(self) -> tuple[float, ...]:
        """Braking backwards from the end: a corner soon after another is slowed for in time."""
        speeds, after, goals = [0.0], 0.0, self._goals
        braking = 2 * BRAKING * self.limits.deceleration_mps2
        legs = [self._image.displacement(*a, *b) for a, b in pairwise(goals)]
        for k in range(len(legs) - 1, -1, -1):
            here = sqrt(after**2 + braking * max(0.0, hypot(*legs[k]) - self.passing_m))
            speeds.append(here if isfinite(here) else 0.0)
            after = min(here, corner_speed(self.limits, self.passing_m, legs[k - 1], legs[k]))
        return tuple(reversed(speeds))

    def step(self, state: RobotState, progress: float, dt: float) -> Guidance:
        """Say what to do now.

        Parameters
        ----------
        state : RobotState
            Of the robot, when the command takes effect.
        progress : float
            0 at first, then what the last step gave.
        dt : float [s]
            Until the next step.

        Returns
        -------
        guidance : Guidance
            The command and how things are; `trouble` where robot or goal is not visible ground.

        Raises
        ------
        InputError
            If `progress` or `dt` cannot be.
        """
        sight = self.look(state, progress, dt)
        if isinstance(sight, Guidance):
            return sight
        wanted, progress = self._wanted(sight, state)
        window = max(dt, self.response_s)
        speed, omega = steered(self.limits, *wanted, state, window)
        arrived = progress == len(self._goals)
        done = arrived and abs(state.v) < 0.02 and abs(state.omega) < 0.1
        command = STOP if done else VelocityCommand(speed, omega)
        return Guidance(command, progress, done, *sight.error, sight.goal_uv)

    def look(self, state: RobotState, progress: float, dt: float) -> Sight | Guidance:
        """Find the goal aimed at, as the robot sees it.

        Parameters
        ----------
        state : RobotState
            Of the robot.
        progress : float
            As for `step`.
        dt : float [s]
            As for `step`.

        Returns
        -------
        sight : Sight or Guidance
            The goal; or rest, with what is in the way.

        Raises
        ------
        InputError
            If `progress` or `dt` cannot be.
        """
        count = len(self._goals)
        if not 0 <= progress <= count:
            raise InputError(f"progress must be in 0..{count}, not {progress}; begin with 0")
        if not 0 < dt < inf:
            raise InputError(f"dt must be positive, not {dt} s")
        index = min(int(progress), count - 1)
        u, v = state.uv.tolist()
        while True:
            dx, dy = self._image.displacement(u, v, *self._goals[index])
            if not isfinite(dx + dy + state.theta + state.v + state.omega):
                trouble = self._trouble(index, u, v, state)
                if trouble:
                    return Guidance(STOP, progress, False, nan, nan, self.goals_uv[index], trouble)
            if index == count - 1 or hypot(dx, dy) > self.passing_m:
                break
            index += 1
            progress = float(index)
        goal = self._goals[index]
        error = (hypot(goal[0] - u, goal[1] - v), hypot(dx, dy))
        aim = self._aim(index, dx, dy, state)
        return Sight(aim, (dx, dy), error, progress, self.goals_uv[index])

    def _aim(self, index: int, dx: float, dy: float, state: RobotState) -> Aim:
        goal, (u, v) = self._goals[index], state.uv.tolist()
        c, s = cos(state.theta), sin(state.theta)
        ahead, left = c * dx + s * dy, c * dy - s * dx
        flowing = index > 0 and hypot(dx, dy) > 2 * self.passing_m
        if index == len(self._goals) - 1:
            final = None if self.heading is None else wrapped(self.heading - state.theta)
            # Whichever of the two tolerances is the tighter here, or it would rest beside a goal for ever.
            px = hypot(goal[0] - u, goal[1] - v)
            near = min(self.tolerance_m, self.tolerance_px * hypot(dx, dy) / px if px > 0 else inf)
            if state.covariance is not None:  # nearer than its deviation nothing can be steered for
                spread = float(state.covariance[0, 0]) + float(state.covariance[1, 1])
                near = max(near, sqrt(spread)) if 0 <= spread < inf else near
            return Aim(ahead, left, near, 0.0, final, flowing)
        after = self._image.displacement(*self._goals[index], *self._goals[index + 1])
        corner = corner_speed(self.limits, self.passing_m, (dx, dy), after)
        there = max(min(corner, self._speeds[index]), 0.02)  # it passes, it does not stop
        return Aim(ahead, left, self.passing_m, there, None, flowing)

    def _wanted(self, sight: Sight, state: RobotState) -> tuple[tuple[float, float], float]:
        """Speed and turn rate before limits, and where it has got."""
        aim, progress, count = sight.aim, sight.progress, len(self._goals)
        index = min(int(progress), count - 1)
        last = index == count - 1
        rest = (0.0, 0.0)
        if last:
            grade = self.grade(sight, state)
            if progress == count:
                if grade != "away":
                    return rest, progress
                progress = float(index)
            if self._pose is not None:
                return self._pose.wanted(aim, progress, count, grade)
            turning = progress > index and self.limits.turn_radius_m == 0
            beside = aim.ahead * state.v <= 0 or abs(aim.ahead) <= self.tolerance_m / 4
            here = grade == "there" or (grade == "near" and (beside or turning))
            turn = aim.final_turn or 0.0
            faced = abs(turn) <= self.tolerance_rad / 2
            if here and faced:
                return rest, float(count)
            if not faced and (here or (turning and grade == "between")):
                return (0.0, toward(turn, self.heading_gain, self.limits)), index + 0.5
            if turning:
                progress = float(index)
        if self.limits.turn_radius_m > 0:
            room = progress > index
            backwards = not room and self._law.backwards(aim, state.v)
            if room and self._law.roomy(aim):
                progress = float(index)
            elif room or (not backwards and self._law.cramped(aim)):
                return self._law.make_room(), index + 0.5
        return self._law.wanted(aim, state.v), progress

    def grade(self, sight: Sight, state: RobotState) -> Grade:
        """How near the goal is.

        Parameters
        ----------
        sight : Sight
            The goal.
        state : RobotState
            Of the robot, for its covariance.

        Returns
        -------
        grade : str
            As `Arrival.grade` gives it.
        """
        return self._arrival.grade(*sight.error, state, sight.step)

    def speed(self, aim: Aim) -> float:
        """Speed straight towards a goal.

        Parameters
        ----------
        aim : Aim
            The goal.

        Returns
        -------
        v : float [m/s]
            0 or more.
        """
        return self._law.speed(aim.distance, self.limits.speed_mps, aim)

    def _trouble(self, index: int, u: float, v: float, state: RobotState) -> str:
        """Why it has no answer; empty where it has one."""
        if not all(map(isfinite, (u, v, state.theta, state.v, state.omega))):
            return "where the robot is and how it moves is not known: wait for a sighting"
        if not self._image.sees(u, v):
            return f"the robot at ({u:.0f}, {v:.0f}) px is on or beyond the horizon: check the calibration"
        goal = self._goals[index]
        if not self._image.sees(*goal):
            return (
                f"goal {index} at ({goal[0]:.0f}, {goal[1]:.0f}) px is on or beyond the horizon: "
                "click on the ground"
            )
        return ""


def _check_positive(owner: object, *names: str) -> None:
    for name in names:
        if not 0 < getattr(owner, name) < inf:
            raise InputError(f"{name} must be positive and finite, not {getattr(owner, name)}")
