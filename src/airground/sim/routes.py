"""Shapes to drive: straight lines, arcs of circles and turns on the spot, so that a unicycle can follow them exactly.

A shape has no size yet; `airground.sim.route_drive` scales it, moves it into the image and drives it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly
from airground.sim.unicycle import arc

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["DRIVES", "Route", "polyline", "route"]

DRIVES = (
    "rectangle",
    "lawn_mower",
    "eight_segments",
    "figure_eight",
    "circle",
    "quarter_circle",
    "triangle",
    "straight",
    "random_turns",
)
"""Names that `route` knows."""

LANES = 6  # of the lawn-mower
WAYPOINTS = 12  # of the random turns
OUTLINE_STEPS = 25  # on each piece; an arc of a whole turn is met within 1 % of its radius
LEAST_ROUND = 1 / 3  # of the radius asked for; a sharper corner is a turn on the spot
NO_TURN = 1e-12  # rad


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """Pieces of a path, one after the other, of about unit size."""

    lengths: FloatArray
    """(P,). Length of each piece; 0 for a turn on the spot."""

    turns: FloatArray
    """(P,) [rad]. Turn in each piece, counter-clockwise."""

    closed: bool
    """Does it end where it started, heading as it started? Otherwise it is driven there and back."""

    heading_rad: float = 0.0
    """At the start, counter-clockwise from x [rad]."""

    def __post_init__(self) -> None:
        lengths = readonly(self.lengths, (None,), "lengths")
        turns = readonly(self.turns, lengths.shape, "turns")
        if (lengths < 0).any() or not lengths.sum() > 0:
            raise InputError("lengths must not be negative, and their sum must be positive")
        object.__setattr__(self, "lengths", lengths)
        object.__setattr__(self, "turns", turns)

    def repeated(self, laps: int) -> Route:
        """Give the route driven several times: round and round, or there and back.

        Parameters
        ----------
        laps : int
            1 or more.

        Returns
        -------
        route : Route
            An open route turns on the spot at its ends, and comes back on its own path.
        """
        lengths, turns = self.lengths, self.turns
        if not self.closed:
            about = np.array([np.pi])
            lengths = np.concatenate([lengths, [0.0], lengths[::-1], [0.0]])
            turns = np.concatenate([turns, about, -turns[::-1], about])
            pieces = laps * len(self.lengths) + (laps - 1)
            laps = (laps + 1) // 2
        else:
            pieces = laps * len(lengths)
        return Route(
            np.tile(lengths, laps)[:pieces],
            np.tile(turns, laps)[:pieces],
            closed=self.closed,
            heading_rad=self.heading_rad,
        )

    def turned(self, angle_rad: float) -> Route:
        """Give the route with another heading at its start.

        Parameters
        ----------
        angle_rad : float [rad]
            Turn, counter-clockwise.

        Returns
        -------
        route : Route
            The same shape.
        """
        return Route(
            self.lengths, self.turns, closed=self.closed, heading_rad=self.heading_rad + angle_rad
        )

    def corners(self) -> tuple[FloatArray, FloatArray]:
        """Where the pieces start and end.

        Returns
        -------
        xy : (P + 1, 2) array
            From (0, 0) on, in units of the lengths.
        theta : (P + 1,) array [rad]
            Headings there; they do not wrap.
        """
        theta = self.heading_rad + np.concatenate([[0.0], np.cumsum(self.turns)])
        steps = arc(theta[:-1], self.lengths, self.turns, 1.0)
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), theta

    def outline(self) -> FloatArray:
        """Points along the path.

        Returns
        -------
        xy : (M, 2) array
            The corners, and points on the arcs: enough to tell its extent.
        """
        xy, theta = self.corners()
        bent = (self.lengths > 0) & (self.turns != 0)
        # `arc` takes speed and rate over a time; here both are a share of the whole piece, over 1.
        share = np.linspace(0.0, 1.0, OUTLINE_STEPS)[1:-1, None]
        along = arc(theta[:-1][bent], self.lengths[bent] * share, self.turns[bent] * share, 1.0)
        return np.concatenate([xy, (xy[:-1][bent] + along).reshape(-1, 2)])


def polyline(points: ArrayLike, *, closed: bool = False, radius: float = 0.0) -> Route:
    """Straight legs from point to point, with turns on the spot or rounded corners between them.

    Parameters
    ----------
    points : (N, 2) array_like
        Corners, no two neighbours equal; a closed route comes back to the first.
    closed : bool
        Whether it does.
    radius : float
        Of the rounded corners, less where the legs are short, and none where they leave less than a third of it; 0 to
        turn on the spot.

    Returns
    -------
    route : Route
        A closed one starts in the middle of its first leg, so that every corner is whole.
    """
    points = np.asarray(points, dtype=np.float64)
    if closed:
        middle = (points[0] + points[1]) / 2
        points = np.concatenate([[middle], points[1:], points[:1], [middle]])
    legs = np.diff(points, axis=0)
    lengths = np.hypot(*legs.T)
    if len(lengths) == 0 or not (lengths > 0).all():
        raise InputError("a polyline needs two points or more, and neighbours that differ")
    heading = np.arctan2(legs[:, 1], legs[:, 0])
    turns = (np.diff(heading) + np.pi) % (2 * np.pi) - np.pi
    tangent = np.abs(np.tan(turns / 2))  # the way that a corner of radius 1 takes off each leg
    room = 0.45 * np.minimum(lengths[:-1], lengths[1:])
    cut = np.minimum(radius * tangent, room)
    cut[cut < LEAST_ROUND * radius * tangent] = 0.0
    cut[np.abs(turns) < NO_TURN] = 0.0
    corner = np.abs(turns) * cut / np.maximum(tangent, NO_TURN)
    straight = lengths - np.append(cut, 0.0) - np.append(0.0, cut)
    pieces = np.zeros(2 * len(lengths) - 1)
    bends = np.zeros_like(pieces)
    pieces[::2], pieces[1::2], bends[1::2] = straight, corner, turns
    keep = (pieces > 0) | (np.abs(bends) >= NO_TURN)
    return Route(pieces[keep], bends[keep], closed=closed, heading_rad=float(heading[0]))


def route(name: str, *, radius: float = 0.0, rng: np.random.Generator | None = None) -> Route:
    """Give a route by its name.

    Parameters
    ----------
    name : str
        One of `DRIVES`.
    radius : float
        Of the rounded corners of what has corners, in units of the shape, which is about 1.6 by 1; 0 to turn on the
        spot.
    rng : Generator, optional
        Where the random turns come from; seed 0 where not given.

    Returns
    -------
    route : Route
        Of about unit size, starting at (0, 0).

    Raises
    ------
    InputError
        If the name is not known.
    """
    if name in _CURVES:
        return _CURVES[name]
    if name not in DRIVES:
        raise InputError(f"drive must be one of {', '.join(DRIVES)}, not {name!r}")
    rng = rng or np.random.default_rng(0)
    points = (
        rng.uniform([0, 0], [1.6, 1.0], (WAYPOINTS, 2))
        if name == "random_turns"
        else _CORNERS[name]
    )
    return polyline(points, closed=name in ("rectangle", "triangle"), radius=radius)


def _lanes() -> FloatArray:
    across = np.repeat(np.arange(LANES) / (LANES - 1), 2)
    along = np.resize([0.0, 1.6, 1.6, 0.0], 2 * LANES)
    return np.column_stack([along, across])


def _segments() -> FloatArray:
    """The paper's (section 3.1)."""
    angle = np.pi / 6 * np.arange(8)
    steps = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


_CORNERS = {
    "rectangle": np.array([[0.0, 0.0], [1.6, 0.0], [1.6, 1.0], [0.0, 1.0]]),
    "triangle": np.array([[0.0, 0.0], [1.6, 0.0], [0.5, 1.0]]),
    "straight": np.array([[0.0, 0.0], [1.6, 0.0]]),
    "lawn_mower": _lanes(),
    "eight_segments": _segments(),
}

_WHOLE = 2 * np.pi
_CURVES = {
    "circle": Route(np.array([_WHOLE]), np.array([_WHOLE]), closed=True),
    "quarter_circle": Route(np.array([_WHOLE / 4]), np.array([_WHOLE / 4]), closed=False),
    "figure_eight": Route(  # a circle to the left and one to the right
        np.full(2, _WHOLE), np.array([_WHOLE, -_WHOLE]), closed=True, heading_rad=np.pi / 2
    ),
}
