"""Follow a motion of an image point by the flatness of the unicycle that the camera sees (paper, section 4.1)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import atan2, cos, hypot, inf, isfinite, nan, sin
from typing import TYPE_CHECKING

from airground.control.command import STOP, VelocityCommand
from airground.control.controller import Guidance, ImageTrajectory
from airground.control.drive_laws import closing_rate, steered, toward, wrapped
from airground.control.goals.point_to_point import PointToPoint
from airground.control.goals.point_to_point_law import BRAKING
from airground.control.image_law import ImageLaw
from airground.control.limits import Limits
from airground.control.trajectories.flat_timing import HEADROOM, Timing, plan_timing
from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.floor import Floor
    from airground.control.state import RobotState

__all__ = ["FlatTracker"]

Pair = tuple[float, float]
Motion = tuple[Pair, Pair, Pair]

STILL_MPS = 0.02  # a wanted velocity below it has no direction that is worth turning to
LEAD_S = 0.1  # of acceleration, by which the clock may run ahead of the robot


@dataclass(frozen=True, slots=True, eq=False)
class FlatTracker:
    """Drives the axle along an image trajectory, in time where the robot's limits allow.

    The wanted image acceleration is the paper's, ``a = c_d'' + K_d (c_d' - c') + K_p (c_d - c)``, with K_p the product
    and K_d the sum of the two gains: the image error decays as ``exp(-position_gain t)`` and ``exp(-heading_gain t)``.
    Gains in 1/s mean the same near and far: it is J that knows the perspective. The law is written in two stages,
    ``w_d = J^-1 (c_d' + position_gain (c_d - c))`` and ``w' = w_d' + heading_gain (w_d - w)``, and the turn rate
    is taken from the angle of w_d where the paper divides by v: to first order the same on the trajectory, but it is
    singular where the *wanted* velocity is zero, not where the robot stands. So it starts from rest, at any
    heading; and where w_d itself vanishes, at a stop or a cusp, there is nowhere to turn to and it does not turn.

    Behind a cusp it drives in reverse if it may, else it turns round there. The limits are planned for
    (`plan_timing`): where the trajectory is too fast for them, or the robot is off it or turns, the clock runs slower
    and no corner is cut; lost time is not made up for. At the end it is brought to the last point as by `PointToPoint`.

    `progress` is the time into the trajectory [s]; of one that ends, one more than its duration when it has arrived.
    """

    floor: Floor
    """What is known of image and ground; its origin plays no part."""

    trajectory: ImageTrajectory
    """What to follow; if it repeats, an attribute `period` [s] lets limits be planned for all of it."""

    limits: Limits = field(default_factory=Limits)
    """Of the robot."""

    position_gain: float = 1.5
    """Rate at which the error decays [1/s]."""

    heading_gain: float = 4.0
    """Rate at which the velocity comes to be the wanted one [1/s]; above `position_gain`."""

    patience_m: float = 0.25
    """Distance from the trajectory at which its clock runs at half its rate [m]; two turn radii are added."""

    reverse: bool = True
    """Whether pieces behind a cusp are driven in reverse, where limits allow it."""

    tolerance_px: float = 2.0
    """At the end [px]."""

    tolerance_m: float = 0.01
    """At the end [m]; both are met."""

    response_s: float = 0.15
    """By how much commands may lead the speed, in time [s]: how slowly the drive follows; 0 for one that does at once.
    Too small a value makes it late at every corner; the safety layer holds the accelerations in any case."""

    _timing: Timing = field(init=False, repr=False)
    """How fast the clock may run."""

    _image: ImageLaw = field(init=False, repr=False)
    """Ground vectors of image vectors."""

    _end: PointToPoint | None = field(init=False, repr=False)
    """The last point, where there is one."""

    def __post_init__(self) -> None:
        for name in ("position_gain", "patience_m"):
            if not 0 < getattr(self, name) < inf:
                raise InputError(f"{name} must be positive, not {getattr(self, name)}")
        if not self.position_gain < self.heading_gain < inf:
            raise InputError(
                f"heading_gain must be above position_gain ({self.position_gain}), not {self.heading_gain}"
            )
        timing = plan_timing(self.floor, self.trajectory, self.limits, reverse=self.reverse)
        end = None
        if isfinite(self.trajectory.duration):
            end = PointToPoint(
                self.floor,
                self.trajectory.at(self.trajectory.duration)[0][None],
                self.limits,
                tolerance_px=self.tolerance_px,
                tolerance_m=self.tolerance_m,
                response_s=self.response_s,
            )
        object.__setattr__(self, "_timing", timing)
        object.__setattr__(self, "_image", ImageLaw(self.floor))
        object.__setattr__(self, "_end", end)

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
            The command and how things are; `trouble` where the robot is not on visible ground.

        Raises
        ------
        InputError
            If `progress` or `dt` cannot be.
        """
        duration = self.trajectory.duration
        if not 0 <= progress <= duration + 1:
            raise InputError(
                f"progress must be in 0..{duration + 1} s, not {progress}; begin with 0"
            )
        if not 0 < dt < inf:
            raise InputError(f"dt must be positive, not {dt} s")
        if self._end is not None and progress >= duration:
            last = self._end.step(state, progress - duration, dt)
            return replace(last, progress=duration + last.progress)
        u, v = state.uv.tolist()
        target = self.trajectory.at(progress)
        point, rate, rate2 = (tuple(array.tolist()) for array in target)
        trouble = self._trouble(u, v, state, (point, rate, rate2))
        if trouble:
            return Guidance(STOP, progress, False, nan, nan, target[0], trouble)
        off = hypot(*self._image.displacement(u, v, *point))
        planned, now, gear = self._clock(state, progress, off, point, rate)
        # A command holds for a step: the law is asked about the middle of it.
        h = now * dt / 2
        ahead = (
            (
                point[0] + h * (rate[0] + h / 2 * rate2[0]),
                point[1] + h * (rate[1] + h / 2 * rate2[1]),
            ),
            (rate[0] + h * rate2[0], rate[1] + h * rate2[1]),
            rate2,
        )
        speed, omega = self._wanted(state, dt, ahead, off, (planned, now, gear))
        if not isfinite(speed + omega):
            trouble = "the robot drives over the horizon: check the calibration"
            return Guidance(STOP, progress, False, nan, nan, target[0], trouble)
        window = max(dt, self.response_s)
        command = VelocityCommand(*steered(self.limits, speed, omega, state, window))
        after = min(progress + now * dt, duration)
        error_px = hypot(point[0] - u, point[1] - v)
        return Guidance(command, after, False, error_px, off, target[0])

    def _wanted(
        self,
        state: RobotState,
        dt: float,
        target: Motion,
        off: float,
        clock: tuple[float, float, float],
    ) -> tuple[float, float]:
        """Speed and turn rate before limits on their changes."""
        limits, image = self.limits, self._image
        planned, rate, gear = clock
        u, v = state.uv.tolist()
        theta = state.theta + state.omega * dt / 2
        c_dot = image.to_image(u, v, state.v * cos(theta), state.v * sin(theta))
        c = (u + c_dot[0] * dt / 2, v + c_dot[1] * dt / 2)
        c_d, c_d_dot, c_d_ddot = target

        # Far off, the error is closed no faster than the robot can stop.
        top = limits.speed_mps if gear > 0 else limits.reverse_mps
        braking = BRAKING * limits.deceleration_mps2
        gain = self.position_gain
        if off > 0:
            gain = closing_rate(off, gain, top, braking) / off
        pull = [gain * (c_d[i] - c[i]) for i in (0, 1)]
        # A clock that waits for the robot to turn must not hide where to turn to.
        wx, wy = image.to_ground(*c, pull[0] + planned * c_d_dot[0], pull[1] + planned * c_d_dot[1])
        now = image.to_ground(*c, pull[0] + rate * c_d_dot[0], pull[1] + rate * c_d_dot[1])
        bend = image.bend(c, c_dot, (wx, wy))
        change = [
            planned * planned * c_d_ddot[i] + gain * (planned * c_d_dot[i] - c_dot[i]) - bend[i]
            for i in (0, 1)
        ]
        ax, ay = image.to_ground(*c, *change)

        speed = hypot(wx, wy)
        sure = speed * speed + STILL_MPS**2
        angle = wrapped(atan2(gear * wy, gear * wx) - theta) if speed > 0 else 0.0
        spin = rate / planned * (wx * ay - wy * ax) / sure  # rate of the angle of w_d
        omega = spin + toward(angle, self.heading_gain, limits) * speed * speed / sure
        omega = min(max(omega, -limits.turn_rate_radps), limits.turn_rate_radps)
        least = 0.3 if limits.turn_radius_m > 0 else 0.0  # it has to roll in order to turn
        drive = min(hypot(*now), top) * max(cos(angle), least)
        if abs(omega) * drive > limits.lateral_acceleration_mps2:
            drive = limits.lateral_acceleration_mps2 / abs(omega)
        return gear * drive, omega

    def _clock(
        self, state: RobotState, t: float, off: float, point: Pair, point_dot: Pair
    ) -> tuple[float, float, float]:
        """Rate of the trajectory's time as planned and as the robot can follow, and the gear."""
        rate, gear = self._timing.at(t)
        patience = self.patience_m + 2 * self.limits.turn_radius_m
        rate /= 1 + (off / patience) ** 2
        x, y = self._image.to_ground(*point, *point_dot)
        speed = hypot(x, y)
        if speed == 0:
            return rate, rate, gear
        top = self.limits.speed_mps if gear > 0 else self.limits.reverse_mps
        rate = min(rate, HEADROOM * top / speed)  # for what was not looked at
        if speed <= STILL_MPS:
            return rate, rate, gear
        # It gains speed with the robot, and waits for one that turns.
        ahead = gear * (cos(state.theta) * x + sin(state.theta) * y) / speed
        lead = self.limits.acceleration_mps2 * max(LEAD_S, self.response_s) * max(ahead, 0.1)
        return rate, min(rate, (max(gear * state.v * ahead, 0.0) + lead) / speed), gear

    def _trouble(self, u: float, v: float, state: RobotState, target: Motion) -> str:
        """Why it has no answer; empty where it has one."""
        if not all(map(isfinite, (u, v, state.theta, state.v, state.omega))):
            return "where the robot is and how it moves is not known: wait for a sighting"
        if not self._image.sees(u, v):
            return f"the robot at ({u:.0f}, {v:.0f}) px is on or beyond the horizon: check the calibration"
        if not self._image.sees(*target[0]) or not isfinite(sum(target[1]) + sum(target[2])):
            return "the trajectory has left the visible ground: move it away from the horizon"
        return ""
