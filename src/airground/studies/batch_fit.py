"""Many small whole drives at once: Gauss-Newton for g and the positions, all trials in one array.

What is minimised is what `airground.calibration.trajectory` minimises where clocks, lens and slip are known and no
sighting is wrong; a test compares the two. In normalised pixels (`trajectory.view`), with P_j the positions, d_j the
displacements that were read, and n_3 the third entry of g1 x g2::

    sum_j |x_j - (g_12 P_j) / w_j|^2 / (s sigma_px)^2  +  sum_j |P_j+1 - P_j - d_j|^2 / sigma_m^2
    w_j = g_3 P_j + 1 / n_3
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.geometry.arrays import FloatArray

__all__ = ["BatchFit", "Drives", "fit_drives", "start_positions"]

ROUNDS, HALVINGS = 60, 8
ENOUGH = 1e-8  # of the cost: what the last step may promise to take off
RIDGE = 1e-12  # of the diagonal: what nothing determines stays where it is


@dataclass(frozen=True, slots=True, eq=False)
class Drives:
    """M drives of N points each, seen and read."""

    x: FloatArray
    """(M, N, 2). Sightings, in normalised pixels."""

    moved: FloatArray
    """(M, N-1, 2) [m]. Displacements as read."""

    sigma: FloatArray
    """(M,). Standard deviation of the sightings, in normalised pixels."""

    sigma_m: float
    """Of the displacements [m]."""

    def take(self, rows: FloatArray | np.ndarray[tuple[int, ...], np.dtype[np.intp]]) -> Drives:
        """Some of them.

        Parameters
        ----------
        rows : (K,) index
            Which.

        Returns
        -------
        drives : Drives
            Those.
        """
        return Drives(self.x[rows], self.moved[rows], self.sigma[rows], self.sigma_m)


@dataclass(frozen=True, slots=True, eq=False)
class BatchFit:
    """An estimate of each drive."""

    g: FloatArray
    """(M, 3, 2). In normalised pixels, scaled as in eq. 21."""

    xy: FloatArray
    """(M, N, 2) [m]. Positions; the ground's origin is under the normalised point (0, 0)."""

    cost: FloatArray
    """(M,). Sum of squares; infinite where the start was no view of the points."""


def start_positions(drives: Drives, g: FloatArray) -> FloatArray:
    """Positions as read, moved to where the sightings are in the median.

    Parameters
    ----------
    drives : Drives
        Sightings and readings.
    g : (M, 3, 2) array
        Where to start, in normalised pixels.

    Returns
    -------
    xy : (M, N, 2) array [m]
        Nowhere in particular where no sighting is on the ground.
    """
    read = np.zeros_like(drives.x)
    np.cumsum(drives.moved, axis=1, out=read[:, 1:])
    n3 = _third(g)[:, None]
    A = g[:, None, :2] - drives.x[..., None] * g[:, None, 2:]
    det = A[..., 0, 0] * A[..., 1, 1] - A[..., 0, 1] * A[..., 1, 0]
    right = drives.x / n3[..., None]
    with np.errstate(all="ignore"):
        seen = (
            np.stack(
                [
                    A[..., 1, 1] * right[..., 0] - A[..., 0, 1] * right[..., 1],
                    A[..., 0, 0] * right[..., 1] - A[..., 1, 0] * right[..., 0],
                ],
                axis=-1,
            )
            / det[..., None]
        )
        w = np.einsum("mnk,mk->mn", seen, g[:, 2]) + 1 / n3
        known = np.isfinite(seen).all(axis=-1) & (w * n3 > 0)
    off = np.where(known[..., None], seen - read, np.nan)
    off[~known.any(axis=1)] = 0.0
    return np.asarray(read + np.nanmedian(off, axis=1)[:, None])


