"""Velocities in the image and on the ground (paper, section 2, eqs. 13 to 15).

With g scaled to unit determinant (eq. 21), n = G1 x G2 and c = (u, v, 1), eq. 15 reads::

    uv_dot = J(c) xy_dot,      J(c) = (n.c) (A - (u, v) b),      g = [A; b],  A 2x2, b 1x2

As det(A - (u, v) b) = n.c, det J = (n.c)^3 and the inverse needs no elimination. The sign of n.c is one for
all visible ground: negative for right-handed ground frames, as v points down; see docs/conventions.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.geometry.arrays import FloatArray

__all__ = [
    "ground_velocity",
    "horizon_line",
    "image_velocity",
    "image_velocity_by_point",
    "image_velocity_gradient",
    "nearness",
    "velocity_jacobian",
    "velocity_jacobian_rate",
]

_EYE = np.eye(2)


def horizon_line(g: FloatArray) -> FloatArray:
    """Image of the ground's line at infinity, G1 x G2: H3 of eq. 14 when det(G) = 1.

    Parameters
    ----------
    g : (..., 3, 2) array
        Limited homography.

    Returns
    -------
    n : (..., 3) array
        Line n.c = 0.
    """
    if g.ndim == 2:  # one g in plain numbers: a tenth of the time
        (a, b), (c, d), (e, f) = g.tolist()
        return np.array([c * f - e * d, e * b - a * f, a * d - c * b])
    return _cross(g[..., 0], g[..., 1])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Vector product along the last axis, written out: that of NumPy takes four times as long for one pair."""
    (a0, a1, a2), (b0, b1, b2) = ((x[..., 0], x[..., 1], x[..., 2]) for x in (a, b))
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def nearness(g: FloatArray, uv: ArrayLike) -> FloatArray:
    """H3.c of eq. 12: the inverse of the depth, up to a constant; zero on the horizon.

    Parameters
    ----------
    g : (..., 3, 2) array
        Limited homography, scaled as in eq. 21.
    uv : (..., 2) array_like [px]
        Image points.

    Returns
    -------
    nc : (...) array
        One sign on the visible side of the horizon, the other beyond it.
    """
    uv = points(uv, "uv")
    n = horizon_line(g)
    return np.asarray(uv[..., 0] * n[..., 0] + uv[..., 1] * n[..., 1] + n[..., 2])


def _reduced(g: FloatArray, uv: FloatArray) -> FloatArray:
    """A - (u, v) b of the module's formula: [I | -(u, v)] (G1 G2)."""
    return np.asarray(g[..., :2, :] - uv[..., :, None] * g[..., 2:, :])


def velocity_jacobian(g: FloatArray, uv: ArrayLike) -> FloatArray:
    """Derivative of the image point by the ground point (eq. 15).

    Parameters
    ----------
    g : (..., 3, 2) array
        Limited homography, scaled as in eq. 21.
    uv : (..., 2) array_like [px]
        Image points.

    Returns
    -------
    J : (..., 2, 2) array [px/m]
        ``uv_dot = J @ xy_dot``; singular on the horizon only.
    """
    uv = points(uv, "uv")
    return np.asarray(nearness(g, uv)[..., None, None] * _reduced(g, uv))


def velocity_jacobian_rate(g: FloatArray, uv: ArrayLike, uv_dot: ArrayLike) -> FloatArray:
    """Rate of `velocity_jacobian` along a motion in the image.

    Parameters
    ----------
    g : (..., 3, 2) array
        Limited homography, scaled as in eq. 21.
    uv : (..., 2) array_like [px]
        Image points.
    uv_dot : (..., 2) array_like [px/s]
        Their velocities.

    Returns
    -------
    J_dot : (..., 2, 2) array [px/m/s]
        ``uv_ddot = J @ xy_ddot + J_dot @ xy_dot``.
    """
    uv, uv_dot = points(uv, "uv"), points(uv_dot, "uv_dot")
    n = horizon_line(g)
    nc_dot = uv_dot[..., 0] * n[..., 0] + uv_dot[..., 1] * n[..., 1]
    turning = uv_dot[..., :, None] * g[..., 2:, :]  # c' b
    return np.asarray(
        nc_dot[..., None, None] * _reduced(g, uv) - nearness(g, uv)[..., None, None] * turning
    )


