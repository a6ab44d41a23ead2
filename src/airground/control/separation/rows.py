"""The hard part: robots keep apart, inside and clear of others, and can come to rest so, whatever the others do.

For each robot a step's motion lies between B, braking as hard as it may, and T, what it shall do. What two robots need
to come to rest after B are two stadiums (`reach`); n is the direction of their shortest distance. With the
extents ``f(n)`` of their stadiums after a motion, the barrier ``h = -f_i(n) - f_j(-n) - R`` must stay above
``(1 - gamma) h_B``, or not fall below ``h_B`` where that is negative already. Braking fulfils all of it at once, so
there always is an answer. A boundary's edge, and the strip that a passer-by sweeps meanwhile, are
the same with one robot.

Only what brings a robot nearer than braking counts, never what takes it away: so it holds too if the other brakes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airground.control.separation.qp import nearest
from airground.control.separation.reach import (
    ComplexArray,
    Fleet,
    Motion,
    Stadium,
    dot,
    stop_after,
)
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Pairs", "Rows", "Segments", "certain", "gather", "point_gap", "segment_gap"]

Indices = NDArray[np.intp]

_TOUCH = 1e-9
_SLIP = 1e-4  # [m] by which a row may be passed, as it is not quite linear, before commands are cut back
_HALVINGS = 3


class Pairs(NamedTuple):
    """Robots that come near each other."""

    first: Indices
    """(P,). A robot."""

    second: Indices
    """(P,). The other."""

    apart: FloatArray
    """(P,) [m]. Distance to keep between their middles."""


class Segments(NamedTuple):
    """What stands or moves beside a robot: segments, one per constraint."""

    who: Indices
    """(M,). The robot."""

    start: ComplexArray
    """(M,) [m]. One end."""

    end: ComplexArray
    """(M,) [m]. The other."""

    apart: FloatArray
    """(M,) [m]. Distance to keep from the robot's middle."""

    label: Indices
    """(M,). What it is, for the caller."""


class Rows(NamedTuple):
    """Constraints on the approach of robots."""

    who: Indices
    """(M,). A robot."""

    other: Indices
    """(P,). The other robot, in the first P rows; the rest is with what is no robot."""

    normal: ComplexArray
    """(M,). Unit vectors from the first to the second."""

    room: FloatArray
    """(M,) [m]. h_B: gap beyond the distance to keep, if all brake."""

    label: Indices
    """(M,). The other robot, or the caller's label."""

    concerned: Indices
    """(M + P,). Whom a row moves: the first robots of all rows, then the others."""

    towards: ComplexArray
    """(M + P,). Unit vectors along which each of those comes nearer."""

    braked: FloatArray
    """(M + P,) [m]. How far each of those reaches along them if it brakes."""

    def approach(self, needed: Stadium) -> tuple[FloatArray, FloatArray]:
        """How much nearer motions bring robots than braking.

        Parameters
        ----------
        needed : Stadium
            (..., N): after those motions.

        Returns
        -------
        first : (..., M) array [m]
            Shares of the first robots, 0 or more.
        second : (..., P) array [m]
            Shares of the others.
        """
        share = np.maximum(needed.extent(self.concerned, self.towards) - self.braked, 0.0)
        count = len(self.who)
        return share[..., :count], share[..., count:]


def gather(base: Stadium, pairs: Pairs, others: Segments) -> Rows:
    """Constraints from pairs of robots and from what is beside them.

    Parameters
    ----------
    base : Stadium
        (N,). After braking.
    pairs : Pairs
        Robots.
    others : Segments
        Boundaries and passers-by.

    Returns
    -------
    rows : Rows
        Pairs first.
    """
    i, j, apart = pairs
    who = np.concatenate([i, others.who])
    start = np.concatenate([base.start[j], others.start])
    end = np.concatenate([base.end[j], others.end])
    keep = np.concatenate([apart + base.wide[j], others.apart]) + base.wide[who]
    gap, normal = segment_gap(base.start[who], base.end[who], start, end)
    concerned = np.concatenate([who, j])
    towards = np.concatenate([normal, -normal[: len(j)]])
    label = np.concatenate([j, others.label])
    braked = base.extent(concerned, towards)
    return Rows(who, j, normal, gap - keep, label, concerned, towards, braked)


