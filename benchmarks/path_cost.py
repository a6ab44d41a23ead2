"""The cost of the whole drive in its plain form, as a user of a generic solver would write it down.

Unknowns: g (6, its third row times the image's size, so that all are of like size), the image point c0 of the first
position (2), and the ground position P_i at every sighting but the first, where P_0 = 0. Residuals: each sighting in
pixels over its deviation, ``c_i ~ c0 / (n.c0) + g P_i``, n = G1 x G2, and each displacement ``P_(i+1) - P_i`` minus the
odometry's, whitened by its covariance. One robot, no nuisances, no robust loss; the clocks' offset is given.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse  # type: ignore[import-untyped,unused-ignore]

from airground.calibration.ground_path import ground_path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.calibration import Motion, Tracks
    from airground.geometry import FloatArray

__all__ = ["Levels", "PathCost", "one_sighting", "path_cost"]

LEAST_STEP = 1e-4  # m; deviation of a displacement that the odometry calls zero


@dataclass(frozen=True, slots=True)
class Levels:
    """Noise levels that are told to the cost; all white."""

    pixel_px: float = 2.0
    """Of a sighting [px]."""

    speed_share: float = 0.05
    """Of a speed reading, relative."""

    heading_rad: float = 0.05
    """Of a heading reading [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class PathCost:
    """What the solvers minimise half the sum of squares of."""

    uv: FloatArray
    """(N, 2) [px]. Sightings."""

    sigma_px: float
    """Of each coordinate [px]."""

    step: FloatArray
    """(N-1, 2) [m]. Displacements by the odometry."""

    root: FloatArray
    """(N-1, 2, 2) [1/m]. Whitens a displacement: root C root^T = I."""

    size_px: float
    """Of the image: the unit of g's third row."""

    start: FloatArray
    """(8 + 2(N-1),). Where all solvers begin: g, c0, P_1, P_2, ..."""

    @property
    def units(self) -> FloatArray:
        """(6,). What each entry of g is multiplied by to be an unknown."""
        return np.array([1.0, 1.0, 1.0, 1.0, self.size_px, self.size_px])

    def g(self, x: FloatArray) -> FloatArray:
        """(3, 2). From the unknowns."""
        return np.asarray((x[:6] / self.units).reshape(3, 2))

    def residual(self, x: FloatArray) -> FloatArray:
        """(2N + 2(N-1),). Pixels first."""
        path = _path(x)
        pixels, _, _ = self.sightings(x[:6], x[6:8], path, derivatives=False)
        steps = np.einsum("nij,nj->ni", self.root, np.diff(path, axis=0) - self.step)
        return np.concatenate([pixels.ravel(), steps.ravel()])

    def jacobian(self, x: FloatArray) -> Any:
        """Sparse, of `residual`."""
        count = len(self.uv)
        _, on_globals, on_path = self.sightings(x[:6], x[6:8], _path(x))
        i = np.arange(1, count)
        rows = np.arange(2 * count)
        entries = [(on_globals.ravel(), np.repeat(rows, 8), np.tile(np.arange(8), 2 * count))]
        entries.append(_blocks(on_path[1:], 2 * i, 6 + 2 * i))
        first = 2 * count
        entries.append(_blocks(self.root, first + 2 * (i - 1), 6 + 2 * i))
        entries.append(_blocks(-self.root[1:], first + 2 * (i[1:] - 1), 4 + 2 * i[1:]))
        value, row, column = (np.concatenate(part) for part in zip(*entries, strict=True))
        shape = (4 * count - 2, len(x))
        return sparse.csr_array((value, (row, column)), shape=shape)

    def sightings(
        self, scaled_g: FloatArray, c0: FloatArray, path: FloatArray, *, derivatives: bool = True
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Residuals (M, 2) of the sightings at M positions, by the globals (M, 2, 8), by the positions (M, 2, 2)."""
        g = (scaled_g / self.units).reshape(3, 2)
        c = np.append(c0, 1.0)
        n = np.cross(g[:, 0], g[:, 1])
        nearness = float(n @ c)
        w = c / nearness + path @ g.T
        uv = w[:, :2] / w[:, 2:]
        residual = (uv - self.uv[: len(path)]) / self.sigma_px
        if not derivatives:
            return residual, np.empty(0), np.empty(0)
        # d(uv) = (dw_(u, v) - uv dw_3) / w_3
        to_uv = np.zeros((len(path), 2, 3))
        to_uv[:, 0, 0] = to_uv[:, 1, 1] = 1 / (self.sigma_px * w[:, 2])
        to_uv[:, :, 2] = -uv / (self.sigma_px * w[:, 2:])
        # n.c = G1.(G2 x c) = G2.(c x G1)
        on_nearness = np.column_stack([np.cross(g[:, 1], c), np.cross(c, g[:, 0])]).ravel()
        on_g = to_uv[:, :, :, None] * path[:, None, None, :]
        on_g = on_g.reshape(len(path), 2, 6) - np.multiply.outer(
            to_uv @ (c / nearness**2), on_nearness
        )
        on_c0 = to_uv @ (np.eye(3)[:, :2] / nearness - np.outer(c, n[:2]) / nearness**2)
        return residual, np.concatenate([on_g / self.units, on_c0], axis=2), to_uv @ g


def one_sighting(
    a: Sequence[float], c0: Sequence[float], xy: Sequence[float], cost: PathCost, i: int
) -> tuple[tuple[float, float], tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Residual of sighting i, by g (12), c0 (4) and position (4), row by row: what a factor in Python has to give.

    In plain floats, five times as fast as NumPy on arrays this small.
    """
    m = cost.size_px
    g11, g12, g21, g22, g31, g32 = a[0], a[1], a[2], a[3], a[4] / m, a[5] / m
    c1, c2 = c0[0], c0[1]
    x, y = xy[0], xy[1]
    n1, n2, n3 = g21 * g32 - g31 * g22, g31 * g12 - g11 * g32, g11 * g22 - g21 * g12
    q = 1.0 / (n1 * c1 + n2 * c2 + n3)
    w = 1.0 / (q + g31 * x + g32 * y)
    u, v = (c1 * q + g11 * x + g12 * y) * w, (c2 * q + g21 * x + g22 * y) * w
    k = w / cost.sigma_px
    # Through the nearness n.c0: all of c0 / (n.c0) shrinks as it grows.
    su, sv = -k * (c1 - u) * q * q, -k * (c2 - v) * q * q
    d11, d21, d31 = g22 - c2 * g32, c1 * g32 - g12, (c2 * g12 - c1 * g22) / m
    d12, d22, d32 = c2 * g31 - g21, g11 - c1 * g31, (c1 * g21 - c2 * g11) / m
    kx, ky = k * x, k * y
    by_g = (
        *(kx + su * d11, ky + su * d12, su * d21, su * d22),
        *(-u * kx / m + su * d31, -u * ky / m + su * d32),
        *(sv * d11, sv * d12, kx + sv * d21, ky + sv * d22),
        *(-v * kx / m + sv * d31, -v * ky / m + sv * d32),
    )
    by_c0 = (k * q + su * n1, su * n2, sv * n1, k * q + sv * n2)
    by_xy = (k * (g11 - u * g31), k * (g12 - u * g32), k * (g21 - v * g31), k * (g22 - v * g32))
    seen = cost.uv[i]
    sigma = cost.sigma_px
    return ((u - float(seen[0])) / sigma, (v - float(seen[1])) / sigma), by_g, by_c0, by_xy


def _path(x: FloatArray) -> FloatArray:
    return np.concatenate([np.zeros((1, 2)), x[8:].reshape(-1, 2)])


def _blocks(
    block: FloatArray, row: np.ndarray, column: np.ndarray
) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Entries of (M, 2, 2) blocks at given first rows and columns."""
    rows = row[:, None, None] + np.array([[0, 0], [1, 1]])
    columns = column[:, None, None] + np.array([[0, 1], [0, 1]])
    return block.ravel(), rows.ravel(), columns.ravel()


def path_cost(
    tracks: Tracks,
    motion: Motion,
    offset_s: float,
    image_size_px: tuple[int, int],
    *,
    g_start: FloatArray,
    levels: Levels,
) -> PathCost:
    """Write down the cost of the first target's drive; it begins at `g_start`, the first sighting and the odometry."""
    name = tracks.targets[0]
    path = ground_path(motion, name)
    assert path is not None
    rows = tracks.rows(name)
    t = tracks.t[rows] + offset_s
    xy, stretch = path.at(t)
    keep = stretch >= 0
    xy, t, uv = xy[keep], t[keep], tracks.uv[rows][keep]
    step = np.diff(xy, axis=0)
    length = np.maximum(np.linalg.norm(step, axis=1), 1e-12)
    along = np.where(length[:, None] > 1e-9, step / length[:, None], [1.0, 0.0])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    # White readings every h seconds, integrated over dt: the deviation of the mean is that of one times sqrt(h / dt).
    share = np.sqrt(float(np.median(np.diff(path.t))) / np.diff(t))
    sigma = np.stack([levels.speed_share * share * length, levels.heading_rad * share * length])
    sigma = np.hypot(sigma, LEAST_STEP)
    root = np.stack([along / sigma[0][:, None], across / sigma[1][:, None]], axis=1)
    size = float(np.hypot(*image_size_px))
    units = np.array([1.0, 1.0, 1.0, 1.0, size, size])
    start = np.concatenate([g_start.ravel() * units, uv[0], (xy - xy[0])[1:].ravel()])
    return PathCost(uv, levels.pixel_px, step, root, size, start)
