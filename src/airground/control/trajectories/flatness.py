"""A unicycle seen by a camera is flat: an image point and its two rates give heading, speed and turn rate (sec. 4.1).

With w the ground velocity, ``w = J^-1 c'`` and ``w' = J^-1 (c'' - J' w)``; then ``theta = atan2(w)``, ``v = |w|``,
``v' = h.w'`` and ``omega = h_perp.w' / v``. At v = 0 the image point does not tell the heading: there, theta and
omega are NaN, as they have no value of their own; what to do then is the tracker's business.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.geometry.limited import LimitedHomography

__all__ = ["FlatInputs", "flat_inputs", "flat_outputs"]


@dataclass(frozen=True, slots=True, eq=False)
class FlatInputs:
    """What drives the motion of an image point."""

    theta: FloatArray
    """(...) [rad]. Heading, -pi..pi; NaN at rest."""

    v: FloatArray
    """(...) [m/s]. Speed along the heading; negative in reverse."""

    omega: FloatArray
    """(...) [rad/s]. Turn rate; NaN at rest."""

    v_dot: FloatArray
    """(...) [m/s^2]. Acceleration along the heading; at rest, length of the acceleration with the gear's sign."""


def flat_inputs(
    model: LimitedHomography,
    uv: ArrayLike,
    uv_dot: ArrayLike,
    uv_ddot: ArrayLike,
    *,
    reverse: bool = False,
) -> FlatInputs:
    """Heading, speed and turn rate of a unicycle whose image point moves like this.

    Parameters
    ----------
    model : LimitedHomography
        The relation between image and ground.
    uv : (..., 2) array_like [px]
        Image points on visible ground.
    uv_dot : (..., 2) array_like [px/s]
        Their velocities.
    uv_ddot : (..., 2) array_like [px/s^2]
        Their accelerations.
    reverse : bool
        Whether it drives backwards.

    Returns
    -------
    inputs : FlatInputs
        Leading axes broadcast.

    Raises
    ------
    InputError
        If an array's last axis does not have two entries.
    """
    w = model.ground_velocity(points(uv, "uv"), points(uv_dot, "uv_dot"))
    bend = (model.jacobian_rate(uv, uv_dot) @ w[..., None])[..., 0]
    w_dot = model.ground_velocity(uv, points(uv_ddot, "uv_ddot") - bend)
    gear = -1.0 if reverse else 1.0
    speed = np.hypot(w[..., 0], w[..., 1])
    moving = speed > 0
    safe = np.where(moving, speed, np.nan)
    along = (w * w_dot).sum(axis=-1) / safe
    across = w[..., 0] * w_dot[..., 1] - w[..., 1] * w_dot[..., 0]
    theta = np.where(moving, np.arctan2(gear * w[..., 1], gear * w[..., 0]), np.nan)
    start = np.hypot(w_dot[..., 0], w_dot[..., 1])
    return FlatInputs(theta, gear * speed, across / safe**2, gear * np.where(moving, along, start))


def flat_outputs(
    model: LimitedHomography,
    uv: ArrayLike,
    theta: ArrayLike,
    v: ArrayLike,
    omega: ArrayLike,
    *,
    v_dot: ArrayLike = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Rates of the image point of a unicycle: the inverse of `flat_inputs`.

    Parameters
    ----------
    model : LimitedHomography
        The relation between image and ground.
    uv : (..., 2) array_like [px]
        Image points.
    theta : (...) array_like [rad]
        Headings.
    v : (...) array_like [m/s]
        Speeds along them.
    omega : (...) array_like [rad/s]
        Turn rates.
    v_dot : (...) array_like [m/s^2]
        Accelerations along the headings.

    Returns
    -------
    uv_dot : (..., 2) array [px/s]
        Velocities of the image points.
    uv_ddot : (..., 2) array [px/s^2]
        Their accelerations.

    Raises
    ------
    InputError
        If a shape does not broadcast.
    """
    try:
        theta, v, omega, v_dot = np.broadcast_arrays(
            *(np.asarray(a, dtype=np.float64) for a in (theta, v, omega, v_dot))
        )
    except ValueError as error:
        raise InputError(f"theta, v, omega and v_dot do not broadcast: {error}") from error
    h = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    h_perp = np.stack([-h[..., 1], h[..., 0]], axis=-1)
    w = v[..., None] * h
    w_dot = v_dot[..., None] * h + (v * omega)[..., None] * h_perp
    uv_dot = model.image_velocity(uv, w)
    bend = (model.jacobian_rate(uv, uv_dot) @ w[..., None])[..., 0]
    return uv_dot, model.image_velocity(uv, w_dot) + bend