def image_velocity(g: FloatArray, uv: ArrayLike, xy_dot: ArrayLike) -> FloatArray:
    """Velocity in the image of what moves at `xy_dot` on the ground (eq. 15).

    Parameters
    ----------
    g : (..., 3, 2) array
        Limited homography, scaled as in eq. 21.
    uv : (..., 2) array_like [px]
        Image points.
    xy_dot : (..., 2) array_like [m/s]
        Ground velocities.

    Returns
    -------
    uv_dot : (..., 2) array [px/s]
        Image velocities; zero on the horizon.
    """
    uv, xy_dot = points(uv, "uv"), points(xy_dot, "xy_dot")
    heading = np.einsum("...ij,...j->...i", g, xy_dot)  # G w-dot, the vanishing point
    return np.asarray(
        nearness(g, uv)[..., None] * (heading[..., :2] - uv * heading[..., 2:])  # eq. 15
    )


def ground_velocity(g: FloatArray, uv: ArrayLike, uv_dot: ArrayLike) -> FloatArray:
    """Velocity on the ground of what moves at `uv_dot` in the image: eq. 15, inverted.

    Parameters
    ----------
    g : (..., 3, 2) array
        Limited homography, scaled as in eq. 21.
    uv : (..., 2) array_like [px]
        Image points.
    uv_dot : (..., 2) array_like [px/s]
        Image velocities.

    Returns
    -------
    xy_dot : (..., 2) array [m/s]
        Ground velocities; NaN on the horizon, where nothing can be said.
    """
    uv, uv_dot = points(uv, "uv"), points(uv_dot, "uv_dot")
    M = _reduced(g, uv)
    a, b, c, d = M[..., 0, 0], M[..., 0, 1], M[..., 1, 0], M[..., 1, 1]
    x, y = uv_dot[..., 0], uv_dot[..., 1]
    adjugate = np.stack([d * x - b * y, a * y - c * x], axis=-1)
    nc = nearness(g, uv)[..., None]
    squared = np.where(nc == 0.0, np.nan, nc) ** 2  # (n.c) det(A - (u, v) b) = (n.c)^2
    return np.asarray(adjugate / squared)


def image_velocity_gradient(g: FloatArray, uv: ArrayLike, xy_dot: ArrayLike) -> FloatArray:
    """Derivative of eq. 15 by the entries of g, row by row.

    Parameters
    ----------
    g : (..., 3, 2) array
        Limited homography, scaled as in eq. 21.
    uv : (..., 2) array_like [px]
        Image points.
    xy_dot : (..., 2) array_like [m/s]
        Ground velocities.

    Returns
    -------
    D : (..., 2, 6) array
        ``D[..., k, 2 * i + j]`` is the derivative of component k by ``g[i, j]``.
    """
    uv, xy_dot = points(uv, "uv"), points(xy_dot, "xy_dot")
    heading = np.einsum("...ij,...j->...i", g, xy_dot)
    image = heading[..., :2] - uv * heading[..., 2:]  # [I | -(u, v)] g w
    u, v = uv[..., 0], uv[..., 1]
    (a, b), (c, d), (e, f) = ((g[..., k, 0], g[..., k, 1]) for k in range(3))
    # (n.c) is a triple product: its derivative by G1 is G2 x c, by G2 it is c x G1.
    by_g = (d - f * v, e * v - c, f * u - b, a - e * u, b * v - d * u, c * u - a * v)
    nc_g = np.stack(by_g, axis=-1)
    nc_g = nc_g.reshape(*nc_g.shape[:-1], 1, 3, 2)
    total = image[..., :, None, None] * nc_g  # (..., 2, 3, 2)
    turn = nearness(g, uv)[..., None] * xy_dot  # n.c times the derivative of g w
    total[..., 0, 0, :] += turn
    total[..., 1, 1, :] += turn
    total[..., 2, :] -= uv[..., :, None] * turn[..., None, :]
    return np.asarray(total.reshape(*total.shape[:-3], 2, 6))


def image_velocity_by_point(g: FloatArray, uv: ArrayLike, xy_dot: ArrayLike) -> FloatArray:
    """Derivative of eq. 15 by the image point, at a fixed ground velocity.

    Parameters
    ----------
    g : (..., 3, 2) array
        Limited homography, scaled as in eq. 21.
    uv : (..., 2) array_like [px]
        Image points.
    xy_dot : (..., 2) array_like [m/s]
        Ground velocities.

    Returns
    -------
    D : (..., 2, 2) array [1/s]
        ``D[..., k, i]`` is the derivative of component k by coordinate i of the point.
    """
    uv, xy_dot = points(uv, "uv"), points(xy_dot, "xy_dot")
    heading = np.einsum("...ij,...j->...i", g, xy_dot)
    image = heading[..., :2] - uv * heading[..., 2:]
    turn = (nearness(g, uv) * heading[..., 2])[..., None, None] * _EYE
    return np.asarray(image[..., :, None] * horizon_line(g)[..., None, :2] - turn)