def fit_drives(drives: Drives, g: FloatArray) -> BatchFit:
    """Minimise the sum of squares of each drive.

    Parameters
    ----------
    drives : Drives
        Sightings and readings.
    g : (M, 3, 2) array
        Where to start, in normalised pixels.

    Returns
    -------
    fit : BatchFit
        One estimate each; none depends on the others.
    """
    g, xy = g.copy(), start_positions(drives, g)
    cost = _cost(drives, g, xy)
    left = np.flatnonzero(np.isfinite(cost))
    for _ in range(ROUNDS):
        if not len(left):
            break
        some = drives.take(left)
        step, gain = _step(some, g[left], xy[left])
        size, waiting = 1.0, np.arange(len(left))
        for _ in range(HALVINGS + 1):  # a step that makes things worse is halved
            rows = left[waiting]
            change = size * step[waiting]
            new_g = g[rows] + change[:, :6].reshape(-1, 3, 2)
            new_xy = xy[rows] + change[:, 6:].reshape(len(rows), -1, 2)
            new = _cost(drives.take(rows), new_g, new_xy)
            better = new <= cost[rows] * (1 + 1e-9) + 1e-9
            taken = rows[better]
            g[taken], xy[taken], cost[taken] = new_g[better], new_xy[better], new[better]
            waiting, size = waiting[~better], size / 2
            if not len(waiting):
                break
        going = gain > ENOUGH * (1 + cost[left])
        going[waiting] = False  # nothing helps them
        left = left[going]
    return BatchFit(g, xy, cost)


def _third(g: FloatArray) -> FloatArray:
    return np.asarray(g[:, 0, 0] * g[:, 1, 1] - g[:, 1, 0] * g[:, 0, 1])


def _project(g: FloatArray, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normalised pixels, and the third homogeneous entry; NaN behind the camera."""
    n3 = _third(g)[:, None]
    c = xy @ np.swapaxes(g, 1, 2)
    w = c[..., 2] + 1 / n3
    w = np.where(w * n3 > 0, w, np.nan)
    return c[..., :2] / w[..., None], w


def _cost(drives: Drives, g: FloatArray, xy: FloatArray) -> FloatArray:
    with np.errstate(all="ignore"):
        x, _ = _project(g, xy)
        seen = np.sum((drives.x - x) ** 2, axis=(1, 2)) / drives.sigma**2
        read = np.sum((np.diff(xy, axis=1) - drives.moved) ** 2, axis=(1, 2)) / drives.sigma_m**2
        total = seen + read
    return np.where(np.isfinite(total), total, np.inf)


def _step(drives: Drives, g: FloatArray, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Change of g, row by row, and of the positions; and what it promises to take off the cost."""
    count, points, _ = xy.shape
    x, w = _project(g, xy)
    weight = 1 / drives.sigma[:, None, None]
    over = (weight[..., 0] / w)[..., None, None]
    J = np.zeros((count, points, 2, 6 + 2 * points))
    moved = xy * over[..., 0]
    J[:, :, 0, 0:2] = J[:, :, 1, 2:4] = moved
    J[:, :, :, 4:6] = -x[..., None] * moved[:, :, None, :]
    # n_3 = g11 g22 - g21 g12 stands in w as 1 / n_3.
    by_n3 = np.zeros((count, 6))
    by_n3[:, 0], by_n3[:, 1] = g[:, 1, 1], -g[:, 1, 0]
    by_n3[:, 2], by_n3[:, 3] = -g[:, 0, 1], g[:, 0, 0]
    by_n3 /= _third(g)[:, None] ** 2
    J[..., :6] += (x[..., None] * over) * by_n3[:, None, None]
    by_xy = (g[:, None, :2] - x[..., None] * g[:, None, 2:]) * over
    for j in range(points):
        J[:, j, :, 6 + 2 * j : 8 + 2 * j] = by_xy[:, j]
    J = J.reshape(count, 2 * points, -1)
    residual = ((drives.x - x) * weight).reshape(count, -1, 1)
    D = np.kron(np.diff(np.eye(points), axis=0), np.eye(2)) / drives.sigma_m
    unread = (drives.moved - np.diff(xy, axis=1)).reshape(count, -1) / drives.sigma_m
    Jt = np.ascontiguousarray(np.swapaxes(J, 1, 2))
    normal, right = Jt @ J, (Jt @ residual)[..., 0]
    normal[:, 6:, 6:] += D.T @ D
    right[:, 6:] += unread @ D
    diagonal = np.einsum("mii->mi", normal)
    diagonal += RIDGE * diagonal + 1e-300
    step = np.linalg.solve(normal, right[..., None])[..., 0]
    return step, np.sum(step * right, axis=1)
