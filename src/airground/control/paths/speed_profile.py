"""How fast to drive along a path: as fast as wanted and as all limits allow, in metres and seconds.

With x = v^2 and the acceleration u = x' / 2 (by arc length), the bounds on speed, turn rate and lateral acceleration
are bounds on x, and those on acceleration and turn acceleration are linear in x and u: ``|kappa' x + kappa u|`` for
the latter. Standing still keeps all of them, so the speeds from which the end can be reached are 0 up to some k at
each sample. One pass backwards finds k, and one forwards drives as fast as k allows (Pham and Pham 2018, TOPP-RA,
with its linear programs solved by hand).
"""

from __future__ import annotations

from math import inf, sqrt
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, numbers, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.control.limits import Limits

__all__ = ["speed_profile", "travel_times", "turn_time"]

_KEPT = 0.1
"""Of the square of the speed that is left at least after one interval: there is no rest within a path."""

_ROUNDS = 12
"""Of slowing down where the turn acceleration, by differences of the answer, is above its limit."""


def speed_profile(
    s: ArrayLike,
    curvature: ArrayLike,
    limits: Limits,
    *,
    wanted_mps: ArrayLike | None = None,
    closed: bool = False,
    start_mps: float = 0.0,
    end_mps: float = 0.0,
    direction: int = 1,
) -> FloatArray:
    """Fastest speeds along a path within the limits.

    The acceleration is constant from sample to sample. The curvature counts as linear between samples, so they must
    be dense enough to show it.

    Parameters
    ----------
    s : (M,) array_like [m]
        Arc length at the samples, increasing.
    curvature : (M,) array_like [1/m]
        Of the path there; either sign.
    limits : Limits
        Of the robot.
    wanted_mps : () or (M,) array_like, optional [m/s]
        Upper bounds by wish; NaN or infinity where there is none.
    closed : bool
        Whether the last sample is the first again, to be passed at speed; start and end speeds do not count then.
    start_mps, end_mps : float [m/s]
        Speeds at the ends; infinity for as fast as can be. A start too fast for what follows is lowered.
    direction : int
        1 forwards, -1 in reverse, where `Limits.reverse_mps` bounds the speed, if it is not 0.

    Returns
    -------
    speed : (M,) array [m/s]
        Positive everywhere but at ends where rest is asked for.

    Raises
    ------
    InputError
        If the arrays do not fit, `s` does not increase, or a wanted speed is not positive.
    """
    s = readonly(s, (None,), "s")
    kappa = readonly(curvature, s.shape, "curvature")
    if len(s) < 2 or not (np.diff(s) > 0).all():
        raise InputError("s must have two entries or more, each larger than the one before")
    top = _speed_bounds(kappa, limits, wanted_mps, direction) ** 2
    if closed and top[0] != top[-1]:
        top[0] = top[-1] = min(top[0], top[-1])
    h = np.diff(s)
    x = top
    for _ in range(_ROUNDS):
        x = _fastest(h, kappa, top, limits, (None if closed else (start_mps**2, end_mps**2)))
        excess = _turn_acceleration(h, kappa, np.sqrt(x)) / limits.turn_acceleration_radps2
        if not (excess > 1.0005).any():
            break
        less = 1.0 / np.maximum(excess, 1.0)
        top = np.minimum(top, x * np.minimum(np.append(less, less[-1]), np.append(less[0], less)))
        if closed:
            top[0] = top[-1] = min(top[0], top[-1])
    return np.sqrt(x)


def _speed_bounds(
    kappa: FloatArray, limits: Limits, wanted_mps: ArrayLike | None, direction: int
) -> FloatArray:
    backwards = direction < 0 and limits.reverse_mps > 0
    bounds = np.full(kappa.shape, limits.reverse_mps if backwards else limits.speed_mps)
    if wanted_mps is not None:
        wanted = numbers(wanted_mps, "speed_mps")
        if wanted.shape not in ((), kappa.shape):
            raise InputError(f"speed_mps must be one number or one for each of {len(kappa)} points")
        if (wanted <= 0).any():
            raise InputError("speed_mps must be positive; leave it out where there is no wish")
        bounds = np.fmin(bounds, wanted)
    bend = np.maximum(np.abs(kappa), 1e-12)
    bounds = np.minimum(bounds, np.sqrt(limits.lateral_acceleration_mps2 / bend))
    return np.asarray(np.minimum(bounds, limits.turn_rate_radps / bend))


