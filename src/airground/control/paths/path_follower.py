"""Drive along a path: from anywhere onto it, along it at the speeds planned, to rest at its end.

With e the distance to the left of the path and psi the heading from its tangent, the robot heads for the point at
distance L ahead on the tangent, ``psi_d = -atan(e / L)``, by ``omega = kappa s' + psi_d' + k (psi_d - psi)``: e decays
in the time ``L / v`` and the heading's error in ``1 / k``, one after the other and without overshoot, on any curve. Far
from the path the robot heads straight for it, so it does not circle around a point.

In the image this is a wanted velocity towards ``aim_uv``, the image of that point: ``J(c)^-1 (aim_uv - c)`` is exactly
the direction to it on the ground, as lines stay lines. So where g is a little wrong, the robot still drives on the line
that was drawn.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field, replace
from math import atan2, copysign, cos, hypot, inf, isfinite, pi, remainder, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from airground.control.command import STOP, VelocityCommand
from airground.control.controller import Guidance
from airground.control.drive_laws import closing_rate
from airground.control.paths.speed_profile import speed_profile
from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.limits import Limits
    from airground.control.paths.image_path import ImagePath
    from airground.control.state import RobotState
    from airground.geometry.arrays import FloatArray

__all__ = ["PathFollower"]

_HEADROOM = 0.85
"""Of the turn rate that curves are planned with; the rest is for corrections."""

_FACING = 0.8
"""Cosine of the heading's error, 37 degrees, beyond which it turns on the spot, if it can."""

_BEFORE = 1e-9
"""How far before a cusp [m] a point still counts to the run that ends there."""


