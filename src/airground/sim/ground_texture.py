"""Floors and roads as pictures: seeded, seen from above, with enough fine grain for feature trackers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.body import Colour
from airground.vision.frame import ImageArray
from airground.vision.raster.maps import Float32Array

__all__ = ["FLOORS", "Ground", "ground"]


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """A tile of ground; it repeats for ever."""

    picture: ImageArray
    """(H, W, 3). Blue, green, red; columns count along x and rows along y."""

    texel_m: float
    """Side of a texel [m]."""

    corner_m: tuple[float, float] = (0.0, 0.0)
    """Ground point of the middle of texel (0, 0) [m]."""

    @property
    def texel_from_ground(self) -> FloatArray:
        """(3, 3). Column and row of a ground point."""
        x, y = self.corner_m
        s = 1 / self.texel_m
        return np.array([[s, 0.0, -s * x], [0.0, s, -s * y], [0.0, 0.0, 1.0]])


def ground(name: str, *, seed: int = 0, tile_m: float = 8.0, texel_m: float = 0.004) -> Ground:
    """Make a ground.

    Parameters
    ----------
    name : str
        One of `FLOORS`.
    seed : int
        Of its grain, stains and cracks.
    tile_m : float [m]
        After how much it repeats.
    texel_m : float [m]
        About the side of a texel.

    Returns
    -------
    ground : Ground
        A square tile with 2^n texels along a side.

    Raises
    ------
    InputError
        If there is no such floor.
    """
    if name not in FLOORS:
        raise InputError(f"floor must be one of {', '.join(FLOORS)}, not {name!r}")
    if not 0 < texel_m < tile_m:
        raise InputError("texel_m must be positive and below tile_m")
    side = 1 << round(float(np.log2(tile_m / texel_m)))
    if not 16 <= side <= 8192:
        raise InputError(f"a tile has 16 to 8192 texels along a side, not {side}")
    tile = _Tile(side, tile_m / side, np.random.default_rng([seed, 0x6D]))
    FLOORS[name](tile)
    picture = np.clip(np.rint(tile.paint), 0, 255).astype(np.uint8)
    return Ground(picture, tile.texel, (tile.texel / 2, tile.texel / 2))


class _Tile:
    """What floors are painted on."""

    def __init__(self, side: int, texel: float, rng: np.random.Generator) -> None:
        self.side, self.texel, self.rng = side, texel, rng
        self.length = side * texel
        self.at = (np.arange(side, dtype=np.float32) + 0.5) * texel
        self.paint = np.zeros((side, side, 3), dtype=np.float32)

    def noise(self, size_m: float) -> Float32Array:
        """Smooth noise of unit variance with features of a size; periodic."""
        count = max(round(self.length / size_m), 2)
        if count >= self.side:
            return self.rng.standard_normal((self.side, self.side), dtype=np.float32)
        grid = self.rng.standard_normal((count, count), dtype=np.float32)
        place = np.arange(self.side, dtype=np.float32) * (count / self.side)
        low = place.astype(int)
        share = place - low
        share = share * share * (3 - 2 * share)
        rows = grid[low] * (1 - share)[:, None] + grid[(low + 1) % count] * share[:, None]
        out = rows[:, low] * (1 - share) + rows[:, (low + 1) % count] * share
        return np.asarray(out / 0.75, dtype=np.float32)

    def lines(
        self, along: str, every_m: float, width_m: float, first_m: float = 0.0
    ) -> Float32Array:
        """Share of each texel under lines that repeat; `along` x or y."""
        off = np.abs((self.at - first_m + every_m / 2) % every_m - every_m / 2)
        share = np.clip((width_m / 2 - off) / self.texel + 0.5, 0.0, 1.0)
        return np.asarray(share[:, None] if along == "x" else share[None, :])

    def cover(self, share: FloatArray | Float32Array, colour: Colour | float) -> None:
        """Paint over."""
        paint = np.asarray(colour, dtype=np.float32)
        self.paint += share[..., None].astype(np.float32) * (paint - self.paint)

    def shade(self, factor: Float32Array) -> None:
        """Lighten and darken."""
        self.paint *= factor[..., None].astype(np.float32)

    def blobs(self, count: int, size_m: tuple[float, float]) -> Float32Array:
        """Soft stains at random places; periodic."""
        total = np.zeros((self.side, self.side), dtype=np.float32)
        for _ in range(count):
            x, y = self.rng.uniform(0, self.length, 2)
            size = self.rng.uniform(*size_m)
            dx = (self.at - x + self.length / 2) % self.length - self.length / 2
            dy = (self.at - y + self.length / 2) % self.length - self.length / 2
            rows, columns = (
                np.flatnonzero(np.abs(dy) < 3 * size),
                np.flatnonzero(np.abs(dx) < 3 * size),
            )
            far = (dx[columns] / size) ** 2 + ((dy[rows] / size) ** 2)[:, None]
            total[np.ix_(rows, columns)] += self.rng.uniform(0.3, 1.0) * np.exp(-far / 2)
        return np.minimum(total, 1.0)

    def cracks(self, count: int, length_m: float) -> Float32Array:
        """Thin random walks; periodic."""
        total = np.zeros((self.side, self.side), dtype=np.float32)
        steps = max(round(length_m / self.texel), 2)
        for _ in range(count):
            heading = self.rng.uniform(0, 2 * np.pi) + np.cumsum(self.rng.normal(0, 0.22, steps))
            x = self.rng.uniform(0, self.side) + np.cumsum(np.cos(heading))
            y = self.rng.uniform(0, self.side) + np.cumsum(np.sin(heading))
            total[y.astype(int) % self.side, x.astype(int) % self.side] = 1.0
        return total


def _warehouse(tile: _Tile) -> None:
    """Sealed concrete with joints, scuffs, and painted lanes."""
    tile.paint[:] = (134, 138, 139)
    tile.shade(1 + 0.035 * tile.noise(1.6) + 0.03 * tile.noise(0.35) + 0.02 * tile.noise(0.07))
    for line in ("x", "y"):
        half = tile.length / 2
        tile.cover(0.92 * tile.lines(line, half, 0.09, half / 4), (66, 200, 240))
    worn = np.clip(0.55 + 0.45 * tile.noise(0.05) + 0.4 * tile.noise(0.4), 0, 1)
    tile.cover(0.18 * (1 - worn), (134, 138, 139))
    tile.cover(0.5 * tile.blobs(14, (0.05, 0.3)), (92, 97, 99))
    tile.cover(0.65 * tile.blobs(40, (0.01, 0.04)), (66, 68, 70))
    tile.cover(0.28 * tile.cracks(60, 1.2), (85, 86, 88))
    for line in ("x", "y"):
        tile.cover(0.75 * tile.lines(line, tile.length / 4, 0.012), (70, 72, 74))
    tile.shade(1 + 0.03 * tile.noise(0.018) + 0.025 * tile.noise(0.004))


def _asphalt(tile: _Tile) -> None:
    """Dark asphalt with grain, patches, cracks and lane markings along x."""
    tile.paint[:] = (84, 84, 82)
    tile.shade(1 + 0.05 * tile.noise(2.5) + 0.05 * tile.noise(0.5))
    tile.cover(0.35 * tile.blobs(8, (0.2, 0.8)), (62, 62, 62))
    tile.cover(0.6 * tile.cracks(25, 3.0), (44, 44, 44))
    dash = (np.abs(tile.at - tile.length / 2) < tile.length / 5)[None, :]
    dashed = tile.lines("x", tile.length / 2, 0.12, tile.length / 4) * dash
    worn = np.clip(0.9 + 0.25 * tile.noise(0.06), 0.2, 1.0)
    tile.cover(dashed * worn, (215, 218, 220))
    tile.shade(1 + 0.10 * tile.noise(0.02) + 0.07 * tile.noise(0.06))


def _checked(tile: _Tile) -> None:
    """Squares of an eighth of the tile, as on a laboratory's floor."""
    square = (tile.at // (tile.length / 8)).astype(int)
    dark = ((square[:, None] + square) % 2)[..., None]
    tile.paint[:] = np.where(dark, (112, 116, 118), (172, 176, 178))
    tile.shade(1 + 0.03 * tile.noise(0.6) + 0.03 * tile.noise(0.03))
    tile.cover(0.4 * tile.blobs(30, (0.01, 0.05)), (80, 80, 80))


def _grass(tile: _Tile) -> None:
    """Mown grass."""
    tile.paint[:] = (62, 118, 92)
    tile.shade(1 + 0.10 * tile.noise(1.2) + 0.10 * tile.noise(0.15) + 0.14 * tile.noise(0.03))
    tile.cover(0.4 * tile.blobs(25, (0.05, 0.3)), (80, 130, 140))
    tile.shade(1 + 0.18 * tile.noise(0.012))


def _carpet(tile: _Tile) -> None:
    """Green felt with white lines, as in robot soccer: the tile is the field's half."""
    tile.paint[:] = (66, 122, 52)
    tile.shade(1 + 0.03 * tile.noise(0.8) + 0.03 * tile.noise(0.02) + 0.06 * tile.noise(0.006))
    for line in ("x", "y"):
        tile.cover(0.95 * tile.lines(line, tile.length / 2, 0.03, tile.length / 4), (232, 235, 235))
    tile.cover(0.25 * tile.blobs(25, (0.01, 0.06)), (50, 95, 40))


FLOORS: dict[str, Callable[[_Tile], None]] = {
    "warehouse": _warehouse,
    "asphalt": _asphalt,
    "checked": _checked,
    "grass": _grass,
    "carpet": _carpet,
}
"""Names that `ground` knows."""
