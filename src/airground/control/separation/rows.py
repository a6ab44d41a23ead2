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

__all__ = ["Pairs", "Rows", "Segments", "certain", "gather", "segment_gap"]

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

    def approach(self, needed: Stadium) -> tuple[FloatArray, FloatArray]:
        """How much nearer motions bring robots than braking.

        Parameters
        ----------
        needed : Stadium
            (S, N): after braking, then after S - 1 other motions.

        Returns
        -------
        first : (S - 1, M) array [m]
            Shares of the first robots, 0 or more.
        second : (S - 1, P) array [m]
            Shares of the others.
        """
        first = needed.extent(self.who, self.normal)
        second = needed.extent(self.other, -self.normal[: len(self.other)])
        return np.maximum(first[1:] - first[0], 0.0), np.maximum(second[1:] - second[0], 0.0)


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
    return Rows(who, j, normal, gap - keep, np.concatenate([j, others.label]))


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

    def nearer(
        drives: list[ComplexArray], turns: list[FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        motions = Motion(np.stack([brake.drive, *drives]), np.stack([brake.turn, *turns]))
        return rows.approach(stop_after(robots, motions, dt, reaction_s))

    def over(first: FloatArray, second: FloatArray, slip: float) -> NDArray[np.bool_]:
        total = first.copy()
        total[:paired] += second
        return np.asarray(total > room + slip)

    # T, then its velocity alone, then its turn rate alone
    drives = [target.drive, target.drive, brake.drive]
    first, second = nearer(drives, [target.turn, brake.turn, target.turn])
    tight = over(first[0], second[0], _TOUCH)
    if not tight.any():
        return target, tight, True

    # lambda in [0, 1] from B to T, of the velocity, then of the turn rate, times the size of that change
    change = Motion(target.drive - brake.drive, target.turn - brake.turn)
    size = np.concatenate([np.abs(change.drive), robots.radius * np.abs(change.turn)])
    matrix = np.zeros((len(rows.who), 2 * count))
    at = np.arange(len(rows.who))
    for k, offset in ((1, 0), (2, count)):
        matrix[at, offset + rows.who] = first[k]
        matrix[at[:paired], offset + rows.other] = second[k]
    counts = matrix.sum(axis=1) > room  # others hold all over the box
    matrix, bounds = matrix[counts], room[counts]
    if not np.isinf(robots.bend).all():
        cars, car_bounds = _cars(robots, brake, target)
        matrix, bounds = np.concatenate([matrix, cars]), np.concatenate([bounds, car_bounds])
    scale = np.where(size > 0, 1.0 / np.maximum(size, 1e-12), 0.0)
    found = solve(size, np.zeros(2 * count), size, matrix * scale, bounds)
    solved = found is not None
    share = np.where(size > 0, 1.0 if found is None else found * scale, 0.0).reshape(2, count)
    if not solved:
        share[:, _concerned(rows, tight, count)] = 0.0

    for attempt in range(count + _HALVINGS + 1):
        drive, turn = brake.drive + share[0] * change.drive, brake.turn + share[1] * change.turn
        first, second = nearer([drive], [turn])
        bad = over(first[0], second[0], _SLIP)
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
    ab, cd = b - a, d - c
    step = np.stack([ab, ab, cd, cd])
    rel = np.stack([c - a, d - a, a - c, b - c])
    share = dot(rel, step) / np.maximum(dot(step, step), 1e-30)
    away = rel - np.minimum(np.maximum(share, 0.0), 1.0) * step  # from the segment to the point
    away[2:] *= -1.0  # from the first to the second
    length = np.abs(away)
    best, at = length.argmin(axis=0), np.arange(len(a))
    gap, normal = length[best, at], away[best, at]
    ac, ad, ca, cb = rel
    meet = (_cross(ab, ac) * _cross(ab, ad) < 0) & (_cross(cd, ca) * _cross(cd, cb) < 0)
    lost = meet | (gap < _TOUCH)
    if lost.any():
        gap = np.where(lost, 0.0, gap)
        from_a = np.where(length[2] > _TOUCH, away[2], (c + d) / 2 - a)
        normal = np.where(lost, from_a, normal)
    size = np.abs(normal)
    return gap, np.where(size > 0, normal / np.maximum(size, 1e-30), 1.0)


def _cross(a: ComplexArray, b: ComplexArray) -> FloatArray:
    return np.asarray(a.real * b.imag - a.imag * b.real)
