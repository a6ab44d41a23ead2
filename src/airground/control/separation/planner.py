"""The shortest way round obstacles to a goal, both given in the image.

Where a robot's middle may be is the fence without the obstacles, shrunk by the robot's radius. Shortest ways there are
polylines from corner to corner, so Dijkstra's algorithm runs on the corners that see each other. Round corners become
polygons outside the circles, so ways never come nearer than the radius; they are longer than the true shortest way by
well under 1 %. Smooth them afterwards, or let a path follower do it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, isfinite, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.control.separation.fence import Fence
from airground.errors import InputError, NoWayError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.control.floor import Floor

__all__ = ["WayPlanner", "plan_way"]

_PER_QUADRANT = 8  # chords of a round corner; they touch its circle from outside
_HAIR = 1e-7  # [m] by which ways may lie outside, against rounding
_FAR = 1e5  # [m] where ground without a fence is taken to end


@dataclass(frozen=True, slots=True, eq=False)
class WayPlanner:
    """Plans many ways for robots of one size past the same obstacles."""

    fence: Fence
    """Where robots may be."""

    radius_m: float
    """Clearance that a robot's middle needs [m]: its radius and a margin."""

    _corners: FloatArray = field(init=False, repr=False)
    """(K, 2) [m]. Corners that a shortest way may touch."""

    _lengths: FloatArray = field(init=False, repr=False)
    """(K, K) [m]. Distances of corners that see each other; infinite where they do not."""

    _free: Any = field(init=False, repr=False)
    """Where robots' middles may be, as a shapely geometry; None where there is no limit."""

    _roomy: Any = field(init=False, repr=False)
    """The same, a hair larger."""

    def __post_init__(self) -> None:
        import shapely  # type: ignore[import-untyped]

        if not (isfinite(self.radius_m) and self.radius_m >= 0):
            raise InputError(f"radius_m must be 0 or more and finite, not {self.radius_m}")
        free = _shrunk(self.fence, self.radius_m)
        roomy = None if free is None else free.buffer(_HAIR, join_style="mitre")
        shapely.prepare(roomy)
        object.__setattr__(self, "_free", free)
        object.__setattr__(self, "_roomy", roomy)
        corners = np.empty((0, 2)) if free is None else _corners(free)
        object.__setattr__(self, "_corners", corners)
        i, j = np.triu_indices(len(corners), 1)
        lengths = np.full((len(corners),) * 2, np.inf)
        seen = self._sees(corners[i], corners[j])
        step = corners[i] - corners[j]
        lengths[i, j] = lengths[j, i] = np.where(seen, np.hypot(step[:, 0], step[:, 1]), np.inf)
        object.__setattr__(self, "_lengths", lengths)

    def way(self, start_uv: ArrayLike, goal_uv: ArrayLike) -> FloatArray:
        """Shortest way.

        A robot that stands within an obstacle's margin, but not in the obstacle, first leaves the margin straight.

        Parameters
        ----------
        start_uv, goal_uv : (2,) array_like [px]
            Where the robot is, and where it shall be.

        Returns
        -------
        way : (N, 2) array [px]
            Corners of the way, start and goal included; straight in between, in the image and on the ground.

        Raises
        ------
        NoWayError
            If start or goal are not where robots may be, or nothing connects them; `nearest_uv` says what is nearest to
            the goal of all that can be reached, or to the start of all that is allowed.
        """
        floor = self.fence.floor
        start = _position(floor, start_uv, "start_uv")
        goal = _position(floor, goal_uv, "goal_uv")
        if not self.fence.inside(start):
            raise NoWayError(
                "start_uv lies where no robot may be; drive the robot out by hand",
                self._nearest(start, self._free),
            )
        lead = start
        if not self._allowed(start):
            lead = self._left_margin(start)
        if not self._allowed(goal):
            part = self._part(lead)
            raise NoWayError(
                f"goal_uv has less than {self.radius_m:g} m to the fence or an obstacle; choose another",
                self._nearest(goal, part),
            )
        way = self._shortest(lead, goal)
        if lead is not start:
            way = np.vstack([start, way])
        return floor.pixel(way)

    def length_m(self, way_uv: ArrayLike) -> float:
        """Length of a way on the ground.

        Parameters
        ----------
        way_uv : (N, 2) array_like [px]
            A polyline.

        Returns
        -------
        length : float [m]
            NaN where it leaves the visible ground.
        """
        step = np.diff(self.fence.floor.position(readonly(way_uv, (None, 2), "way_uv")), axis=0)
        return float(np.hypot(step[:, 0], step[:, 1]).sum())

    def _shortest(self, start: FloatArray, goal: FloatArray) -> FloatArray:
        from scipy.sparse.csgraph import dijkstra  # type: ignore[import-untyped]

        if self._sees(start[None], goal[None])[0]:
            return np.stack([start, goal])
        nodes = np.vstack([self._corners, start, goal])
        count = len(self._corners)
        lengths = np.full((count + 2, count + 2), np.inf)
        lengths[:count, :count] = self._lengths
        for end in (count, count + 1):
            step = self._corners - nodes[end]
            seen = self._sees(np.broadcast_to(nodes[end], self._corners.shape), self._corners)
            lengths[end, :count] = np.where(seen, np.hypot(step[:, 0], step[:, 1]), np.inf)
            lengths[:count, end] = lengths[end, :count]
        total, before = dijkstra(
            np.ma.masked_invalid(lengths).filled(0.0), indices=count, return_predecessors=True
        )
        if not np.isfinite(total[count + 1]):
            part = self._part(start)
            raise NoWayError(
                "no way leads to goal_uv: fence and obstacles leave no gap that is wide enough",
                self._nearest(goal, part),
            )
        chain = [count + 1]
        while chain[-1] != count:
            chain.append(int(before[chain[-1]]))
        return np.asarray(nodes[chain[::-1]])

    def _sees(self, a: FloatArray, b: FloatArray) -> np.ndarray:
        """Whether a robot can drive straight from a to b."""
        import shapely

        if self._free is None or not len(a):
            return np.ones(len(a), dtype=np.bool_)
        return np.asarray(
            shapely.covers(self._roomy, shapely.linestrings(np.stack([a, b], axis=1)))
        )

    def _allowed(self, xy: FloatArray) -> bool:
        return bool(self._sees(xy[None], xy[None] + _HAIR / 10)[0])

    def _left_margin(self, start: FloatArray) -> FloatArray:
        """Nearest place to the start that has its clearance, on a straight line without a crossing."""
        import shapely

        best = None
        for part in getattr(self._free, "geoms", [self._free]):
            if part.is_empty:
                continue
            line = shapely.shortest_line(shapely.Point(start), part)
            end = np.asarray(line.coords)[1]
            along = start + np.linspace(0.0, 1.0, 33)[1:, None] * (end - start)
            if (self.fence.clearance(along) > 0).all() and (
                best is None or line.length < np.hypot(*(best - start))
            ):
                best = end
        if best is None:
            raise NoWayError(
                f"start_uv has less than {self.radius_m:g} m around it, and no straight way out; "
                "drive the robot out by hand",
                self._nearest(start, self._free),
            )
        return np.asarray(best)

    def _part(self, xy: FloatArray) -> Any:
        """What of the free ground is connected with a place in it."""
        import shapely

        if self._free is None:
            return None
        parts = getattr(self._free, "geoms", [self._free])
        return min(parts, key=lambda part: float(shapely.distance(part, shapely.Point(xy))))

    def _nearest(self, xy: FloatArray, shape: Any) -> tuple[float, float] | None:
        import shapely

        if shape is None or shape.is_empty:
            return None
        line = shapely.shortest_line(shapely.Point(xy), shape)
        u, v = self.fence.floor.pixel(np.asarray(line.coords)[1]).tolist()
        return (u, v)


