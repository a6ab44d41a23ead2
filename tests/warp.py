"""A distorting lens for tests: the division model inverted by bisection, nothing of airground.geometry in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from scenes import Array, Scene


@dataclass(frozen=True)
class Warp:
    """What a lens makes of the image of a pinhole."""

    k1: float
    """[1/px^2]. Negative for a barrel."""

    center: tuple[float, float]
    """[px]."""

    def straighten(self, uv: ArrayLike) -> Array:
        """(..., 2) [px]. Where the pinhole sees what the lens shows at `uv`: the model's definition."""
        d = np.asarray(uv, dtype=np.float64) - self.center
        r2 = np.sum(d**2, axis=-1, keepdims=True)
        return np.asarray(self.center + d / (1 + self.k1 * r2))

    def bend(self, uv: ArrayLike) -> Array:
        """(..., 2) [px]. Where the lens shows what the pinhole sees at `uv`."""
        w = np.asarray(uv, dtype=np.float64) - self.center
        rho = np.linalg.norm(w, axis=-1, keepdims=True)
        low = np.zeros_like(rho)
        # A pincushion at most doubles a radius; a barrel's circle has radius 1 / sqrt(-k1).
        high = 2 * rho + 1
        if self.k1:
            high = np.minimum(high, (1 - 1e-12) / np.sqrt(abs(self.k1)))
        for _ in range(120):
            middle = (low + high) / 2
            short = middle / (1 + self.k1 * middle**2) < rho
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        return np.asarray(self.center + w * (low / np.where(rho > 0, rho, 1.0)))

    def push(self, scene: Scene, xy: ArrayLike, xy_dot: ArrayLike) -> Array:
        """(..., 2) [px/s]. Velocity in the lens's image, by a central difference of fourth order."""
        xy, xy_dot = np.asarray(xy), np.asarray(xy_dot)
        image = np.linalg.norm(scene.push(xy, xy_dot), axis=-1, keepdims=True)
        step = 0.3 / np.maximum(image, 1e-9)  # s; a third of a pixel
        at = [self.bend(scene.project(xy + n * step * xy_dot)) for n in (-2, -1, 1, 2)]
        return np.asarray((at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step))
