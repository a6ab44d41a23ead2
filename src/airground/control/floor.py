"""The ground as a robot drives on it, seen through g: metres, headings and pixels, quickly, one point or many.

With n = G1 x G2 and the origin c_0, ``G = [G1 G2 c_0 / (n.c_0)]`` rectifies the image up to nothing: distances,
curvatures and headings are those of the ground. A straight line in the image is straight on the ground, and the
direction of ``J(c)^-1 (goal - c)`` is exactly that from c to the goal.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray, readonly
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["Floor"]


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """Metric coordinates on the ground, with the origin at a point of the image.

    All pixels are those of the model: undistorted, where the camera has a lens. Points are not checked, as this runs
    in a control loop: what is on or beyond the horizon, or NaN, comes out as NaN.
    """

    model: LimitedHomography
    """The relation between image and ground."""

    origin_uv: FloatArray
    """(2,) [px]. Image of the ground's origin, a point of the visible ground."""

    image_from_ground: FloatArray = field(init=False, repr=False)
    """(3, 3). Full homography for that origin, determinant one."""

    ground_from_image: FloatArray = field(init=False, repr=False)
    """(3, 3). Its inverse."""

    side: float = field(init=False, repr=False)
    """Sign of n.c on visible ground: -1 where the ground frame is right-handed, seen from above."""

    _rows: tuple[tuple[float, ...], tuple[float, ...]] = field(init=False, repr=False)
    """Both maps, image to ground first, row by row, as plain numbers."""

    def __post_init__(self) -> None:
        origin = readonly(self.origin_uv, (2,), "origin_uv")
        G = readonly(self.model.image_from_ground(origin), (3, 3), "image_from_ground")
        H = readonly(np.linalg.inv(G), (3, 3), "ground_from_image")
        object.__setattr__(self, "origin_uv", origin)
        object.__setattr__(self, "image_from_ground", G)
        object.__setattr__(self, "ground_from_image", H)
        object.__setattr__(self, "side", float(np.sign(G[2, 2])))
        rows = tuple(tuple(matrix.ravel().tolist()) for matrix in (H, G))
        object.__setattr__(self, "_rows", rows)

    @property
    def clockwise(self) -> bool:
        """Whether headings count clockwise, seen from above: the ground frame is left-handed (north, east)."""
        return self.side > 0

    def position(self, uv: ArrayLike) -> FloatArray:
        """Where on the ground image points are.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.

        Returns
        -------
        xy : (..., 2) array [m]
            Ground points; NaN for what is not visible ground.
        """
        uv = np.asarray(uv, dtype=np.float64)
        if uv.shape == (2,):
            return np.array(self.position_of(*uv.tolist()))
        return self._mapped(self.ground_from_image, uv)

    def pixel(self, xy: ArrayLike) -> FloatArray:
        """Where in the image ground points are.

        Parameters
        ----------
        xy : (..., 2) array_like [m]
            Ground points.

        Returns
        -------
        uv : (..., 2) array [px]
            Image points; NaN for ground behind the camera.
        """
        xy = np.asarray(xy, dtype=np.float64)
        if xy.shape == (2,):
            return np.array(self.pixel_of(*xy.tolist()))
        return self._mapped(self.image_from_ground, xy)

    def position_of(self, u: float, v: float) -> tuple[float, float]:
        """`position` of one point in plain numbers: a tenth of the time.

        Parameters
        ----------
        u, v : float [px]
            Image point.

        Returns
        -------
        x, y : float [m]
            Ground point; NaN for what is not visible ground.
        """
        return self._one(self._rows[0], u, v)

    def pixel_of(self, x: float, y: float) -> tuple[float, float]:
        """`pixel` of one point in plain numbers: a tenth of the time.

        Parameters
        ----------
        x, y : float [m]
            Ground point.

        Returns
        -------
        u, v : float [px]
            Image point; NaN for ground behind the camera.
        """
        return self._one(self._rows[1], x, y)

    def _one(self, rows: tuple[float, ...], x: float, y: float) -> tuple[float, float]:
        a, b, c, d, e, f, h, k, m = rows
        z = h * x + k * y + m
        if not z * self.side > 0:
            return nan, nan
        return (a * x + b * y + c) / z, (d * x + e * y + f) / z

    def _mapped(self, matrix: FloatArray, points: FloatArray) -> FloatArray:
        w = points @ matrix[:, :2].T + matrix[:, 2]
        depth = w[..., 2:] * self.side  # of either map: G3 ends in 1 / (n.c_0), H in n.c
        return np.asarray(w[..., :2] / np.where(depth > 0, w[..., 2:], np.nan))

    def distance(self, a_uv: ArrayLike, b_uv: ArrayLike) -> FloatArray:
        """Distance on the ground between image points.

        Parameters
        ----------
        a_uv, b_uv : (..., 2) array_like [px]
            Image points; leading axes broadcast.

        Returns
        -------
        distance : (...) array [m]
            NaN where one is not visible ground.
        """
        step = self.position(a_uv) - self.position(b_uv)
        return np.asarray(np.hypot(step[..., 0], step[..., 1]))
