"""What one robot's recording tells about g, when its path is eliminated.

What is unknown: g (6 numbers), for each robot the image point c0 of its start and its position P_i at every sighting,
with P_0 = 0, and nuisances. What is measured: sightings in pixels, by the finite form of eq. 15,

    c_i ~ c0 / (n.c0) + g P_i,    n = G1 x G2

and displacements from one sighting to the next, by readings with white and with slow noise:

    P_(i+1) - P_i = (truth) + K white + K_s slow + L nuisances

A path that is sighted more often than read is fixed between two readings, so the covariance of all displacements is
singular. The information is therefore the Schur complement of a saddle-point system, with one multiplier for each
displacement, which needs no inverse of that covariance. It is sparse and solved at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse  # type: ignore[import-untyped,unused-ignore]
from scipy.sparse.linalg import splu  # type: ignore[import-untyped,unused-ignore]

from airground.geometry.arrays import FloatArray
from airground.sim.recordings import distort

if TYPE_CHECKING:
    from airground.sim.camera import SimCamera

__all__ = ["RobotPart", "shared_information", "sighting_derivatives"]

COMPLEX_STEP = 1e-30  # exact to rounding: nothing is subtracted


@dataclass(frozen=True, slots=True, eq=False)
class RobotPart:
    """One robot's part of the problem, linear at the truth."""

    on_path: FloatArray
    """(N, 2, 2) [px/m]. Of each sighting by its position."""

    on_shared: FloatArray
    """(2N, S). Of the sightings by g and what else all robots share."""

    on_own: FloatArray
    """(2N, T). Of the sightings by what is the robot's own: c0, its lever arm, its scale and bias."""

    sigma_px: float
    """Of each coordinate of a sighting [px]."""

    white: Any
    """Sparse (2(N-1), 2(N-1)) [m^2]. Covariance of the displacements by white noise; x and y of each in turn."""

    shared_steps: FloatArray
    """(2(N-1), S) [m]. Of the measured displacements by what is shared."""

    own_steps: FloatArray
    """(2(N-1), T) [m]. Of the measured displacements by what is the robot's own."""

    own_precision: FloatArray
    """(T,). Of the priors of what is its own."""

    slow: Any = None
    """Sparse (2(N-1), R) [m]. Of the displacements by slow noise; None where there is none."""

    slow_precision: Any = None
    """Sparse (R, R). Of the slow noise."""


def sighting_derivatives(
    camera: SimCamera,
    xy: FloatArray,
    theta: FloatArray,
    *,
    lever: FloatArray | None = None,
    k1: float = 0.0,
    centre: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives of all sightings at the truth, by a complex step.

    Parameters
    ----------
    camera : SimCamera
        Truth.
    xy : (N, 2) array [m]
        Ground positions of the axle.
    theta : (N,) array [rad]
        Headings.
    lever : (2,) array, optional [m]
        Of the tracked point, forward and to the left; zero where not given.
    k1 : float [1/px^2]
        Of the lens.
    centre : (2,) array, optional [px]
        Of the lens.

    Returns
    -------
    on_path : (N, 2, 2) array [px/m]
        By the position at each.
    on_shared : (2N, 7) array
        By g, row by row, and k1; u and v in turn.
    on_own : (2N, 4) array
        By c0 and the lever arm.
    """
    path = xy - xy[0]
    forward = np.column_stack([np.cos(theta), np.sin(theta)])
    left = np.column_stack([-forward[:, 1], forward[:, 0]])
    middle = np.zeros(2) if centre is None else centre
    start = np.zeros(2) if lever is None else lever
    truth = np.concatenate([camera.g.ravel(), [k1], camera.project(xy[0]), start])

    def see(x: NDArray[Any], P: NDArray[Any]) -> NDArray[Any]:
        g, c0 = x[:6].reshape(3, 2), np.append(x[7:9], 1.0)
        n = np.cross(g[:, 0], g[:, 1])
        w = c0 / (n @ c0) + (P + x[9] * forward + x[10] * left) @ g.T
        return _through_lens(w[:, :2] / w[:, 2:], x[6], middle)

    def derivative(k: int) -> FloatArray:
        nudged = truth.astype(np.complex128)
        nudged[k] += 1j * COMPLEX_STEP
        return np.asarray(see(nudged, path).imag / COMPLEX_STEP)

    columns = np.stack([derivative(k).ravel() for k in range(len(truth))], axis=1)
    on_path = np.stack(
        [see(truth, path + 1j * COMPLEX_STEP * e).imag / COMPLEX_STEP for e in np.eye(2)], axis=-1
    )
    return on_path, columns[:, :7], columns[:, 7:]


def _through_lens(uv: NDArray[Any], k1: Any, centre: FloatArray) -> NDArray[Any]:
    """`distort`, for complex numbers too; it knows its own derivative by k1 at k1 = 0."""
    if not np.iscomplexobj(uv) and not np.iscomplexobj(k1):
        return distort(uv, float(k1), centre)
    off = uv - centre
    square = np.sum(off * off, axis=-1, keepdims=True)
    return np.asarray(centre + off * (2 / (1 + np.sqrt(1 - 4 * k1 * square))))


def shared_information(robot: RobotPart) -> FloatArray:
    """Information on what all robots share, when all else is eliminated.

    Least squares under constraints: with pixels A P + B x, displacements D P = K white + K_s slow + L x, whose white
    noise has covariance C, and slow noise of precision Q, the stationary point in P, slow and the multipliers obeys

        [A^T A   0     D^T ] [P   ]     [A^T B]
        [0       Q    -K_s^T] [slow] = - [0    ] x
        [D      -K_s  -C   ] [mult]     [-L   ]

    and the information on x is B^T B - (right side)^T (matrix)^-1 (right side).

    Parameters
    ----------
    robot : RobotPart
        The problem, linear at the truth.

    Returns
    -------
    information : (S, S) array
        Of g and what else is shared.
    """
    count = len(robot.on_path)
    unit = (
        float(np.sqrt(robot.white.diagonal().mean())) or 1.0
    )  # m; so that all blocks are of size 1
    A = sparse.block_diag(list(robot.on_path[1:] * (unit / robot.sigma_px)), format="csc")
    B = np.hstack([robot.on_shared, robot.on_own]) / robot.sigma_px
    L = np.hstack([robot.shared_steps, robot.own_steps]) / unit
    D = sparse.kron(
        sparse.diags_array([np.ones(count - 1), -np.ones(count - 2)], offsets=[0, -1]), np.eye(2)
    )
    C = robot.white / unit**2
    if robot.slow is None:
        blocks = [[A.T @ A, D.T], [D, -C]]
        slow_count = 0
    else:
        K, Q = robot.slow / unit, robot.slow_precision
        blocks = [[A.T @ A, None, D.T], [None, Q, -K.T], [D, -K, -C]]
        slow_count = Q.shape[0]
    right = np.vstack([A.T @ B[2:], np.zeros((slow_count, B.shape[1])), -L])
    solved = splu(sparse.block_array(blocks, format="csc")).solve(right)
    information = B.T @ B - right.T @ solved
    shared = robot.on_shared.shape[1]
    own = information[shared:, shared:] + np.diag(robot.own_precision)
    border = information[:shared, shared:]
    return np.asarray(information[:shared, :shared] - border @ np.linalg.solve(own, border.T))
