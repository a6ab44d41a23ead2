"""How a belief about a vehicle moves on with its commands, and what a measurement does to it: a Kalman filter's steps.

State: x, y [m], theta [rad], v [m/s], omega [rad/s], the scales a and b (true speed is ``1 + a`` times what the vehicle
means, true turn rate ``1 + b`` times), and the compass's bias [rad]. Under a command v_c for a time h::

    v     <-  r v + (1 - r) (1 + a) v_c           r = exp(-h / lag)
    s      =  lag (1 - r) v + (h - lag (1 - r)) (1 + a) v_c       distance; the turn likewise
    x, y  <-  x, y + the chord of an arc of length s that turns by the turn

Several commands in one step are followed one after the other; what is linear in v and 1 + a adds up exactly, and only
the heading in the middle of the step is approximate. Without a command v and omega wander. The speed sideways of what
drives in all directions follows its command exactly and is no part of the covariance.
"""

from __future__ import annotations

from math import cos, exp, hypot, inf, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.control.command import VelocityCommand
    from airground.control.estimation.options import StateOptions
    from airground.geometry.arrays import FloatArray

__all__ = ["BIAS", "LATERAL", "SIZE", "Gaussian", "Piece", "added", "moved", "place", "propagate"]

X, Y, THETA, V, OMEGA, SPEED_SCALE, TURN_SCALE, BIAS = range(8)
SIZE = 8
LATERAL = 8  # in the mean only
_EYE = np.eye(SIZE)
_MOVING = (THETA, V, OMEGA, SPEED_SCALE, TURN_SCALE)
_FILLED = np.ravel_multi_index(  # entries of F that a step fills, in the order of `propagate`
    np.transpose(
        [(row, column) for row in (X, Y) for column in _MOVING]
        + [(THETA, OMEGA), (THETA, TURN_SCALE), (V, V), (V, SPEED_SCALE)]
        + [(OMEGA, OMEGA), (OMEGA, TURN_SCALE)]
        + [(row, row) for row in (SPEED_SCALE, TURN_SCALE, BIAS)]
    ),
    (SIZE, SIZE),
)
_DOUBT = 0.2  # share of a change still under way by which the lag may be wrong

Piece = tuple[float, "VelocityCommand | None"]


class Gaussian(NamedTuple):
    """What is believed at one time: a mean and its covariance."""

    mean: tuple[float, ...]
    """x, y, theta, v, omega, scale of speed, scale of turn rate, bias, speed sideways."""

    covariance: FloatArray
    """(8, 8), without the speed sideways. Never written to: beliefs share it."""


class _Step(NamedTuple):
    """Where a step leads. A rate follows commands to ``kept rate + end (1 + scale)``; its way alike by own and told."""

    mean: tuple[float, ...]
    dt: float
    v: tuple[float, float, float, float]
    w: tuple[float, float, float, float]
    dx: float
    dy: float
    along_x: float
    along_y: float
    length: float
    fade: float


def _follow(lag: float, told: list[tuple[float, float]]) -> tuple[float, float, float, float]:
    """Kept, end, own and told of `_Step`."""
    kept, end, own, way = 1.0, 0.0, 0.0, 0.0
    for dt, command in told:
        r = exp(-dt / lag) if lag > 0 else 0.0
        reach = lag * (1 - r)
        way += reach * end + (dt - reach) * command
        own += reach * kept
        end = r * end + (1 - r) * command
        kept *= r
    return kept, end, own, way


def moved(
    mean: tuple[float, ...], pieces: Sequence[Piece], options: StateOptions
) -> tuple[float, ...]:
    """Mean after a step.

    Parameters
    ----------
    mean : (9,) tuple of float
        As in `Gaussian`.
    pieces : sequence of (float, VelocityCommand or None)
        Durations [s], 0.1 s or so together, and what was in effect; None in all of them where that is not known.
    options : StateOptions
        Of the vehicle.

    Returns
    -------
    mean : (9,) tuple of float
        Afterwards.
    """
    return _step(mean, pieces, options).mean


def propagate(belief: Gaussian, pieces: Sequence[Piece], options: StateOptions) -> Gaussian:
    """Belief after a step.

    Parameters
    ----------
    belief : Gaussian
        Before.
    pieces : sequence of (float, VelocityCommand or None)
        Durations [s], 0.1 s or so together, and what was in effect; None in all of them where that is not known.
    options : StateOptions
        Of the vehicle.

    Returns
    -------
    belief : Gaussian
        Afterwards, less certain.
    """
    step = _step(belief.mean, pieces, options)
    kept_v, end_v, own_v, told_v = step.v
    kept_w, end_w, own_w, told_w = step.w
    dx, dy, along_x, along_y, fade = step.dx, step.dy, step.along_x, step.along_y, step.fade
    half_own, half_told = 0.5 * own_w, 0.5 * told_w
    filled = (
        *(-dy, own_v * along_x, -half_own * dy, told_v * along_x, -half_told * dy),  # x
        *(dx, own_v * along_y, half_own * dx, told_v * along_y, half_told * dx),  # y
        *(own_w, told_w),  # theta
        *(kept_v, end_v),  # v
        *(kept_w, end_w),  # omega
        *(fade, fade, fade),  # scales and bias
    )
    F = _EYE.copy()
    F.put(_FILLED, filled)  # at once: a third of the time of one by one
    P = F.dot(belief.covariance).dot(F.T)
    diagonal = P.reshape(-1)[:: SIZE + 1]
    diagonal += _noise(belief.mean, pieces[-1][1], options, step)
    return Gaussian(step.mean, P)


