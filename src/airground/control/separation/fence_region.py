"""Areas of the ground with straight edges: how far it is to the boundary, and on which side a point lies."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, nan, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["EdgeTable", "Region"]

_CHUNK = 1_000_000  # points times edges held at once


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """One or more polygons, joined, with their holes."""

    shape: Any
    """The shapely geometry, its outer rings counter-clockwise."""

    edges: FloatArray = field(init=False, repr=False)
    """(E, 2, 2) [m]. Start and end of each edge; the area lies to the left, along x towards y."""

    _rows: tuple[tuple[float, ...], ...] = field(init=False, repr=False)
    """Start, step and inverse square of the length of each edge, as plain numbers."""

    def __post_init__(self) -> None:
        edges = np.concatenate([_edges(ring) for ring in _rings(self.shape)])
        step = edges[:, 1] - edges[:, 0]
        edges.flags.writeable = False
        inverse = 1.0 / (step**2).sum(axis=1)
        object.__setattr__(self, "edges", edges)
        rows = np.column_stack([edges[:, 0], step, inverse])
        object.__setattr__(self, "_rows", tuple(map(tuple, rows.tolist())))

    @classmethod
    def joined(cls, rings: Sequence[FloatArray]) -> Region:
        """Join polygons, which may overlap.

        Parameters
        ----------
        rings : sequence of (N, 2) array [m]
            Simple polygons; either sense, not closed.

        Returns
        -------
        region : Region
            All that lies in one of them.
        """
        import shapely  # type: ignore[import-untyped]

        union = shapely.union_all([shapely.Polygon(ring) for ring in rings])
        return cls(shapely.orient_polygons(union))

    def signed_distance(self, xy: FloatArray) -> FloatArray:
        """How deep points lie within.

        Parameters
        ----------
        xy : (..., 2) array [m]
            Ground points.

        Returns
        -------
        distance : (...) array [m]
            To the boundary, negative outside; NaN for NaN.
        """
        points = np.asarray(xy, dtype=np.float64)
        flat = points.reshape(-1, 2)
        parts = max(1, len(flat) * len(self.edges) // _CHUNK)
        found = [self._signed(part) for part in np.array_split(flat, parts)]
        return np.concatenate(found).reshape(points.shape[:-1])

    def _signed(self, xy: FloatArray) -> FloatArray:
        each, crosses = EdgeTable.of(self.edges).look(xy)
        distance, inside = each.min(axis=1), crosses.sum(axis=1) % 2 == 1
        return np.asarray(np.where(inside, distance, -distance))

    def nearest(self, x: float, y: float) -> tuple[float, float, float, float, float]:
        """Nearest point of the boundary, for one point, quickly.

        Parameters
        ----------
        x, y : float [m]
            Ground point.

        Returns
        -------
        distance : float [m]
            Signed as in `signed_distance`; NaN for NaN, as all that follows.
        near_x, near_y : float [m]
            Point of the boundary.
        normal_x, normal_y : float
            Unit vector there along which the signed distance grows.
        """
        best, inside, found = inf, False, None
        for row in self._rows:
            ax, ay, dx, dy, inverse = row
            rx, ry = x - ax, y - ay
            share = (rx * dx + ry * dy) * inverse
            share = 0.0 if share < 0.0 else 1.0 if share > 1.0 else share
            ox, oy = rx - share * dx, ry - share * dy
            square = ox * ox + oy * oy
            if square < best:
                best, found = square, (ax + share * dx, ay + share * dy, row)
            if (ay > y) != (ay + dy > y) and rx < dx * (ry / dy):
                inside = not inside
        if found is None:
            return nan, nan, nan, nan, nan
        near_x, near_y, (_, _, dx, dy, inverse) = found
        distance = sqrt(best)
        if distance < 1e-9:  # on the boundary: left of the edge
            scale = sqrt(inverse)
            return (distance if inside else -distance), near_x, near_y, -dy * scale, dx * scale
        signed = distance if inside else -distance
        return signed, near_x, near_y, (x - near_x) / signed, (y - near_y) / signed


class EdgeTable(NamedTuple):
    """What distances from edges need of them, worked out once."""

    start_x: FloatArray
    """(E,) [m]."""

    start_y: FloatArray
    """(E,) [m]."""

    step_x: FloatArray
    """(E,) [m]. From start to end."""

    step_y: FloatArray
    """(E,) [m]. From start to end."""

    end_y: FloatArray
    """(E,) [m]."""

    square: FloatArray
    """(E,) [m^2]. Of the length."""

    slope: FloatArray
    """(E,). Change of x with y; any number where y does not change."""

    @classmethod
    def of(cls, edges: FloatArray) -> EdgeTable:
        """Work it out.

        Parameters
        ----------
        edges : (E, 2, 2) array [m]
            Start and end of each.

        Returns
        -------
        table : EdgeTable
            Of them.
        """
        (ax, ay), (bx, by) = edges[:, 0].T.copy(), edges[:, 1].T.copy()
        dx, dy = bx - ax, by - ay
        return cls(ax, ay, dx, dy, by, dx * dx + dy * dy, dx / np.where(dy == 0, 1.0, dy))

    def look(self, xy: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Distances of points to edges, and which edges the ray along x crosses from each point.

        Parameters
        ----------
        xy : (N, 2) array [m]
            Points.

        Returns
        -------
        distance : (N, E) array [m]
            Of each to each.
        crosses : (N, E) array of bool
            An odd number of a ring's for points inside; False for NaN.
        """
        ax, ay, dx, dy, by, square, slope = self
        x, y = xy[:, :1] - ax, xy[:, 1:] - ay
        crosses = ((y < 0) != (xy[:, 1:] < by)) & (x < y * slope)
        share = np.minimum(np.maximum((x * dx + y * dy) / square, 0.0), 1.0)
        return np.hypot(x - share * dx, y - share * dy), crosses


def _rings(shape: Any) -> list[FloatArray]:
    parts = getattr(shape, "geoms", [shape])
    return [
        np.asarray(ring.coords, dtype=np.float64)[:, :2]
        for part in parts
        for ring in (part.exterior, *part.interiors)
    ]


def _edges(ring: FloatArray) -> FloatArray:
    edges = np.stack([ring[:-1], ring[1:]], axis=1)
    return np.asarray(edges[np.any(edges[:, 0] != edges[:, 1], axis=1)])
