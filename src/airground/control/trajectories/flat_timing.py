"""How fast a trajectory's clock may run for a robot's limits, and which of its pieces are driven in reverse.

Looked at once, before the drive: a robot that only slows where it is too late cuts the corner. With s the rate of the
clock, ground speed goes with s, and so does the turn rate; lateral acceleration with s^2. Two passes over the way, as
in time-optimal path following, let the speed rise and fall no faster than the robot's does.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.control.controller import ImageTrajectory
    from airground.control.floor import Floor
    from airground.control.limits import Limits

__all__ = ["Timing", "plan_timing"]

HEADROOM = (
    0.9  # of speed, turn rate and lateral acceleration: the rest brings it back onto the trajectory
)
EASY = 0.7  # of accelerations
STEP_S = 0.02
MOST = 4000
ENDLESS_S = 120.0  # looked at of what neither ends nor repeats
LEAST_RATE = 0.02  # a clock that stood would never get to the end


@dataclass(frozen=True, slots=True)
class Timing:
    """The plan, on an even grid of the trajectory's time."""

    step_s: float
    """Of the grid [s]."""

    span_s: float
    """Time that was looked at [s]."""

    repeats: bool
    """Whether the trajectory begins again after it."""

    rates: tuple[float, ...]
    """(N,). How fast the clock may run, 0..1."""

    gears: tuple[float, ...]
    """(N,). 1 forward, -1 in reverse."""

    def at(self, t: float) -> tuple[float, float]:
        """Rate and gear at a time.

        Parameters
        ----------
        t : float [s]
            Into the trajectory.

        Returns
        -------
        rate : float
            0..1; 1 beyond what was looked at.
        gear : float
            1 forward, -1 in reverse.
        """
        if self.repeats:
            t %= self.span_s
        elif t > self.span_s:
            return 1.0, self.gears[-1]
        place = t / self.step_s
        k = min(int(place), len(self.rates) - 2)
        part = min(place - k, 1.0)
        rate = self.rates[k] + part * (self.rates[k + 1] - self.rates[k])
        return rate, self.gears[k] if part < 0.5 else self.gears[k + 1]


def plan_timing(
    floor: Floor, trajectory: ImageTrajectory, limits: Limits, *, reverse: bool
) -> Timing:
    """Look at a trajectory from its start to its end, or once round.

    Parameters
    ----------
    floor : Floor
        What is known of image and ground.
    trajectory : ImageTrajectory
        The trajectory; an attribute `period` [s] tells when it repeats.
    limits : Limits
        Of the robot.
    reverse : bool
        Whether what follows a cusp is driven in reverse; else the robot turns round there.

    Returns
    -------
    timing : Timing
        The plan.

    Raises
    ------
    InputError
        If it is not smooth numbers on visible ground, or curves more tightly than the robot can.
    """
    span = trajectory.duration
    if not span > 0:
        raise InputError(f"the trajectory's duration must be positive, not {span} s")
    repeats = not isfinite(span)
    if repeats:
        period = float(getattr(trajectory, "period", inf))
        repeats = isfinite(period)
        span = period if repeats else ENDLESS_S
    count = min(max(int(span / STEP_S), 50), MOST) + 1
    times = np.linspace(0.0, span, count)
    w, w_dot = _on_ground(floor, trajectory, times)
    step = float(times[1])
    speed = np.hypot(w[:, 0], w[:, 1])
    most = float(speed.max())
    if not most > 0:
        raise InputError("the trajectory never moves; use a point to point controller")
    moving = speed > 0.02 * most
    across = w[:, 0] * w_dot[:, 1] - w[:, 1] * w_dot[:, 0]
    omega = np.where(moving, across / np.maximum(speed, 1e-12) ** 2, 0.0)
    _check_curvature(limits, times, speed, omega, moving)
    gears = _gears(w, moving) if reverse and limits.reverse_mps > 0 else np.ones(count)

    top = HEADROOM * np.where(gears > 0, limits.speed_mps, limits.reverse_mps)
    rate = np.minimum(1.0, top / np.maximum(speed, 1e-12))
    turning = np.maximum(np.abs(omega), 1e-12)
    rate = np.minimum(rate, HEADROOM * limits.turn_rate_radps / turning)
    lateral = HEADROOM * limits.lateral_acceleration_mps2
    rate = np.minimum(rate, np.sqrt(lateral / np.maximum(turning * speed, 1e-12)))
    swing = np.abs(np.gradient(omega, step))
    calm = moving & np.roll(moving, 1) & np.roll(moving, -1)
    swing = np.where(calm, swing, 0.0)
    easy = EASY * limits.turn_acceleration_radps2
    rate = np.minimum(rate, np.sqrt(easy / np.maximum(swing, 1e-12)))

    drive = _eased(rate * speed, speed * step, limits, repeats=repeats, ends=not repeats)
    rate = np.where(moving, np.minimum(rate, drive / np.maximum(speed, 1e-12)), rate)
    rate = np.maximum(rate, LEAST_RATE)
    return Timing(step, span, repeats, tuple(rate.tolist()), tuple(gears.tolist()))


