"""Patterns of points that move rigidly together, described or learned."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly
from airground.vision.detectors.constellation_learning import learned_pattern
from airground.vision.detectors.constellation_match import NEAR, Match, match_pattern
from airground.vision.detectors.constellation_view import View, fit_view

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Constellation", "view_of"]

IntArray = NDArray[np.intp]

FLAT = 0.03
"""Area of three points, over the square of their extent, below which they do not place a pattern."""

OFTEN, NEARLY_ALWAYS = 0.08, 0.9
"""Shares of the matches in which a further point must be seen to belong to the pattern, and to count as always lit."""

SMALLEST_VIEW = 30
"""Matches from which a view is believed."""


@dataclass(frozen=True, slots=True, eq=False)
class Constellation:
    """Points that move rigidly together. Its origin is what gets a position, and forward is what gets a heading."""

    points: FloatArray
    """(K, 2) [m, or any other unit]. Forward and left, seen from above; three or more, not on one line."""

    always: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    """(K,). False for points that blink; all are always lit where not given."""

    view: View | None = None
    """How the camera stretches the pattern at each place; None where that is not known."""

    size: float = field(init=False)
    """Distance of the two points that are furthest apart."""

    triples: IntArray = field(init=False)
    """(T, 3). Sets of three points that place the pattern."""

    ambiguous: bool = field(init=False)
    """Whether it looks the same after some turn: then it has no heading."""

    def __post_init__(self) -> None:
        points = readonly(self.points, (None, 2), "points")
        count = len(points)
        always = np.array(self.always, dtype=np.bool_)
        always = always if always.size else np.ones(count, dtype=np.bool_)
        if always.shape != (count,):
            raise InputError(f"always must have shape ({count},), not {always.shape}")
        if not 3 <= count <= 12:
            raise InputError(f"a constellation has 3 to 12 points, not {count}")
        always.flags.writeable = False
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "always", always)
        object.__setattr__(self, "triples", _triples(points, always))
        if not len(self.triples):
            raise InputError("a constellation's points must not lie on one line")
        pairs = combinations(range(count), 2)
        size = max(float(np.linalg.norm(points[a] - points[b])) for a, b in pairs)
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "ambiguous", _ambiguous(points[always], size))

    @classmethod
    def learned(cls, frames: Sequence[FloatArray]) -> Constellation:
        """Learn a pattern, and the view, from points that move rigidly together.

        Parameters
        ----------
        frames : sequence of (P, 2) array [px]
            Points of consecutive frames, in any order.

        Returns
        -------
        constellation : Constellation
            Of size 1; its origin is the middle of the points that are always lit, forward is where it usually moves.

        Raises
        ------
        UndeterminedError
            If no three points move rigidly together.
        """
        rough = cls(learned_pattern(frames))
        matches = [match_pattern(uv, rough, 1.0) for uv in frames]
        points, always = _with_others(rough, frames, matches)
        points = _turned_forward(points, always, matches)
        points = (points - points[always].mean(axis=0)) / cls(points).size
        found = cls(points, always)
        return cls(points, always, view_of(found, frames))


def _triples(points: FloatArray, always: NDArray[np.bool_]) -> IntArray:
    """(T, 3). Not flat ones; those with the most points that are always lit first."""
    found = []
    for triple in combinations(range(len(points)), 3):
        a, b, c = points[list(triple)]
        area = abs(float(np.linalg.det(np.array([b - a, c - a]))))
        extent = max(float(np.linalg.norm(p - q)) for p, q in ((a, b), (b, c), (c, a)))
        if area > FLAT * extent**2:
            found.append(triple)
    found.sort(key=lambda t: -int(always[list(t)].sum()))
    return np.array(found, dtype=np.intp).reshape(-1, 3)


def _ambiguous(points: FloatArray, size: float) -> bool:
    """Whether a turn about the middle brings each point to where one is."""
    if len(points) < 3:
        return False
    z = (points - points.mean(axis=0)) @ (1, 1j)
    far = int(np.argmax(np.abs(z)))
    for k in range(len(z)):
        turn = np.angle(z[k] / z[far]) if abs(z[k]) > 0 else 0.0
        off = np.abs(z[:, None] * np.exp(1j * turn) - z[None]).min(axis=1).max()
        if k != far and off < NEAR * size / 2:
            return True
    return False


def view_of(pattern: Constellation, frames: Sequence[FloatArray]) -> View | None:
    """Learn how the camera stretches a pattern, from frames in which all of what is always lit is seen.

    Parameters
    ----------
    pattern : Constellation
        The pattern.
    frames : sequence of (P, 2) array [px]
        Points of frames.

    Returns
    -------
    view : View or None
        None where there are too few matches.
    """
    every = frames[:: 1 + len(frames) // 600]
    bare = Constellation(pattern.points, pattern.always)
    matches = [match_pattern(uv, bare, 1.0) for uv in every]
    full = [(m.which[:, pattern.always] >= 0).all(axis=1) for m in matches]
    A = np.concatenate([m.A[f] for m, f in zip(matches, full, strict=True)])
    b = np.concatenate([m.b[f] for m, f in zip(matches, full, strict=True)])
    return fit_view(A, b) if len(A) >= SMALLEST_VIEW else None


def _with_others(
    rough: Constellation, frames: Sequence[FloatArray], matches: list[Match]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The pattern and what else is often seen with it, and what is always lit."""
    own, total = [], 0
    for uv, match in zip(frames, matches, strict=True):
        used = np.unique(match.which[match.which >= 0])
        rest = np.delete(uv, used, axis=0)
        for A, b in zip(match.A, match.b, strict=True):
            total += 1
            own.append((rest - b) @ np.linalg.inv(A).T)
    points = [*rough.points]
    always = [True] * len(points)
    size = rough.size
    spare = np.concatenate(own) if own else np.empty((0, 2))
    spare = spare[np.linalg.norm(spare - rough.points.mean(axis=0), axis=1) < 1.2 * size]
    while len(spare) and len(points) < 8:
        some = spare[:: 1 + len(spare) // 500]
        near = np.linalg.norm(some[:, None] - spare[None], axis=2) < NEAR * size / 2
        share = near.sum(axis=1) / max(total, 1)
        best = int(np.argmax(share))
        if share[best] < OFTEN:
            break
        place = spare[near[best]].mean(axis=0)
        if min(np.linalg.norm(place - p) for p in points) > NEAR * size / 2:
            points.append(place)
            always.append(bool(share[best] > NEARLY_ALWAYS))
        spare = spare[np.linalg.norm(spare - place, axis=1) > NEAR * size]
    return np.array(points), np.array(always)


def _turned_forward(
    points: FloatArray,
    always: NDArray[np.bool_],
    matches: list[Match],
) -> FloatArray:
    """The pattern with its usual direction of motion forward."""
    middle = points[always].mean(axis=0)
    steps = []
    for before, after in pairwise(matches):
        if not len(before.b) or not len(after.b):
            continue
        where = [m.b + m.A @ middle for m in (before, after)]
        for A, place in zip(before.A, where[0], strict=True):
            off = where[1] - place
            j = int(np.argmin(np.linalg.norm(off, axis=1)))
            step = np.linalg.inv(A) @ off[j]
            if np.linalg.norm(step) < np.ptp(points, axis=0).max() / 2:
                steps.append(step)
    if not steps:
        return points
    z = np.array(steps) @ (1, 1j)
    axis = np.sqrt(
        np.sum(z**2 / np.maximum(np.abs(z), 1e-12))
    )  # lines have no sense; long steps count more
    if np.sum((z * np.conj(axis)).real) < 0:
        axis = -axis
    turn = np.conj(axis / max(abs(axis), 1e-12))
    turned = ((points - middle) @ (1, 1j)) * turn
    return np.column_stack([turned.real, turned.imag])