def _turn_acceleration(h: FloatArray, kappa: FloatArray, v: FloatArray) -> FloatArray:
    """Differences of the turn rate over the times that the intervals take, (M - 1,) [rad/s^2]."""
    omega = kappa * v
    return np.asarray(np.abs(np.diff(omega)) * (v[1:] + v[:-1]) / (2 * h))


def _fastest(
    h: FloatArray,
    kappa: FloatArray,
    top: FloatArray,
    limits: Limits,
    ends: tuple[float, float] | None,
) -> FloatArray:
    """Squares of the speeds, by the two passes; `ends` are None for a closed path."""
    gain, loss, alpha = (
        limits.acceleration_mps2,
        limits.deceleration_mps2,
        limits.turn_acceleration_radps2,
    )
    # Turn acceleration over one interval, from its end values: kappa_e u + kappa' x.
    rate = np.diff(kappa) / h
    bend = kappa[1:] + 0.5 * np.diff(kappa)
    tight = np.abs(bend)
    rate = np.where(bend < 0, -rate, rate)  # as if all curves were to the left
    with np.errstate(divide="ignore", invalid="ignore"):
        # The bounds on u must leave room between them; each pair of a lower and an upper one bounds x.
        rising = np.where(rate > 0, (alpha + loss * tight) / rate, inf)
        kept = np.full(len(h), 1 - _KEPT)
        if ends is not None:
            kept[-1] = 1.0
        steep = rate - kept * tight / (2 * h)
        rising = np.minimum(rising, np.where(steep > 0, alpha / steep, inf))
        falling = np.where(rate < 0, (alpha + gain * tight) / -rate, inf)
    top = top.copy()
    top[:-1] = np.minimum(top[:-1], np.minimum(rising, falling))
    count = len(h)
    two_h, tight_, rate_ = (2 * h).tolist(), tight.tolist(), rate.tolist()
    bound: list[float] = top.tolist()
    if ends is not None:
        bound[0] = min(bound[0], ends[0])
        bound[-1] = min(bound[-1], ends[1])
    for _ in range(1 if ends is not None else 3):  # a closed path: until it meets itself
        for i in range(count - 1, -1, -1):
            step, after = two_h[i], bound[i + 1]
            most = after + step * loss
            room = tight_[i] - step * rate_[i]
            if room > 0:
                most = min(most, (after * tight_[i] + step * alpha) / room)
            bound[i] = min(bound[i], most)
        if ends is None:
            bound[-1] = min(bound[-1], bound[0])
    x = bound
    for _ in range(1 if ends is not None else 10):
        for i in range(count):
            step, here = two_h[i], x[i]
            most = here + step * gain
            if tight_[i] > 0:
                most = min(most, here + step * (alpha - rate_[i] * here) / tight_[i])
            if most < x[i + 1]:
                x[i + 1] = max(most, 0.0)
        if ends is None:
            if x[-1] >= x[0] * (1 - 1e-12):
                break
            x[0] = x[-1]
    return np.array(x)


def travel_times(s: ArrayLike, speed: ArrayLike) -> FloatArray:
    """When samples of a path are passed, with a constant acceleration between them.

    Parameters
    ----------
    s : (M,) array_like [m]
        Arc length at the samples, not decreasing.
    speed : (M,) array_like [m/s]
        Speed there; not zero at both ends of an interval, unless its length is.

    Returns
    -------
    time : (M,) array [s]
        0 at the first.
    """
    h = np.diff(numbers(s, "s"))
    v = numbers(speed, "speed")
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.where(h > 0, 2 * h / (v[1:] + v[:-1]), 0.0)
    return np.concatenate([[0.0], np.cumsum(steps)])


def turn_time(angle: float, limits: Limits) -> float:
    """How long a turn on the spot takes, from rest to rest.

    Parameters
    ----------
    angle : float [rad]
        To turn by; either sign.
    limits : Limits
        Of the robot.

    Returns
    -------
    time : float [s]
        The least within the turn rate and its acceleration.
    """
    angle = abs(angle)
    rate, gain = limits.turn_rate_radps, limits.turn_acceleration_radps2
    if angle * gain < rate * rate:
        return 2 * sqrt(angle / gain)
    return angle / rate + rate / gain