def _on_ground(
    floor: Floor, trajectory: ImageTrajectory, times: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Ground velocities and accelerations along it."""
    uv, uv_dot, uv_ddot = (
        np.array(rows, dtype=np.float64)
        for rows in zip(*(trajectory.at(t) for t in times.tolist()), strict=True)
    )
    seen = np.isfinite(floor.position(uv)).all(axis=1)
    seen &= np.isfinite(uv_dot).all(axis=1) & np.isfinite(uv_ddot).all(axis=1)
    if not seen.all():
        bad = int(np.argmin(seen))
        raise InputError(
            f"the trajectory at {times[bad]:.2f} s is at {uv[bad].tolist()} px or has rates that are no numbers, "
            "expected visible ground: move it away from the horizon"
        )
    model = floor.model
    w = model.ground_velocity(uv, uv_dot)
    bend = (model.jacobian_rate(uv, uv_dot) @ w[..., None])[..., 0]
    return w, model.ground_velocity(uv, uv_ddot - bend)


def _gears(w: FloatArray, moving: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> FloatArray:
    """A direction that turns by more than 90 degrees between two samples has met a cusp, or a stop."""
    gears, gear = np.ones(len(w)), 1.0
    last: FloatArray | None = None
    for k in range(len(w)):
        if moving[k]:
            if last is not None and float(last @ w[k]) < 0:
                gear = -gear
            last = w[k]
        gears[k] = gear
    return gears


def _check_curvature(
    limits: Limits,
    times: FloatArray,
    speed: FloatArray,
    omega: FloatArray,
    moving: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
) -> None:
    if limits.turn_radius_m == 0:
        return
    radius = np.where(moving, speed / np.maximum(np.abs(omega), 1e-12), np.inf)
    tightest = int(np.argmin(radius))
    if radius[tightest] < 0.98 * limits.turn_radius_m:
        raise InputError(
            f"the trajectory at {times[tightest]:.2f} s has a radius of {radius[tightest]:.2f} m, "
            f"expected turn_radius_m {limits.turn_radius_m} or more: make it wider"
        )


def _eased(
    drive: FloatArray, way: FloatArray, limits: Limits, *, repeats: bool, ends: bool
) -> FloatArray:
    """Speeds that can be braked for and gained; of what repeats, over its seam too."""
    squared = (drive**2).tolist()
    if ends:
        squared[-1] = 0.0
    gain = 2 * EASY * limits.acceleration_mps2
    loss = 2 * EASY * limits.deceleration_mps2
    steps = way.tolist()
    for _ in range(2 if repeats else 1):
        for k in range(len(squared) - 2, -1, -1):
            squared[k] = min(squared[k], squared[k + 1] + loss * steps[k])
        if repeats:
            squared[-1] = min(squared[-1], squared[0])
        for k in range(1, len(squared)):
            squared[k] = min(squared[k], squared[k - 1] + gain * steps[k - 1])
        if repeats:
            squared[0] = min(squared[0], squared[-1])
    return np.asarray(np.sqrt(squared))