@dataclass(frozen=True, slots=True, eq=False)
class PathFollower:
    """Follows an `ImagePath`; its progress is the arc length [m], which goes on from lap to lap.

    The first step finds the nearest point of the path; of stretches about equally near it takes the earliest. On a
    closed path it drives from there to the path's start and then the laps, and until then progress is negative.
    """

    path: ImagePath
    """What to follow, with the floor that it lies on."""

    limits: Limits
    """Of the robot."""

    laps: int = 1
    """Of a closed path, from its start."""

    lookahead_m: float = 0.1
    """Least distance ahead on the tangent that it heads for [m]."""

    lookahead_s: float = 0.8
    """What speed adds to that [s]."""

    heading_gain: float = 3.0
    """Of the heading's error [1/s]; at most a third of 1 / (delay that the state does not foresee + time of a step)."""

    response_s: float = 0.1
    """Time in which the robot takes up a command [s]: it asks for no more speed than it can gain in it."""

    arrive_m: float = 0.003
    """How near to the end it comes [m]."""

    join_m: float = 0.2
    """How much farther than the nearest a stretch may be, for an earlier one to be joined [m]."""

    _cap: list[float] = field(init=False, repr=False)
    """Squares of speeds as bounded by the path ahead, rolling at ends of runs, by sample."""

    def __post_init__(self) -> None:
        for name in ("lookahead_m", "heading_gain", "arrive_m"):
            value = getattr(self, name)
            if not 0 < value < inf:
                raise InputError(f"{name} must be positive and finite, not {value}")
        for name in ("lookahead_s", "response_s", "join_m"):
            value = getattr(self, name)
            if not 0 <= value < inf:
                raise InputError(f"{name} must be 0 or more and finite, not {value}")
        if self.laps < 1:
            raise InputError(f"laps must be 1 or more, not {self.laps}")
        path = self.path
        plan = replace(self.limits, turn_rate_radps=_HEADROOM * self.limits.turn_rate_radps)
        edges = (0, *path.breaks, len(path))
        caps = [
            speed_profile(
                path.s[a:b] - path.s[a],
                path.curvature[a:b],
                plan,
                wanted_mps=None if path.wish is None else path.wish[a:b],
                closed=path.closed,
                start_mps=inf,
                end_mps=inf,
                direction=way,
            )
            for a, b, way in zip(edges[:-1], edges[1:], path.directions, strict=True)
        ]
        object.__setattr__(self, "_cap", (np.concatenate(caps) ** 2).tolist())

    @property
    def length(self) -> float:
        """Progress at the end [m]: of all laps."""
        return self.path.length * (self.laps if self.path.closed else 1)

    def step(self, state: RobotState, progress: float, dt: float) -> Guidance:
        """Say what to do now.

        Parameters
        ----------
        state : RobotState
            Of the robot, when the command takes effect; its speed must be filled in.
        progress : float [m]
            0 at first, then what the last step gave.
        dt : float [s]
            Until the next step.

        Returns
        -------
        guidance : Guidance
            The command; error and wanted point are about the nearest point of the path.
        """
        path = self.path
        x, y = path.floor.position(state.uv).tolist()
        if not (isfinite(x + y + state.theta + state.v + progress) and dt > 0):
            what = "where the robot is on the ground, or how it moves, is not known"
            return Guidance(STOP, progress, False, inf, inf, path.uv[0], what)
        s = self._along(x, y, progress, abs(state.v) * dt)
        if progress >= self.length:
            s = self.length
        run = 0 if path.closed else path.run_of(progress)
        end = self.length if path.closed else path.run_ends[run]
        held = path.wrapped(min(s, end - _BEFORE))
        i = path._interval(held)
        px, py, tangent, kappa, _ = path._ground(held, i)
        c, d = cos(tangent), sin(tangent)
        left = (y - py) * c - (x - px) * d
        ahead = (x - px) * c + (y - py) * d
        left_over = end - min(s, end) - ahead
        off = hypot(left, ahead)
        wanted = path.floor.pixel(np.array([px, py]))
        error_px = hypot(float(state.uv[0] - wanted[0]), float(state.uv[1] - wanted[1]))
        if progress >= self.length or self._arrived(left, left_over):
            wanted = path.floor.pixel(
                path.xy[-1] if run == len(path.breaks) else path.xy[path.breaks[run]]
            )
            error_px = hypot(float(state.uv[0] - wanted[0]), float(state.uv[1] - wanted[1]))
            gap, done = hypot(left, left_over), end >= self.length
            return Guidance(STOP, max(progress, end), done, error_px, gap, wanted)
        way = path.directions[run]
        heading = remainder(state.theta + (pi if way < 0 else 0.0) - tangent, 2 * pi)
        moving = max(way * state.v, 0.0)
        tau = max(dt, self.response_s)
        v = min(
            self._bound(held, i, end, moving * tau),
            moving + self.limits.acceleration_mps2 * tau,
        )
        command = self._command(
            v=v,
            left=left,
            left_over=left_over,
            heading=heading,
            kappa=kappa,
            way=way,
            tau=tau,
        )
        return Guidance(command, s, False, error_px, off, wanted)

    def aim(self, uv: FloatArray, s: float, v: float) -> FloatArray:
        """Where in the image the robot heads for, away from the end.

        Parameters
        ----------
        uv : (2,) array [px]
            Where it is.
        s : float [m]
            Its progress.
        v : float [m/s]
            Its speed.

        Returns
        -------
        aim_uv : (2,) array [px]
            Image of the point ahead on the tangent at its nearest point of the path.
        """
        point = self.path.at(self.path.nearest(uv, near_s=s))
        reach = self.lookahead_m + self.lookahead_s * abs(v)
        way = np.array([cos(point.theta), sin(point.theta)])
        return self.path.floor.pixel(point.xy + reach * way)

    def _along(self, x: float, y: float, progress: float, moved: float) -> float:
        """Arc length of the nearest point, from where it was."""
        path = self.path
        if progress != 0:
            return path._nearest_along(x, y, progress, 2 * moved + 0.1)
        s = path._nearest_anywhere(x, y, self.join_m)
        if path.closed and s % path.length > self.join_m:
            s = s % path.length - path.length  # first to the start, then the laps
        return s

    def _arrived(self, left: float, left_over: float) -> bool:
        """Whether a run is at its end, or as near as can be."""
        if self.limits.turn_radius_m > 0:
            return left_over <= self.arrive_m / 2
        gap = hypot(left, left_over)
        return gap <= self.arrive_m or (left_over <= self.arrive_m / 2 and gap <= 2 * self.arrive_m)

    def _bound(self, s: float, i: int, end: float, lead: float) -> float:
        """Speed that the path allows, here and a little ahead."""
        s_, cap = self.path._rows[0], self._cap
        bound = inf
        for place in (s, s + lead):
            place = min(place, end)  # noqa: PLW2901
            if place > s_[-1]:
                place = self.path.wrapped(place)  # noqa: PLW2901
            k = i if place == s else min(max(bisect_right(s_, place) - 1, 0), len(s_) - 2)
            h = s_[k + 1] - s_[k]
            f = min(max((place - s_[k]) / h, 0.0), 1.0) if h > 0 else 0.0
            bound = min(bound, cap[k] + f * (cap[k + 1] - cap[k]))
        return sqrt(max(bound, 0.0))

    def _command(
        self,
        *,
        v: float,
        left: float,
        left_over: float,
        heading: float,
        kappa: float,
        way: int,
        tau: float,
    ) -> VelocityCommand:
        limits = self.limits
        spots = limits.turn_radius_m == 0
        loss = limits.deceleration_mps2
        reach = self.lookahead_m + self.lookahead_s * v
        last = spots and left_over < reach
        gap = hypot(left, left_over) if last else max(left_over, 0.0)
        # From rest at the end back: never faster than lets it stop there, if it reacts late by tau.
        v = min(v, sqrt((loss * tau) ** 2 + 2 * loss * gap) - loss * tau)
        # And the last of it so gently that a drive which lags by tau does not run over: critically damped.
        v = min(v, closing_rate(gap, 1 / (4 * tau), v, loss))
        wanted = atan2(-left, left_over if last else reach)
        error = remainder(wanted - heading, 2 * pi)
        c = cos(error)
        v *= max(0.0, (c - _FACING) / (1 - _FACING)) if spots else max(0.4, c)
        forward = v * cos(heading) / max(1 - kappa * left, 0.3)
        drift = 0.0 if last else -reach / (reach * reach + left * left) * v * sin(heading)
        omega = kappa * forward + drift + self.heading_gain * error
        omega = min(max(omega, -limits.turn_rate_radps), limits.turn_rate_radps)
        if not spots:
            tightest = v / limits.turn_radius_m
            omega = min(max(omega, -tightest), tightest)
        if v * abs(omega) > limits.lateral_acceleration_mps2:
            slower = limits.lateral_acceleration_mps2 / abs(omega)
            if not spots:  # with the curve as it is
                bend = abs(omega) / v
                slower = sqrt(limits.lateral_acceleration_mps2 / bend)
                omega = copysign(bend * slower, omega)
            v = slower
        return VelocityCommand(way * v, omega)
