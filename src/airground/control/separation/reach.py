"""What robots can be told for the next step, and the ground that each then needs to come to rest.

A robot with body velocity b, turn rate omega and reaction time t_r comes to rest along a curve from its place p that
lies in the stadium around the segment from p to ``p + R(theta) b (t_r + |b| / (2 a))``, whose radius is widened by its
length times the angle ``omega t_r + omega^2 / (2 alpha)`` that it still turns. While a robot brakes, its new stadium
lies in its old one: if those of two robots are apart, each can stop at any time, alone or not, and they stay apart.

Points and vectors of the ground are complex numbers here, x + iy: half the calls, and those take the time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.control.separation.types import Body

__all__ = [
    "ComplexArray",
    "Fleet",
    "Motion",
    "Stadium",
    "braked",
    "dot",
    "fleet",
    "reachable",
    "stop_after",
    "within",
]

ComplexArray = NDArray[np.complex128]


class Motion(NamedTuple):
    """How robots move, or are told to."""

    drive: ComplexArray
    """(..., N) [m/s]. Along the heading, plus i times along the heading plus 90 degrees."""

    turn: FloatArray
    """(..., N) [rad/s]. Rate of the heading."""


class Fleet(NamedTuple):
    """Robots as arrays."""

    at: ComplexArray
    """(N,) [m]. Positions."""

    theta: FloatArray
    """(N,) [rad]. Headings."""

    motion: Motion
    """How they move now."""

    radius: FloatArray
    """(N,) [m]. Discs that hold them."""

    sigma: FloatArray
    """(N,) [m]. Deviations of the positions."""

    omni: NDArray[np.bool_]
    """(N,). Who drives sideways too."""

    speed: FloatArray
    """(N,) [m/s]. Limit forward."""

    reverse: FloatArray
    """(N,) [m/s]. Limit in reverse."""

    turn: FloatArray
    """(N,) [rad/s]. Limit of the turn rate."""

    gain: FloatArray
    """(N,) [m/s^2]. Limit of the gain of speed."""

    loss: FloatArray
    """(N,) [m/s^2]. Limit of the loss of speed."""

    turn_gain: FloatArray
    """(N,) [rad/s^2]. Limit of the change of the turn rate."""

    sideways: FloatArray
    """(N,) [m/s^2]. Limit of speed times turn rate."""

    bend: FloatArray
    """(N,) [1/m]. Largest curvature that can be driven; infinite for what is no car."""

    facing: ComplexArray
    """(N,). Unit vectors along the headings."""

    pace: FloatArray
    """(N,) [m/s]. How fast they move now."""

    any_omni: bool
    """Whether one of them drives sideways."""

    any_car: bool
    """Whether one of them is a car."""


class Stadium(NamedTuple):
    """Ground that robots need, their own discs left out."""

    start: ComplexArray
    """(..., N) [m]. Where they are."""

    end: ComplexArray
    """(..., N) [m]. Where they come to rest if they stop turning at once."""

    wide: FloatArray
    """(..., N) [m]. Radius by which the segment is widened, because they do not."""

    def extent(self, who: NDArray[np.intp], normal: ComplexArray) -> FloatArray:
        """How far it reaches along a direction.

        Parameters
        ----------
        who : (M,) array of int
            Robots.
        normal : (M,) complex array
            Unit vectors.

        Returns
        -------
        extent : (..., M) array [m]
            Largest of normal.p over it.
        """
        along = normal.conj()
        near, far = (along * self.start[..., who]).real, (along * self.end[..., who]).real
        return np.asarray(np.maximum(near, far) + self.wide[..., who])


def dot(a: ComplexArray, b: ComplexArray) -> FloatArray:
    """Scalar product of vectors.

    Parameters
    ----------
    a, b : (...) complex array
        Vectors.

    Returns
    -------
    product : (...) array
        Real part of conj(a) b.
    """
    return np.asarray((a.conj() * b).real)


def fleet(bodies: Sequence[Body]) -> Fleet:
    """Robots as arrays.

    Parameters
    ----------
    bodies : sequence of Body
        With numbers, no NaN.

    Returns
    -------
    robots : Fleet
        In the same order.
    """
    rows, any_omni, any_car = [], False, False
    for b in bodies:
        m = b.limits
        any_omni, any_car = any_omni or b.omnidirectional, any_car or m.turn_radius_m > 0
        bend = 1.0 / m.turn_radius_m if m.turn_radius_m > 0 else np.inf
        rows.append(
            (*b.xy, b.theta, b.v, b.lateral, b.omega, b.radius_m, b.sigma_m, b.omnidirectional)
            + (m.speed_mps, m.reverse_mps, m.turn_rate_radps, m.acceleration_mps2)
            + (m.deceleration_mps2, m.turn_acceleration_radps2, m.lateral_acceleration_mps2, bend)
        )
    x, y, theta, v, lateral, omega, radius, sigma, omni, *limits = np.array(rows).T
    motion = Motion(v + 1j * lateral, omega)
    facing, pace = np.exp(1j * theta), np.abs(motion.drive)
    numbers = (*limits, facing, pace, any_omni, any_car)
    return Fleet(x + 1j * y, theta, motion, radius, sigma, omni > 0, *numbers)


def braked(robots: Fleet, dt: float) -> Motion:
    """Motion after a step of braking as hard as the limits allow.

    Parameters
    ----------
    robots : Fleet
        As they move now.
    dt : float [s]
        The step.

    Returns
    -------
    motion : Motion
        Slower, in the same direction; a car keeps to its turn radius.
    """
    (drive, turn), pace = robots.motion, robots.pace
    left = np.maximum(pace - robots.loss * dt, 0.0)
    rate = np.maximum(np.abs(turn) - robots.turn_gain * dt, 0.0)
    if robots.any_car:
        rate = np.minimum(rate, _curving(robots, left))
    return Motion(drive * (left / np.maximum(pace, 1e-12)), np.copysign(rate, turn))


def reachable(robots: Fleet, wanted: Motion, dt: float) -> Motion:
    """Motion nearest to what is wanted that the limits allow after a step.

    Parameters
    ----------
    robots : Fleet
        As they move now.
    wanted : Motion
        What they shall do; leading axes for alternatives.
    dt : float [s]
        The step.

    Returns
    -------
    motion : Motion
        Through zero only by a stop: a change of direction takes one step more.
    """
    goal = within(robots, wanted)
    v, omega = robots.motion.drive.real, robots.motion.turn
    up, down = robots.gain * dt, robots.loss * dt
    low = np.where(v > 0, np.maximum(v - down, 0.0), v - up)
    high = np.where(v < 0, np.minimum(v + down, 0.0), v + up)
    speed = np.minimum(np.maximum(goal.drive.real, low), high)
    drive, pace = speed.astype(np.complex128), np.abs(speed)
    if robots.any_omni:
        change = goal.drive - robots.motion.drive
        slows = robots.pace > np.abs(goal.drive)
        most = np.where(slows, down, np.minimum(up, down))
        change = change * np.minimum(1.0, most / np.maximum(np.abs(change), 1e-12))
        drive = np.where(robots.omni, robots.motion.drive + change, drive)
        pace = np.abs(drive)
    most = _most_turn(robots, pace)
    step = robots.turn_gain * dt
    turn = np.minimum(np.maximum(wanted.turn, -most), most)
    turn = np.minimum(np.maximum(turn, omega - step), omega + step)
    if robots.any_car:  # one that slows down with its wheels turned cannot but turn less
        most = _curving(robots, pace)
        turn = np.minimum(np.maximum(turn, -most), most)
    return Motion(drive, turn)


def within(robots: Fleet, wanted: Motion) -> Motion:
    """Motion nearest to what is wanted within all limits but those of accelerations.

    Parameters
    ----------
    robots : Fleet
        Whose limits.
    wanted : Motion
        What they shall do.

    Returns
    -------
    motion : Motion
        No lateral speed for what has none.
    """
    speed = np.minimum(np.maximum(wanted.drive.real, -robots.reverse), robots.speed)
    drive, pace = speed.astype(np.complex128), np.abs(speed)
    if robots.any_omni:
        fast = np.maximum(np.abs(wanted.drive), 1e-12)
        slowed = wanted.drive * np.minimum(1.0, robots.speed / fast)
        drive = np.where(robots.omni, slowed, drive)
        pace = np.abs(drive)
    most = _most_turn(robots, pace)
    return Motion(drive, np.minimum(np.maximum(wanted.turn, -most), most))


def _most_turn(robots: Fleet, pace: FloatArray) -> FloatArray:
    fast = np.minimum(robots.turn, robots.sideways / np.maximum(pace, 1e-9))
    return np.minimum(fast, _curving(robots, pace)) if robots.any_car else fast


def _curving(robots: Fleet, pace: FloatArray) -> FloatArray:
    """Turn rate that the smallest turn radius leaves."""
    return np.asarray(np.where(np.isinf(robots.bend), np.inf, np.minimum(robots.bend, 1e12) * pace))


def stop_after(robots: Fleet, motion: Motion, dt: float, reaction_s: float) -> Stadium:
    """Ground that robots need after a step.

    Parameters
    ----------
    robots : Fleet
        As they move now.
    motion : Motion
        What they are told: speeds at the end of the step; leading axes for alternatives.
    dt : float [s]
        The step.
    reaction_s : float [s]
        Time before they would begin to brake then.

    Returns
    -------
    needed : Stadium
        Gains of speed are taken to act at once, losses to take all of the step.
    """
    (old, old_turn), (new, new_turn) = robots.motion, motion
    pace, rate = np.abs(new), np.abs(new_turn)
    mean = np.where(pace <= robots.pace, (old + new) / 2, new) * dt
    turned = np.where(rate <= np.abs(old_turn), (old_turn + new_turn) / 2, new_turn) * dt
    half = np.exp(0.5j * turned)
    middle = half * robots.facing
    start = robots.at + mean * middle
    time = reaction_s + pace / (2 * robots.loss)
    turns = rate * (reaction_s + rate / (2 * robots.turn_gain))
    if robots.any_omni:
        # wheels that brake each for itself bend the way of what drives sideways
        v, lateral = np.abs(new.real), np.abs(new.imag)
        turns = turns + v * lateral * np.abs(v - lateral) / np.maximum(pace, 1e-9) ** 3
    return Stadium(start, start + new * time * (half * middle), pace * time * turns)
