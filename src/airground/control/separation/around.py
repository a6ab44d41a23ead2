"""What is near which robot: other robots, boundaries, passers-by, with the distances to keep."""

from __future__ import annotations

from functools import lru_cache
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.control.separation.rows import Pairs, Segments
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from airground.control.separation.fence import Fence
    from airground.control.separation.reach import ComplexArray, Fleet
    from airground.control.separation.types import Passerby

__all__ = ["PASSERBY", "Around", "joined", "look_around", "strips"]

PASSERBY = -10
"""Label of the first passer-by; the next is one less. Boundaries have -1 minus their kind's place in `Fence.kinds`."""

_BACK = 1.0  # [m]
_ALWAYS = 1e3  # [m] distance to keep that never is kept


class Around(NamedTuple):
    """What is near which robot."""

    pairs: Pairs
    """Robots."""

    walls: Segments
    """Edges of fence and obstacles."""

    strays: Segments
    """For robots that are where they may not be: a point in the direction that they must not go on in."""

    passing: Segments
    """Passers-by, where they are now."""

    passing_dot: ComplexArray
    """(Q,) [m/s]. Their velocities."""

    clearance_m: float
    """Least gap between discs, or a disc and a boundary [m]; margins left out."""

    @property
    def empty(self) -> bool:
        """Whether nothing is near any robot."""
        near = (self.pairs.first, self.walls.who, self.strays.who, self.passing.who)
        return not any(map(len, near))


def look_around(
    robots: Fleet,
    fence: Fence | None,
    passersby: Sequence[Passerby],
    *,
    margin_m: float,
    sigmas: float,
    reach: FloatArray,
    wall_reach: FloatArray,
) -> Around:
    """Find what is near which robot.

    Parameters
    ----------
    robots : Fleet
        As they move now.
    fence : Fence or None
        Where they may be.
    passersby : sequence of Passerby
        What else is there.
    margin_m : float [m]
        Gap to keep.
    sigmas : float
        Deviations to keep beyond it.
    reach : (N,) array [m]
        How far each looks for what moves.
    wall_reach : (N,) array [m]
        How far for boundaries.

    Returns
    -------
    around : Around
        Nothing that is further away than robots look.
    """
    i, j = _all_pairs(len(robots.radius))
    distance = np.abs(robots.at[j] - robots.at[i])
    touch = robots.radius[i] + robots.radius[j]
    least = float((distance - touch).min(initial=inf))
    apart = touch + (margin_m + sigmas * np.hypot(robots.sigma[i], robots.sigma[j]))
    near = distance < apart + reach[i] + reach[j]
    pairs = Pairs(i[near], j[near], apart[near])

    walls = strays = passing = _nothing()
    passing_dot = passing.start
    if fence is not None:
        own = robots.radius + margin_m + sigmas * robots.sigma
        walls, strays, clear = _walls(robots, fence, own, wall_reach)
        least = min(least, clear)
    if passersby:
        passing, passing_dot, clear = _passing(robots, passersby, margin_m, sigmas, reach)
        least = min(least, clear)
    return Around(pairs, walls, strays, passing, passing_dot, least)


@lru_cache
def _all_pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Each pair of robots once; the same arrays at each step."""
    i, j = np.triu_indices(count, 1)
    i.flags.writeable = j.flags.writeable = False
    return i, j


def strips(around: Around, seconds: FloatArray) -> Segments:
    """Ground that passers-by sweep while robots stop.

    Parameters
    ----------
    around : Around
        With passers-by.
    seconds : (N,) array [s]
        How long each robot takes to stop.

    Returns
    -------
    strips : Segments
        From where each passer-by is now.
    """
    passing = around.passing
    if not len(passing.who):
        return passing
    return passing._replace(end=passing.start + around.passing_dot * seconds[passing.who])


def joined(*parts: Segments) -> Segments:
    """All in one.

    Parameters
    ----------
    *parts : Segments
        Some.

    Returns
    -------
    all : Segments
        In their order.
    """
    some = [part for part in parts if len(part.who)]
    if len(some) < 2:
        return some[0] if some else parts[0]
    return Segments(*map(np.concatenate, zip(*some, strict=True)))


def _walls(
    robots: Fleet, fence: Fence, own: FloatArray, reach: FloatArray
) -> tuple[Segments, Segments, float]:
    xy = robots.at.view(np.float64).reshape(-1, 2)  # as x, y
    distance, clear = fence.look(xy)
    near = distance < (own + reach)[:, None]
    least = float((clear - robots.radius).min())
    strays = _nothing()
    if clear.min() < 0:
        who, points = [], []
        for k in np.flatnonzero(clear < 0).tolist():
            x, y = xy[k].tolist()
            nearest = fence.boundary(x, y)
            if nearest is None:
                continue
            who.append(k)
            points.append(complex(x - _BACK * nearest.normal[0], y - _BACK * nearest.normal[1]))
            near[k] &= fence.edge_kinds != fence.kinds.index(nearest.kind)  # or it cannot come back
        at = np.array(points)
        label = np.full(len(who), -1)
        strays = Segments(np.array(who), at, at, np.full(len(who), _ALWAYS), label)
    which_robot, which = np.nonzero(near)
    start, end = fence.ends[:, which]
    label = -1 - fence.edge_kinds[which]
    return Segments(which_robot, start, end, own[which_robot], label), strays, least


def _passing(
    robots: Fleet,
    passersby: Sequence[Passerby],
    margin_m: float,
    sigmas: float,
    reach: FloatArray,
) -> tuple[Segments, ComplexArray, float]:
    rows = np.array([(*p.xy, *p.xy_dot, p.radius_m, p.sigma_m) for p in passersby]).T
    at, at_dot, radius, sigma = rows[0] + 1j * rows[1], rows[2] + 1j * rows[3], rows[4], rows[5]
    distance = np.abs(at - robots.at[:, None])
    touch = robots.radius[:, None] + radius
    apart = touch + (margin_m + sigmas * np.hypot(robots.sigma[:, None], sigma))
    # it comes as near as a robot of its speed would
    faster = 1.0 + np.abs(at_dot) / np.maximum(robots.speed, 0.1)[:, None]
    who, which = np.nonzero(distance < apart + reach[:, None] * faster)
    found = Segments(who, at[which], at[which], apart[who, which], PASSERBY - which)
    return found, at_dot[which], float((distance - touch).min())


def _nothing() -> Segments:
    none, points = np.empty(0, dtype=np.intp), np.empty(0, dtype=np.complex128)
    return Segments(none, points, points, np.empty(0), none)