def certain(
    robots: Fleet,
    brake: Motion,
    target: Motion,
    rows: Rows,
    *,
    dt: float,
    reaction_s: float,
    gamma: float,
    solve: Callable[..., FloatArray | None] = nearest,
) -> tuple[Motion, NDArray[np.bool_], bool]:
    """Motions nearest to the target that keep all constraints.

    Parameters
    ----------
    robots : Fleet
        As they move now.
    brake, target : Motion
        B and T.
    rows : Rows
        Constraints.
    dt : float [s]
        The step.
    reaction_s : float [s]
        Time before robots begin to brake.
    gamma : float
        Share of the room that may be used in one step.
    solve : callable
        Solver of the quadratic program, like `separation_qp.nearest`.

    Returns
    -------
    motion : Motion
        Between B and T.
    tight : (M,) array of bool
        Rows that T would violate.
    solved : bool
        False where the solver failed; robots in tight rows then brake.
    """
    paired, count = len(rows.other), len(robots.radius)
    room = gamma * np.maximum(rows.room, 0.0)

    def nearer(motions: Motion) -> tuple[FloatArray, FloatArray]:
        return rows.approach(stop_after(robots, motions, dt, reaction_s))

    def over(first: FloatArray, second: FloatArray, slip: float) -> NDArray[np.bool_]:
        total = first - slip
        total[:paired] += second
        return np.asarray(total > room)

    # T, then its velocity alone, then its turn rate alone
    drives = np.array([target.drive, target.drive, brake.drive])
    turns = np.array([target.turn, brake.turn, target.turn])
    first, second = nearer(Motion(drives, turns))
    tight = over(first[0], second[0], _TOUCH)
    if not tight.any():
        return target, tight, True

    # lambda in [0, 1] from B to T, of the velocity, then of the turn rate, times the size of that change
    change = Motion(target.drive - brake.drive, target.turn - brake.turn)
    size = np.concatenate([np.abs(change.drive), np.abs(robots.radius * change.turn)])
    matrix = np.zeros((len(rows.who), 2 * count))
    at = np.arange(len(rows.who))
    for k, offset in ((1, 0), (2, count)):
        matrix[at, offset + rows.who] = first[k]
        matrix[at[:paired], offset + rows.other] = second[k]
    counts = matrix.sum(axis=1) > room  # others hold all over the box
    matrix, bounds = matrix[counts], room[counts]
    if robots.any_car:
        cars, car_bounds = _cars(robots, brake, target)
        matrix, bounds = np.concatenate([matrix, cars]), np.concatenate([bounds, car_bounds])
    moves = size > 0
    scale = np.where(moves, 1.0 / np.maximum(size, 1e-12), 0.0)
    found = solve(size, np.zeros(2 * count), size, matrix * scale, bounds)
    solved = found is not None
    share = np.where(moves, 1.0 if found is None else found * scale, 0.0).reshape(2, count)
    if not solved:
        share[:, _concerned(rows, tight, count)] = 0.0

    for attempt in range(count + _HALVINGS + 1):
        drive, turn = brake.drive + share[0] * change.drive, brake.turn + share[1] * change.turn
        bad = over(*nearer(Motion(drive, turn)), _SLIP)
        if not bad.any():
            break
        share[:, _concerned(rows, bad, count)] *= 0.5 if attempt < _HALVINGS else 0.0
    return Motion(drive, turn), tight, solved


def _concerned(rows: Rows, which: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Robots in some rows."""
    concerned = np.zeros(count, dtype=np.bool_)
    concerned[rows.who[which]] = True
    concerned[rows.other[which[: len(rows.other)]]] = True
    return concerned


def _cars(robots: Fleet, brake: Motion, target: Motion) -> tuple[FloatArray, FloatArray]:
    """Rows of the smallest turn radius, both ways: +-omega <= |v| bend, which B and T fulfil."""
    who, count = np.flatnonzero(np.isfinite(robots.bend)), len(robots.radius)
    slow, fast = np.abs(brake.drive[who]), np.abs(target.drive[who])
    bend, at = robots.bend[who], np.arange(len(who))
    blocks, bounds = [], []
    for sign in (1.0, -1.0):
        block = np.zeros((len(who), 2 * count))
        block[at, who] = -bend * (fast - slow)
        block[at, count + who] = sign * (target.turn[who] - brake.turn[who])
        blocks.append(block)
        bounds.append(bend * slow - sign * brake.turn[who])
    return np.concatenate(blocks), np.maximum(np.concatenate(bounds), 0.0)


def segment_gap(
    a: ComplexArray, b: ComplexArray, c: ComplexArray, d: ComplexArray
) -> tuple[FloatArray, ComplexArray]:
    """Distance of segments, and its direction.

    Parameters
    ----------
    a, b : (M,) complex array [m]
        Ends of the first.
    c, d : (M,) complex array [m]
        Ends of the second.

    Returns
    -------
    gap : (M,) array [m]
        0 where they meet.
    normal : (M,) complex array
        Unit vector from the first to the second; where they meet, from `a` to what is nearest to it of the second.
    """
    # of each segment and the ends of the other: both of the second from the first, both of the first from the second
    origin = np.array([a, a, c, c])
    step = np.array([b, b, d, d]) - origin
    rel = np.array([c, d, a, b]) - origin
    share = dot(step, rel) / np.maximum(dot(step, step), 1e-30)
    away = rel - np.minimum(np.maximum(share, 0.0), 1.0) * step  # from the segment to the point
    away[2:] *= -1.0  # from the first to the second
    length = np.abs(away)
    best, at = length.argmin(axis=0), np.arange(len(a))
    gap, normal = length[best, at], away[best, at]
    # no complex product here, as that may leave something of 0 where all lie on one line
    side = step.real * rel.imag - step.imag * rel.real
    meet = (side[0::2] * side[1::2] < 0).all(axis=0)  # each has the other's ends on both sides
    lost = meet | (gap < _TOUCH)
    if lost.any():
        gap = np.where(lost, 0.0, gap)
        from_a = np.where(length[2] > _TOUCH, away[2], (c + d) / 2 - a)
        normal = np.where(lost, from_a, normal)
    size = np.abs(normal)
    return gap, np.where(size > 0, normal / np.maximum(size, 1e-30), 1.0)


def point_gap(p: ComplexArray, c: ComplexArray, d: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    """Distance of points from segments, and its direction.

    Parameters
    ----------
    p : (M,) complex array [m]
        Points.
    c, d : (M,) complex array [m]
        Ends of the segments.

    Returns
    -------
    gap : (M,) array [m]
        0 on the segment.
    normal : (M,) complex array
        Unit vector from the point to the segment; from a point on it to its middle.
    """
    rel, step = c - p, d - c
    share = -dot(step, rel) / np.maximum(dot(step, step), 1e-30)
    normal = rel + np.minimum(np.maximum(share, 0.0), 1.0) * step
    gap = np.abs(normal)
    touch = gap < _TOUCH
    if touch.any():
        normal = np.where(touch, rel + step / 2, normal)
        gap = np.where(touch, 0.0, gap)
    size = np.abs(normal)
    return gap, np.where(size > 0, normal / np.maximum(size, 1e-30), 1.0)
