"""What an uncertain lens does to ground velocities, together with g.

A larger k1 and a g that undoes it in the driven region belong together: their errors are correlated, and taken apart
they say too much or too little. Both are differentiated here at fixed raw pixels, which is what is measured.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.observability import ground_velocity_covariance
from airground.geometry.velocity import (
    ground_velocity,
    image_velocity_by_point,
    image_velocity_gradient,
    velocity_jacobian,
)

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.geometry.lens import DivisionLens

__all__ = [
    "ground_velocity_by_k1",
    "joint_covariance",
    "raw_relative_sigma",
    "raw_velocity_covariance",
]


def joint_covariance(covariance: FloatArray, k1_covariance: FloatArray) -> FloatArray:
    """Put the covariances of g and of k1 together.

    Parameters
    ----------
    covariance : (6, 6) array
        Of g, row by row.
    k1_covariance : (7,) array
        Of k1 with g, row by row, then k1's own variance.

    Returns
    -------
    joint : (7, 7) array
        Of g, row by row, then k1.
    """
    joint = np.empty((7, 7))
    joint[:6, :6] = covariance
    joint[6], joint[:, 6] = k1_covariance, k1_covariance
    return joint


def ground_velocity_by_k1(
    g: FloatArray, lens: DivisionLens, uv: FloatArray, uv_dot: FloatArray
) -> FloatArray:
    """Derivative of ground velocities by k1, at fixed raw points, raw velocities and g.

    With c and c_dot the undistorted point and velocity, ``c_dot = J(c) xy_dot`` gives
    ``J d xy_dot = d c_dot - (d (J xy_dot) / d c) d c``.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography.
    lens : DivisionLens
        Where to differentiate.
    uv : (..., 2) array [px]
        Raw image points.
    uv_dot : (..., 2) array [px/s]
        Raw image velocities.

    Returns
    -------
    derivative : (..., 2) array [m px^2/s]
        NaN on the horizon and beyond the lens's limit.
    """
    c = lens.undistort(uv)
    xy_dot = ground_velocity(g, c, lens.undistort_velocity(uv, uv_dot))
    moved = np.einsum(
        "...ij,...j->...i", image_velocity_by_point(g, c, xy_dot), lens.undistort_by_k1(uv)
    )
    return ground_velocity(g, c, lens.undistort_velocity_by_k1(uv, uv_dot) - moved)


def raw_velocity_covariance(
    g: FloatArray,
    covariance: FloatArray,
    lens: DivisionLens | None,
    k1_covariance: FloatArray | None,
    *,
    uv: FloatArray,
    uv_dot: FloatArray,
) -> FloatArray:
    """Covariance of ground velocities of what is seen in raw pixels, to first order in g and k1.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography of the undistorted image.
    covariance : (6, 6) array
        Of g, row by row.
    lens : DivisionLens or None
        The lens, if it distorts.
    k1_covariance : (7,) array or None
        Of k1 with g, then its own variance; None takes k1 as exact.
    uv : (..., 2) array [px]
        Raw image points.
    uv_dot : (..., 2) array [px/s]
        Raw image velocities, taken as exact.

    Returns
    -------
    covariance : (..., 2, 2) array [m2/s2]
        NaN on the horizon and beyond the lens's limit.
    """
    c = uv if lens is None else lens.undistort(uv)
    c_dot = uv_dot if lens is None else lens.undistort_velocity(uv, uv_dot)
    xy_dot = ground_velocity(g, c, c_dot)
    c = np.broadcast_to(c, xy_dot.shape)
    if lens is None or k1_covariance is None:
        return ground_velocity_covariance(g, covariance, c, xy_dot)
    D = image_velocity_gradient(g, c, xy_dot).swapaxes(-1, -2)  # (..., 6, 2)
    by_g = -ground_velocity(g, c[..., None, :], D)
    by_k1 = ground_velocity_by_k1(g, lens, uv, uv_dot)[..., None, :]
    each = np.concatenate([by_g, by_k1], axis=-2)  # (..., 7, 2)
    joint = joint_covariance(covariance, k1_covariance)
    return np.asarray(each.swapaxes(-1, -2) @ joint @ each)


def raw_relative_sigma(
    g: FloatArray,
    covariance: FloatArray,
    lens: DivisionLens | None,
    k1_covariance: FloatArray | None,
    *,
    uv: FloatArray,
) -> FloatArray:
    """Relative standard deviation of a ground velocity at raw points, over all headings.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography of the undistorted image.
    covariance : (6, 6) array
        Of g, row by row.
    lens : DivisionLens or None
        The lens, if it distorts.
    k1_covariance : (7,) array or None
        Of k1 with g, then its own variance; None takes k1 as exact.
    uv : (N, 2) array [px]
        Raw image points on the ground.

    Returns
    -------
    sigma : (N,) array
        Root mean square over the headings; `observability.relative_sigma` is that over the points too.
    """
    if lens is None:
        J = velocity_jacobian(g, uv)
    else:
        c = lens.undistort(uv)
        J = lens.distort_jacobian(c) @ velocity_jacobian(g, c)
    # Two headings at right angles give the mean over all, as the error is linear in the velocity.
    uv_dot = np.moveaxis(J, -1, 0)  # (2, N, 2): what moves along x, what moves along y
    each = raw_velocity_covariance(g, covariance, lens, k1_covariance, uv=uv, uv_dot=uv_dot)
    return np.asarray(np.sqrt(np.mean(np.trace(each, axis1=-2, axis2=-1), axis=0)))
