"""The truth about the tags' plane, surveyed: bright points in known places, and where a picture shows them.

Nothing of the estimators' geometry is used here: centres of brightness, the lens's formula, and a homography by the
direct linear transformation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import UndeterminedError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.sim3d.world import World3d

__all__ = ["Survey", "survey"]

COLUMNS, ROWS = 6, 4
LEAST = 8  # points
LIGHT = 32  # a pixel below this is dark [grey levels]


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What was found."""

    image_from_plane: FloatArray
    """(3, 3). From world x and y [m] to undistorted pixels, with determinant one."""

    xy: FloatArray
    """(N, 2) [m]. The points."""

    uv: FloatArray
    """(N, 2) [px]. Where they were seen, undistorted."""

    residual_px: float
    """Root mean square distance of points seen and computed [px]."""

    @property
    def g(self) -> FloatArray:
        """(3, 2). The limited homography, scaled as in eq. 21."""
        return np.array(self.image_from_plane[:, :2])

    def project(self, xy: FloatArray) -> FloatArray:
        """Where points of the plane are seen.

        Parameters
        ----------
        xy : (..., 2) array [m]
            World points.

        Returns
        -------
        uv : (..., 2) array [px]
            Undistorted.
        """
        w = xy @ self.image_from_plane[:, :2].T + self.image_from_plane[:, 2]
        return np.asarray(w[..., :2] / w[..., 2:])


def survey(
    world: World3d,
    height_m: float,
    *,
    t: float | None = None,
    region_m: tuple[float, float, float, float] = (-1.5, -0.9, 1.5, 1.3),
) -> Survey:
    """Survey a plane parallel to the floor with the world's camera.

    Parameters
    ----------
    world : World3d
        Whose camera it is; it is left as it was.
    height_m : float [m]
        Of the plane above the floor, as of the tags' faces.
    t : float, optional [s]
        When, for a camera that moves; now where not given.
    region_m : (float, float, float, float) [m]
        Least x, least y, largest x, largest y of the points; those out of view are left out.

    Returns
    -------
    found : Survey
        Of the points in view.

    Raises
    ------
    UndeterminedError
        If fewer than eight points are in view.
    UnreachableError
        If nothing can be drawn here.
    """
    pose = world.camera_pose(world.now if t is None else t)
    low_x, low_y, high_x, high_y = region_m
    seen: list[tuple[FloatArray, FloatArray]] = []
    for x in np.linspace(low_x, high_x, COLUMNS):
        for y in np.linspace(low_y, high_y, ROWS):
            picture = world.eye.point(np.array([x, y, height_m]), pose)
            centre = _centre(picture.max(axis=-1).astype(np.float64))
            if centre is not None:
                seen.append((np.array([x, y]), centre))
    if len(seen) < LEAST:
        raise UndeterminedError(f"the camera sees {len(seen)} of the points; it must see {LEAST}")
    xy, raw = np.array([a for a, _ in seen]), np.array([b for _, b in seen])
    off = raw - world.lens.center
    uv = world.lens.center + off / (1 + world.lens.k1 * np.sum(off**2, axis=1, keepdims=True))
    G = _homography(xy, uv)
    found = Survey(G, xy, uv, 0.0)
    residual = float(np.sqrt(np.mean(np.sum((found.project(xy) - uv) ** 2, axis=1))))
    return Survey(G, xy, uv, residual)


def _centre(grey: FloatArray) -> FloatArray | None:
    """(2,). Middle of the brightness; None where it is cut off or not in the image."""
    lit = grey > LIGHT
    if not lit.any() or lit[[0, -1]].any() or lit[:, [0, -1]].any():
        return None
    total = grey.sum()
    rows, columns = grey.sum(axis=1), grey.sum(axis=0)
    u = float(columns @ np.arange(len(columns)) / total)
    v = float(rows @ np.arange(len(rows)) / total)
    return np.array([u, v])


def _homography(xy: FloatArray, uv: FloatArray) -> FloatArray:
    """(3, 3). Direct linear transformation in coordinates of mean zero and unit spread; determinant one."""
    A, B = _similar(xy), _similar(uv)
    a = np.column_stack([xy, np.ones(len(xy))]) @ A.T
    b = np.column_stack([uv, np.ones(len(uv))]) @ B.T
    zero = np.zeros_like(a)
    system = np.concatenate(
        [
            np.concatenate([a, zero, -b[:, :1] * a], axis=1),
            np.concatenate([zero, a, -b[:, 1:2] * a], axis=1),
        ]
    )
    G = np.linalg.solve(B, np.linalg.svd(system, full_matrices=False)[2][-1].reshape(3, 3)) @ A
    return np.asarray(G / np.cbrt(np.linalg.det(G)))


def _similar(points: FloatArray) -> FloatArray:
    middle, spread = points.mean(axis=0), float(points.std())
    return np.array(
        [[1 / spread, 0, -middle[0] / spread], [0, 1 / spread, -middle[1] / spread], [0, 0, 1]]
    )
