"""The shortest way of a forward drive with a least turn radius: a turn, a straight, a turn, or three turns (Dubins).

Lengths in turn radii below; a turn to the left is positive.
"""

from __future__ import annotations

from math import acos, atan2, cos, hypot, pi, sin, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["shortest_way"]

Way = tuple[float, float]
"""Signed angle of the first turn [rad], length of all."""


def shortest_way(x: float, y: float, phi: float, radius: float) -> Way:
    """From a pose to the origin, heading along x.

    Parameters
    ----------
    x, y : float [m]
        Where it starts.
    phi : float [rad]
        Heading there.
    radius : float [m]
        Least turn radius.

    Returns
    -------
    turn : float [rad]
        Of the first piece: left is positive, 0 where the way begins straight.
    length : float [m]
        Of the whole way.
    """
    first, length = min(_ways(x / radius, y / radius, phi), key=lambda way: way[1])
    return first, length * radius


def _ways(x: float, y: float, phi: float) -> Iterator[Way]:
    c, s = cos(phi), sin(phi)
    for side in (1.0, -1.0):
        # Centres of the first circle on this side, and of the last on either side.
        cx, cy = x - side * s, y + side * c
        # Same side: a straight between centres.
        dx, dy = -cx, side - cy
        d, way = hypot(dx, dy), atan2(dy, dx)
        first = _turn(side * (way - phi))
        last = _turn(-side * way)
        yield _whole(side, first, d, side * last)
        if d < 4:  # three turns: the middle circle touches both
            bend = acos(d / 4)
            # Heading changes: along side, against it by pi + 2 bend, along it again.
            middle = pi + 2 * bend
            start = _turn(side * (way - phi) + bend + pi / 2)
            end = _turn(-side * phi - start + middle)
            yield side * start, start + middle + end
        # The other side: the straight crosses between the circles.
        dx, dy = -cx, -side - cy
        d, way = hypot(dx, dy), atan2(dy, dx)
        if d >= 2 - 1e-9:  # two turns and no straight are exactly 2
            straight = sqrt(max(0.0, d * d - 4))
            cross = atan2(2.0, straight)
            heading = way + side * cross
            first = _turn(side * (heading - phi))
            last = _turn(side * heading)
            yield _whole(side, first, straight, -side * last)


def _turn(angle: float) -> float:
    """In 0..2 pi; what rounding made almost a full turn is none."""
    angle %= 2 * pi
    return 0.0 if angle > 2 * pi - 1e-9 else angle


def _whole(side: float, first: float, straight: float, last: float) -> Way:
    """`last` with its sign; it is the first piece of a way that has no other."""
    turn = side * first if first > 1e-9 or straight > 1e-9 else last
    return turn, first + straight + abs(last)
