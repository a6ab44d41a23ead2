"""Where a pattern of points is, in one frame of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.vision.detectors.constellation_pattern import Constellation

__all__ = ["NEAR", "Match", "match_pattern", "places", "placing"]

IntArray = NDArray[np.intp]

STRETCH = 2.5
"""Of the longer over the shorter direction that a camera may cause, where the view is unknown: a tilt of 66 degrees."""

STRETCH_USUAL = 0.35
"""Scatter of its logarithm."""

NEAR = 0.12
"""Distance from where a point is expected, over the pattern's size in the image, up to which it is that point."""

NEIGHBOURS = 3
"""So many times the number of the pattern's points are looked at around each point."""

FLAT = 0.03
"""Area of three points, over the square of their extent, below which they do not place a pattern."""

MISSING = 4.0
"""What a missing point costs, in halves of squared deviations; one that is there gains as much."""

WORST = 8.0
"""Of a match, beyond which it is none."""


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """N patterns in one frame of points."""

    A: FloatArray
    """(N, 2, 2). From the pattern to the image."""

    b: FloatArray
    """(N, 2) [px]. Where the pattern's origin is."""

    which: IntArray
    """(N, K). The frame's point for each of the pattern's; -1 where it is missing."""

    cost: FloatArray
    """(N,)."""


def match_pattern(uv: FloatArray, pattern: Constellation, sigma: float) -> Match:
    """Find patterns that do not share points, the best first.

    Parameters
    ----------
    uv : (P, 2) array [px]
        Points of a frame.
    pattern : Constellation
        What to look for.
    sigma : float [px]
        Noise of a point.

    Returns
    -------
    match : Match
        Of N patterns, perhaps none.
    """
    P, K = len(uv), len(pattern.points)
    none = Match(
        np.empty((0, 2, 2)), np.empty((0, 2)), np.empty((0, K), dtype=np.intp), np.empty(0)
    )
    if P < 3:
        return none
    three = _neighbours(uv, NEIGHBOURS * K)
    triples = pattern.triples
    p = pattern.points[triples]  # (T, 3, 2)
    base = np.linalg.inv((p[:, 1:] - p[:, :1]).swapaxes(1, 2))
    q = uv[three]  # (M, 3, 2)
    A = (q[:, 1:] - q[:, :1]).swapaxes(1, 2) @ base[:, None]  # (T, M, 2, 2)
    b = q[:, 0] - np.einsum("tmij,tj->tmi", A, p[:, 0])
    A, b = A.reshape(-1, 2, 2), b.reshape(-1, 2)
    costs = _stretch_cost(A, b, pattern, sigma)
    good = np.flatnonzero(costs < WORST)
    if len(good) == 0:
        return none
    A, b, costs = A[good], b[good], costs[good]
    used, which = three[good % len(three)], triples[good // len(three)]
    rows = np.arange(len(good))
    expected = b[:, None] + pattern.points @ A.swapaxes(1, 2)  # (G, K, 2)
    d = np.linalg.norm(uv[None, None] - expected[:, :, None], axis=3)
    d[rows[:, None, None], np.arange(K)[:, None], used[:, None]] = np.inf
    index = np.argmin(d, axis=2)
    off = np.take_along_axis(d, index[..., None], axis=2)[..., 0]
    size = (pattern.size * np.sqrt(np.abs(np.linalg.det(A))))[:, None]
    there = off < NEAR * size + 3 * sigma
    near = np.where(there, off, 0.0) / (NEAR * size / 2 + sigma)
    each = np.where(there, 0.5 * near**2 - MISSING, np.where(pattern.always, MISSING, 0.0))
    np.put_along_axis(each, which, 0.0, axis=1)
    index = np.where(there, index, -1)
    np.put_along_axis(index, which, used, axis=1)
    costs = costs + each.sum(axis=1)
    order = np.argsort(costs, kind="stable")
    taken = np.zeros(P, dtype=bool)
    kept = []
    for m in order:
        if costs[m] > WORST:
            break
        mine = index[m][index[m] >= 0]
        if not taken[mine].any():
            taken[mine] = True
            kept.append(int(m))
    affine, origin = A[kept], b[kept]
    for j, m in enumerate(kept):
        rows = placing(index[m], pattern)
        if len(rows) >= 3:
            X = np.column_stack([np.ones(len(rows)), pattern.points[rows]])
            found = np.linalg.lstsq(X, uv[index[m][rows]], rcond=None)[0]
            origin[j], affine[j] = found[0], found[1:].T
    return Match(affine, origin, index[kept], costs[kept])


def placing(which: IntArray, pattern: Constellation) -> IntArray:
    """Choose the points that place the pattern: if they do, those that are always lit, so that blinking moves nothing.

    Parameters
    ----------
    which : (K,) array of int
        The frame's point for each of the pattern's; -1 where it is missing.
    pattern : Constellation
        The pattern.

    Returns
    -------
    rows : (R,) array of int
        Of the pattern's points.
    """
    lit = np.flatnonzero((which >= 0) & pattern.always)
    every = np.flatnonzero(which >= 0)
    return lit if len(lit) >= 3 and places(pattern.points[lit]) else every


def _neighbours(uv: FloatArray, count: int) -> IntArray:
    """(M, 3). Ordered triples of points that are near the first of them."""
    P = len(uv)
    d = np.linalg.norm(uv[:, None] - uv[None], axis=2)
    near = np.argsort(d, axis=1, kind="stable")[:, 1 : 1 + min(count, P - 1)]
    n = near.shape[1]
    j, k = np.nonzero(~np.eye(n, dtype=bool))
    i = np.repeat(np.arange(P), len(j))
    return np.column_stack([i, near[:, j].ravel(), near[:, k].ravel()])


def _stretch_cost(A: FloatArray, b: FloatArray, pattern: Constellation, sigma: float) -> FloatArray:
    """(M,). How unlikely it is that the camera stretches the pattern so, in halves of squared deviations."""
    det = np.linalg.det(A)
    with np.errstate(divide="ignore", invalid="ignore"):
        # Of A A^T: trace over twice the root of its determinant is the hyperbolic cosine of the logarithm.
        half = np.sum(A**2, axis=(1, 2)) / (2 * np.abs(det))
        ratio = np.arccosh(np.maximum(half, 1.0))
        good = (det < 0) & np.isfinite(ratio)
        if pattern.view is not None:
            cost = pattern.view.cost(A, b, sigma / pattern.size)
        else:
            cost = 0.5 * (ratio / STRETCH_USUAL) ** 2
            good &= ratio < np.log(STRETCH)
    return np.where(good & np.isfinite(cost), cost, np.inf)


def places(points: FloatArray) -> bool:
    """Tell whether points are spread in both directions.

    Parameters
    ----------
    points : (R, 2) array
        Points.

    Returns
    -------
    places : bool
        False where they lie on one line.
    """
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] > FLAT * spread[0])
