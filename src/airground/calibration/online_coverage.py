"""Where robots were seen and which way they drove there, in bounded space."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.samples import MotionSamples
from airground.geometry.velocity import image_velocity

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["Coverage"]

CELLS = 8.0  # per unit of normalised pixels, over two: the driven region is about four units wide
SECTORS = 8  # of heading
MOST = 2000
STILL = 1e-3  # m/s


class Coverage:
    """One sighting for each cell of the image and each sector of headings."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int, int], tuple[float, float, float, float]] = {}
        self._low = [math.inf, math.inf]
        self._high = [-math.inf, -math.inf]

    def add(
        self, c: tuple[float, float], uv: tuple[float, float], xy_dot: tuple[float, float]
    ) -> None:
        """Note a sighting.

        Parameters
        ----------
        c : (float, float)
            In normalised pixels.
        uv : (float, float) [px]
            In pixels.
        xy_dot : (float, float) [m/s]
            Ground velocity.
        """
        for k in (0, 1):
            self._low[k] = min(self._low[k], uv[k])
            self._high[k] = max(self._high[k], uv[k])
        if xy_dot[0] ** 2 + xy_dot[1] ** 2 < STILL**2:
            return
        sector = int((math.atan2(xy_dot[1], xy_dot[0]) / math.tau + 0.5) * SECTORS) % SECTORS
        key = (math.floor(c[0] * CELLS / 2), math.floor(c[1] * CELLS / 2), sector)
        if key in self._cells or len(self._cells) < MOST:
            self._cells[key] = (*uv, *xy_dot)

    def __len__(self) -> int:
        return len(self._cells)

    @property
    def region(self) -> tuple[float, float, float, float] | None:
        """Smallest u and v, largest u and v [px]; None if they span no area."""
        (u0, v0), (u1, v1) = self._low, self._high
        return (u0, v0, u1, v1) if u0 < u1 and v0 < v1 else None

    def uv(self) -> FloatArray:
        """Points that stand for the driven region.

        Returns
        -------
        uv : (N, 2) array [px]
            One of each cell.
        """
        return np.array([row[:2] for row in self._cells.values()]).reshape(-1, 2)

    def samples(self, g: FloatArray) -> MotionSamples:
        """Motion as the estimate has it.

        Parameters
        ----------
        g : (3, 2) array
            The estimate.

        Returns
        -------
        samples : MotionSamples
            Places and velocities driven, and their image velocities by eq. 15.
        """
        rows = np.array(list(self._cells.values())).reshape(-1, 4)
        uv, xy_dot = rows[:, :2], rows[:, 2:]
        return MotionSamples(uv, image_velocity(g, uv, xy_dot), xy_dot)
