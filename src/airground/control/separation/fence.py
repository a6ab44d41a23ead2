"""Where robots may be: polygons drawn in the image, on the ground.

A straight line in the image is straight on the ground, so a polygon's corners are all that has to be mapped, as long as
all of them are visible ground. Clearances are metres on the ground.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot, isfinite
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airground.control.floor import Floor
from airground.control.separation.fence_region import EdgeTable, Region
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, points, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["Boundary", "Fence"]

_FAR = 1e5  # half the length [m] of the edge that stands for a whole line


class Boundary(NamedTuple):
    """The nearest place where a robot's point must stop."""

    clearance_m: float
    """Distance to it [m]; negative where the point is not allowed."""

    xy: tuple[float, float]
    """Where it is on the ground [m]."""

    normal: tuple[float, float]
    """Unit vector along which the clearance grows."""

    kind: str
    """``fence``, ``keep-out`` or ``view``, the end of the visible ground."""


@dataclass(frozen=True, slots=True, eq=False)
class Fence:
    """Robots stay inside one of some polygons and out of others.

    Polygons may overlap; where robots may be is the union of `stay_inside` without the union of `keep_out`.
    """

    floor: Floor
    """Relation of image and ground."""

    kinds: ClassVar[tuple[str, ...]] = ("fence", "keep-out", "view")
    """What bounds the ground: `stay_inside`, `keep_out`, the end of the visible ground."""

    stay_inside: tuple[FloatArray, ...] = ()
    """(N, 2) each [px]. Geofences, not closed; none leaves all of the visible ground."""

    keep_out: tuple[FloatArray, ...] = ()
    """(N, 2) each [px]. Obstacles."""

    fence: Region | None = field(init=False, repr=False)
    """The geofences on the ground."""

    obstacles: Region | None = field(init=False, repr=False)
    """The obstacles on the ground."""

    edges: FloatArray = field(init=False, repr=False)
    """(E, 2, 2) [m]. Start and end of all edges of fence, obstacles and view, in this order; their inside is left."""

    edge_kinds: NDArray[np.intp] = field(init=False, repr=False)
    """(E,). Which of `kinds` they are."""

    ends: NDArray[np.complex128] = field(init=False, repr=False)
    """(2, E) [m]. Starts, then ends of `edges`, as x + iy."""

    _table: EdgeTable = field(init=False, repr=False)
    """Of `edges`."""

    _view: tuple[float, float, float] | None = field(init=False, repr=False)
    """Line on the ground below the camera: nx x + ny y + c is the distance to it on the visible side."""

    def __post_init__(self) -> None:
        regions: dict[str, Region | None] = {}
        for name, region in (("stay_inside", "fence"), ("keep_out", "obstacles")):
            given = getattr(self, name)
            drawn = tuple(_drawn(one, f"{name}[{k}]") for k, one in enumerate(given))
            object.__setattr__(self, name, drawn)
            rings = [_ground(self.floor, one, f"{name}[{k}]") for k, one in enumerate(drawn)]
            regions[region] = Region.joined(rings) if rings else None
            object.__setattr__(self, region, regions[region])
        fence, obstacles = regions["fence"], regions["obstacles"]
        if fence is not None and obstacles is not None:
            left = fence.shape.difference(obstacles.shape).area
            if not left > 1e-9 * fence.shape.area:
                raise InputError(
                    "keep_out covers all of stay_inside; draw smaller obstacles or a larger fence"
                )
        object.__setattr__(self, "_view", None if fence is not None else _foot(self.floor))
        parts = [
            np.empty((0, 2, 2)) if fence is None else fence.edges,
            np.empty((0, 2, 2)) if obstacles is None else obstacles.edges,
            self.view.reshape(-1, 2, 2),
        ]
        edges = readonly(np.concatenate(parts), (None, 2, 2), "edges")
        object.__setattr__(self, "edges", edges)
        ends = (edges[..., 0] + 1j * edges[..., 1]).T.copy()
        ends.flags.writeable = False
        object.__setattr__(self, "ends", ends)
        object.__setattr__(self, "_table", EdgeTable.of(edges))
        kinds = np.repeat(np.arange(3), [len(part) for part in parts])
        kinds.flags.writeable = False
        object.__setattr__(self, "edge_kinds", kinds)

    @property
    def view(self) -> FloatArray:
        """(2, 2) [m]. Two far points of the line where visible ground ends, which lies to the left; else (0, 2)."""
        if self._view is None:
            return np.empty((0, 2))
        nx, ny, c = self._view
        foot, along = np.array([-c * nx, -c * ny]), np.array([ny, -nx])
        return np.stack([foot - _FAR * along, foot + _FAR * along])

    def clearance(self, xy: ArrayLike) -> FloatArray:
        """Distance of ground points to where robots may not be.

        Parameters
        ----------
        xy : (..., 2) array_like [m]
            Ground points.

        Returns
        -------
        clearance : (...) array [m]
            Exact where it is positive; where it is not, minus the depth in the fence's outside or in an obstacle, the
            larger. Infinite where there is nothing; NaN for NaN.
        """
        xy = points(xy, "xy")
        least = np.where(np.isnan(xy).any(axis=-1), np.nan, np.inf)
        if self.fence is not None:
            least = np.minimum(least, self.fence.signed_distance(xy))
        if self.obstacles is not None:
            least = np.minimum(least, -self.obstacles.signed_distance(xy))
        if self._view is not None:
            least = np.minimum(least, xy @ np.array(self._view[:2]) + self._view[2])
        return np.asarray(least)

    def look(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances of a few points to all edges, and clearances, without checks.

        Parameters
        ----------
        xy : (N, 2) array [m]
            Ground points.

        Returns
        -------
        distance : (N, E) array [m]
            To each of `edges`.
        clearance : (N,) array [m]
            As `clearance` gives it.
        """
        distance, crosses = self._table.look(xy)
        clear = np.full(len(xy), np.inf)
        begin = 0
        for region, sign in ((self.fence, 1.0), (self.obstacles, -1.0)):
            if region is None:
                continue
            own = slice(begin, begin + len(region.edges))
            inside = np.logical_xor.reduce(crosses[:, own], axis=1)
            least = distance[:, own].min(axis=1)
            clear = np.minimum(clear, np.where(inside, sign, -sign) * least)
            begin = own.stop
        if self._view is not None:
            nx, ny, c = self._view
            clear = np.minimum(clear, nx * xy[:, 0] + ny * xy[:, 1] + c)
        return distance, clear

    def boundary(self, x: float, y: float) -> Boundary | None:
        """Nearest place where a robot's point must stop, for one point, quickly.

        Parameters
        ----------
        x, y : float [m]
            Ground point.

        Returns
        -------
        boundary : Boundary or None
            None where nothing bounds the ground; all numbers NaN for NaN.
        """
        best: Boundary | None = None
        if self.fence is not None:
            d, px, py, nx, ny = self.fence.nearest(x, y)
            best = Boundary(d, (px, py), (nx, ny), "fence")
        if self._view is not None:
            nx, ny, c = self._view
            d = nx * x + ny * y + c
            best = Boundary(d, (x - d * nx, y - d * ny), (nx, ny), "view")
        if self.obstacles is not None:
            d, px, py, nx, ny = self.obstacles.nearest(x, y)
            if best is None or -d < best.clearance_m:
                best = Boundary(-d, (px, py), (-nx, -ny), "keep-out")
        return best

    def inside(self, xy: ArrayLike, margin_m: float = 0.0) -> np.ndarray:
        """Tell whether robots may be at ground points.

        Parameters
        ----------
        xy : (..., 2) array_like [m]
            Ground points.
        margin_m : float [m]
            Clearance they must have, such as a robot's radius.

        Returns
        -------
        inside : (...) array of bool
            False for NaN.
        """
        return np.asarray(self.clearance(xy) >= margin_m)

    def inside_image(self, uv: ArrayLike, margin_m: float = 0.0) -> np.ndarray:
        """Tell whether robots may be at image points.

        Parameters
        ----------
        uv : (..., 2) array_like [px]
            Image points.
        margin_m : float [m]
            Clearance that they must have on the ground.

        Returns
        -------
        inside : (...) array of bool
            False for NaN and for what is not visible ground.
        """
        return self.inside(self.floor.position(points(uv, "uv")), margin_m)


def _drawn(ring: ArrayLike, name: str) -> FloatArray:
    """Corners of a polygon as drawn, without repetitions."""
    uv = readonly(ring, (None, 2), name)
    following = np.roll(uv, -1, axis=0)
    uv = uv[np.any(uv != following, axis=1)]  # a closing point, a double click
    if len(uv) < 3:
        raise InputError(f"{name} has {len(uv)} different corners; a polygon needs 3 or more")
    uv.flags.writeable = False
    return uv


def _ground(floor: Floor, uv: FloatArray, name: str) -> FloatArray:
    from shapely import Polygon  # type: ignore[import-untyped]

    if not Polygon(uv).is_valid:
        raise InputError(f"{name} crosses or touches itself; draw it as two, or in order")
    xy = floor.position(uv)
    hidden = np.flatnonzero(~np.isfinite(xy).all(axis=1))
    if len(hidden):
        u, v = uv[hidden[0]].tolist()
        raise InputError(
            f"{name} reaches the horizon or beyond at corner {hidden[0]} ({u:g}, {v:g}) px; "
            "keep it on visible ground"
        )
    area = Polygon(xy).area
    if not (isfinite(area) and area > 0 and Polygon(xy).is_valid):
        raise InputError(f"{name} has no area on the ground; move its corners apart")
    return xy


def _foot(floor: Floor) -> tuple[float, float, float] | None:
    """Line where the visible ground ends below the camera; none for a camera that looks straight down."""
    a, b, c = (float(x) * floor.side for x in floor.image_from_ground[2])
    length = hypot(a, b)
    if length < 1e-12 * abs(c):
        return None
    return a / length, b / length, c / length