def plan_way(
    start_uv: ArrayLike, goal_uv: ArrayLike, *, fence: Fence, radius_m: float
) -> FloatArray:
    """Shortest way of one robot; a `WayPlanner` is quicker for many.

    Parameters
    ----------
    start_uv, goal_uv : (2,) array_like [px]
        Where the robot is, and where it shall be.
    fence : Fence
        Where robots may be.
    radius_m : float [m]
        Clearance that the robot's middle needs: its radius and a margin.

    Returns
    -------
    way : (N, 2) array [px]
        Corners of the way, start and goal included.

    Raises
    ------
    NoWayError
        If start or goal are not where robots may be, or nothing connects them.
    """
    return WayPlanner(fence, radius_m).way(start_uv, goal_uv)


def _position(floor: Floor, uv: ArrayLike, name: str) -> FloatArray:
    xy = floor.position(readonly(uv, (2,), name))
    if not np.isfinite(xy).all():
        raise NoWayError(f"{name} is on or beyond the horizon; choose a place on the ground")
    return xy


def _shrunk(fence: Fence, radius_m: float) -> Any:
    """Where robots' middles may be."""
    import shapely

    radius = radius_m / cos(1.1 * pi / (4 * _PER_QUADRANT))  # chords may be a little longer
    grown = None
    if fence.obstacles is not None:
        grown = fence.obstacles.shape.buffer(radius, quad_segs=_PER_QUADRANT)
    if fence.fence is None:
        if grown is None:
            return None
        return _view(fence, radius_m).difference(grown)
    # what is outside the fence grows inwards, with the corners of the circles outside
    outside = shapely.box(*(np.array(fence.fence.shape.bounds) + np.array([-1, -1, 1, 1])))
    outside = outside.difference(fence.fence.shape).buffer(radius, quad_segs=_PER_QUADRANT)
    free = fence.fence.shape.difference(outside)
    return free if grown is None else free.difference(grown)


def _view(fence: Fence, radius_m: float) -> Any:
    """All ground that is seen, its end below the camera left out."""
    import shapely

    room = shapely.box(-_FAR, -_FAR, _FAR, _FAR)
    if not len(edge := fence.view):
        return room
    start, end = edge
    along = (end - start) / np.hypot(*(end - start))
    inward = np.array([-along[1], along[0]])
    foot = (start + end) / 2 + radius_m * inward
    corners = [
        -_FAR * along,
        _FAR * along,
        _FAR * (along + 2 * inward),
        _FAR * (2 * inward - along),
    ]
    return room.intersection(shapely.Polygon(foot + 4 * np.array(corners)))


def _corners(free: Any) -> FloatArray:
    """Corners at which the free ground is not convex."""
    import shapely

    corners = []
    for part in getattr(shapely.orient_polygons(free), "geoms", [shapely.orient_polygons(free)]):
        if part.is_empty:
            continue
        for ring in (part.exterior, *part.interiors):
            xy = np.asarray(ring.coords)[:-1]
            back, ahead = xy - np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0) - xy
            cross = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
            corners.append(xy[cross < 0])
    return np.concatenate(corners) if corners else np.empty((0, 2))