def _step(mean: tuple[float, ...], pieces: Sequence[Piece], options: StateOptions) -> _Step:
    x, y, theta, v, omega, a, b, bias, lateral = mean
    a, b, dt, sideways = 1 + a, 1 + b, 0.0, lateral != 0
    v_told, w_told = [], []
    for h, c in pieces:
        dt += h
        if c is not None:
            v_told.append((h, c.v))
            w_told.append((h, c.omega))
            sideways = sideways or c.lateral != 0
    if v_told:
        follow_v = kept_v, end_v, own, told = _follow(options.speed_lag_s, v_told)
        s, v = own * v + told * a, kept_v * v + end_v * a
        follow_w = kept_w, end_w, own, told = _follow(options.turn_lag_s, w_told)
        turn, omega = own * omega + told * b, kept_w * omega + end_w * b
    else:
        follow_v = follow_w = 1.0, 0.0, dt, 0.0
        s, turn = v * dt, omega * dt
    half = 0.5 * turn
    shorter = sin(half) / half if abs(half) > 1e-6 else 1.0  # chord over arc
    along_x, along_y = shorter * cos(theta + half), shorter * sin(theta + half)
    dx, dy, length = s * along_x, s * along_y, abs(s)
    if sideways:
        told_side = [(h, c.lateral if c else 0.0) for h, c in pieces]
        kept, end, own, told = _follow(options.speed_lag_s, told_side)
        side, lateral = own * lateral + told * a, kept * lateral + end * a
        dx, dy, length = dx - side * along_y, dy + side * along_x, hypot(s, side)
    f = exp(-dt / options.drift_time_s)
    scales = (a - 1) * f, (b - 1) * f, bias * f
    after = (x + dx, y + dy, theta + turn, v, omega, *scales, lateral)
    return _Step(after, dt, follow_v, follow_w, dx, dy, along_x, along_y, length, f)


def _noise(
    mean: tuple[float, ...], command: VelocityCommand | None, options: StateOptions, step: _Step
) -> tuple[float, ...]:
    """Variances that a step adds: straying, wandering, and doubt about the lags while a command is being followed."""
    o, dt = options, step.dt
    if command is None:
        free_v, free_w = o.free_speed_mps**2 * dt, o.free_turn_radps**2 * dt
    else:
        v_c, w_c, kept_v, kept_w = command.v, command.omega, step.v[0], step.w[0]
        stray = o.speed_stray_mps**2 + (o.speed_stray * v_c) ** 2
        doubt = (_DOUBT * ((1 + mean[SPEED_SCALE]) * v_c - mean[V])) ** 2
        free_v = stray * (1 - kept_v * kept_v) + doubt * (1 - kept_v)
        stray = o.turn_stray_radps**2 + o.turn_stray**2 * (w_c * w_c + v_c * v_c)
        doubt = (_DOUBT * ((1 + mean[TURN_SCALE]) * w_c - mean[OMEGA])) ** 2
        free_w = stray * (1 - kept_w * kept_w) + doubt * (1 - kept_w)
    walk = o.path_walk_m**2 * step.length + 1e-8 * dt
    turn_walk = o.heading_walk_rad**2 * step.length + 1e-6 * dt
    renewed = 1 - step.fade * step.fade
    scale = o.scale_sigma**2 * renewed
    return (
        walk,
        walk,
        turn_walk,
        free_v,
        free_w,
        scale,
        scale,
        o.heading_bias_sigma_rad**2 * renewed,
    )


def place(
    belief: Gaussian,
    xy: tuple[float, float],
    R: tuple[float, float, float],
    options: StateOptions,
) -> tuple[float, Gaussian]:
    """Belief after the mark was seen at a ground point, and how unlikely that was.

    Parameters
    ----------
    belief : Gaussian
        Before.
    xy : (float, float) [m]
        Where the mark was seen.
    R : (float, float, float) [m^2]
        Covariance of that: xx, xy, yy.
    options : StateOptions
        Of the vehicle, for the lever arm.

    Returns
    -------
    gap : float
        Mahalanobis distance of the sighting.
    belief : Gaussian
        Afterwards.
    """
    P, mean = belief.covariance, belief.mean
    forward, left = options.lever_arm_m
    sine, cosine = sin(mean[THETA]), cos(mean[THETA])
    arm_x, arm_y = forward * cosine - left * sine, forward * sine + left * cosine
    residual = (xy[0] - mean[X] - arm_x, xy[1] - mean[Y] - arm_y)
    HP = P[:2]
    if forward or left:
        HP = HP + np.array([[-arm_y], [arm_x]]) * P[THETA]
    (p_xx, p_xy, p_xt), (_, p_yy, p_yt) = HP[:, :3].tolist()
    a = p_xx - arm_y * p_xt + R[0]
    b = p_xy + arm_x * p_xt + R[1]
    d = p_yy + arm_x * p_yt + R[2]
    det = a * d - b * b
    if not det > 0:
        return inf, belief
    rx, ry = residual
    distance = max(0.0, (d * rx * rx - 2 * b * rx * ry + a * ry * ry) / det) ** 0.5
    K = HP.T.dot(np.array([[d / det, -b / det], [-b / det, a / det]]))
    after = P - K.dot(HP)
    after = 0.5 * (after + after.T)  # keeps rounding from adding up
    return distance, Gaussian(added(mean, K.dot(residual).tolist()), after)


def added(mean: tuple[float, ...], shift: list[float]) -> tuple[float, ...]:
    """Mean after a correction.

    Parameters
    ----------
    mean : (9,) tuple of float
        As in `Gaussian`.
    shift : (8,) list of float
        What to add to all but the speed sideways.

    Returns
    -------
    mean : (9,) tuple of float
        Afterwards.
    """
    a, b, c, d, e, f, g, h, lateral = mean
    i, j, k, m, n, o, p, q = shift
    return a + i, b + j, c + k, d + m, e + n, f + o, g + p, h + q, lateral
