"""Point to point for what drives in all directions: straight there, and turned on the way."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, sin
from typing import TYPE_CHECKING

from airground.control.command import STOP, VelocityCommand
from airground.control.controller import Guidance
from airground.control.drive_laws import toward
from airground.control.goals.point_to_point import PointToPoint
from airground.control.limits import Limits
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.control.floor import Floor
    from airground.control.state import RobotState

__all__ = ["PointOmni"]


@dataclass(frozen=True, slots=True, eq=False)
class PointOmni:
    """Drives straight through image points with `v` and `lateral`, and turns to a heading meanwhile.

    Goals, tolerances and `progress` are those of `PointToPoint`. Limits on speed and its changes hold for the length
    of the velocity; reverse and turn radius mean nothing here.
    """

    floor: Floor
    """What is known of image and ground; its origin plays no part."""

    goals_uv: FloatArray
    """(N, 2) [px]. Where the axle shall be, in order, in the pixels of the model."""

    limits: Limits = field(default_factory=Limits)
    """Of the robot."""

    heading: float | None = None
    """To turn to, in the ground frame [rad]; None to keep the one it has."""

    tolerance_px: float = 2.0
    """At the last goal [px]."""

    tolerance_m: float = 0.01
    """At the last goal [m]; both are met."""

    tolerance_rad: float = 0.03
    """Of the heading at the last goal [rad]."""

    passing_m: float = 0.15
    """Distance within which another goal counts as passed [m]."""

    distance_gain: float = 1.5
    """Rate at which the last decimetres are closed [1/s]."""

    heading_gain: float = 3.0
    """Rate at which the heading is closed [1/s]."""

    response_s: float = 0.15
    """By how much commands may lead the speed, in time [s]: how slowly the drive follows; 0 for one that does at once.
    Too small a value makes it late at every corner; the safety layer holds the accelerations in any case."""

    _points: PointToPoint = field(init=False, repr=False)
    """Goals, speeds at them, and whether it is there."""

    def __post_init__(self) -> None:
        points = PointToPoint(
            self.floor,
            self.goals_uv,
            self.limits,
            self.heading,
            tolerance_px=self.tolerance_px,
            tolerance_m=self.tolerance_m,
            tolerance_rad=self.tolerance_rad,
            passing_m=self.passing_m,
            distance_gain=self.distance_gain,
            heading_gain=self.heading_gain,
            response_s=self.response_s,
        )
        object.__setattr__(self, "goals_uv", points.goals_uv)
        object.__setattr__(self, "_points", points)

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
        points, limits = self._points, self.limits
        sight = points.look(state, progress, dt)
        if isinstance(sight, Guidance):
            return sight
        dx, dy = sight.step
        d, count = sight.error[1], len(points.goals_uv)
        aim, progress, last = sight.aim, sight.progress, int(sight.progress) >= count - 1
        turn = aim.final_turn or 0.0
        speed = points.speed(aim)
        if last:
            grade = points.grade(sight, state)
            arrived = grade == "there" or (grade != "away" and progress == count)
            faced = abs(turn) <= self.tolerance_rad * (1.0 if progress == count else 0.5)
            progress = float(count if arrived and faced else count - 1)
            speed = 0.0 if arrived else speed
        window = max(dt, self.response_s)
        omega = toward(turn, self.heading_gain, limits) if progress < count else 0.0
        swing = limits.turn_acceleration_radps2 * window
        omega = min(max(omega, state.omega - swing), state.omega + swing)
        omega = min(max(omega, -limits.turn_rate_radps), limits.turn_rate_radps)
        # The change of the velocity is bounded as a vector, on the ground; the heading is that of the step's middle.
        wx, wy = (speed * dx / d, speed * dy / d) if d > 0 else (0.0, 0.0)
        before = state.theta - state.omega * dt / 2
        c, s = cos(before), sin(before)
        now_x = c * state.v - s * state.lateral
        now_y = s * state.v + c * state.lateral
        gaining = hypot(wx, wy) >= hypot(now_x, now_y)
        most = (limits.acceleration_mps2 if gaining else limits.deceleration_mps2) * window
        change = hypot(wx - now_x, wy - now_y)
        if change > most:
            wx, wy = now_x + most / change * (wx - now_x), now_y + most / change * (wy - now_y)
        middle = state.theta + omega * dt / 2
        c, s = cos(middle), sin(middle)
        drift = max(abs(state.v), abs(state.lateral))
        done = progress == count and drift < 0.02 and abs(state.omega) < 0.1
        command = STOP if done else VelocityCommand(c * wx + s * wy, omega, c * wy - s * wx)
        return Guidance(command, progress, done, *sight.error, sight.goal_uv)
