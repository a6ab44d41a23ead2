"""A line drawn by hand in the image becomes a smooth path on the ground.

The hand is noisy in pixels and the robot moves in metres, so the path is the smoothest line on the ground that stays in
a tube of some pixels around the drawing (`sketch_fit`). Where the drawing doubles back the robot stops: it turns on
the spot, or changes between forwards and reverse. Where it bends more tightly than the robot can, the tube is widened.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from airground.control.paths.sketch_clean import Polyline, clean, cusps, even
from airground.control.paths.sketch_deviation import deviation, leaves, without_overlap
from airground.control.paths.sketch_fit import in_tube
from airground.control.paths.sketch_path import Run, bends, path_of_runs, wishes
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from airground.control.floor import Floor
    from airground.control.limits import Limits
    from airground.control.paths.image_path import ImagePath

    BoolArray = NDArray[np.bool_]

__all__ = ["smooth_sketch"]

_CUSP = 2.3  # [rad], 132 degrees
_SHARPEST = 0.5
"""Change of direction from point to point [rad] beyond which a corner is not a curve but a turn on the spot."""
_ALIGNABLE = 0.5  # cosine: tangents at a cusp within 60 degrees of one line are made one
_MOST_POINTS = 1500
_LEAST = 8  # points of a run
_NOTHING = 1e-9  # [m]
_WIDENINGS = 10
_MARGIN = 0.98  # of the largest curvature: samples between points may be a little above


def smooth_sketch(
    floor: Floor,
    uv: ArrayLike,
    limits: Limits,
    *,
    closed: bool | None = None,
    smoothing_px: float = 3.0,
    speed_mps: ArrayLike | None = None,
    coarsest_m_per_px: float = 1.0,
) -> ImagePath:
    """Make a smooth path of a drawing.

    What of the drawing is no ground is left out and stands in `ImagePath.undrivable`; see `check_path` for all that
    keeps a path from being driven. The path ends exactly where the drawing does.

    Parameters
    ----------
    floor : Floor
        The ground.
    uv : (N, 2) array_like [px]
        The drawing: two points or more, uneven, jittering, crossing itself as it may.
    limits : Limits
        Of the robot.
    closed : bool, optional
        Whether it goes round; where not given it does if its ends nearly meet. It cannot where it doubles back.
    smoothing_px : float [px]
        Half width of the tube: how far the path may be from the drawing, apart from the hand's noise.
    speed_mps : () or (N,) array_like, optional [m/s]
        Upper bounds of the speed by wish, for all or for each point; NaN where there is none.
    coarsest_m_per_px : float [m/px]
        Points farther away, where one pixel spans more ground than this, are left out.

    Returns
    -------
    path : ImagePath
        With speeds within the limits and its deviation from the drawing.

    Raises
    ------
    InputError
        If fewer than two distinct points of the drawing are ground, or an argument is not what it must be.
    """
    uv = points(uv, "uv")
    if uv.ndim != 2:
        raise InputError(f"uv must have shape (N, 2), not {uv.shape}")
    for name, value in (("smoothing_px", smoothing_px), ("coarsest_m_per_px", coarsest_m_per_px)):
        if not 0 < value < inf:
            raise InputError(f"{name} must be positive and finite, not {value}")
    wish = wishes(speed_mps, len(uv))
    line, notes = clean(floor, uv, wish, smoothing_px, coarsest_m_per_px)
    length = float(np.hypot(*np.diff(line.uv, axis=0).T).sum())
    step = max(smoothing_px / 2, length / _MOST_POINTS)
    line = even(line, step)
    goes_round, ring = without_overlap(line, step, smoothing_px, closed)
    runs, goes_round = _runs(floor, ring, limits, smoothing_px, closed=goes_round)
    if goes_round or closed:
        line = ring
    elif ring is not line:  # out and back: no round, as it seemed
        runs, _ = _runs(floor, line, limits, smoothing_px, closed=False)
    path = path_of_runs(floor, runs, limits, closed=goes_round)
    drawn = uv[np.isfinite(floor.position(np.where(np.isfinite(uv), uv, np.nan))).all(axis=1)]
    if notes:
        drawn = line.uv
    most, rms = deviation(path.uv, drawn, line.uv)
    path = replace(path, max_deviation_px=most, rms_deviation_px=rms, undrivable=notes)
    if limits.turn_radius_m > 0:
        notes = (*notes, *leaves(path, line.uv, 4 * smoothing_px, limits.turn_radius_m))
        path = replace(path, undrivable=notes)
    return path


def _runs(
    floor: Floor, line: Polyline, limits: Limits, smoothing_px: float, *, closed: bool
) -> tuple[list[Run], bool]:
    """Smooth runs between cusps, and whether they are one that goes round."""
    xy = floor.position(line.uv)
    step = float(np.hypot(*(line.uv[1] - line.uv[0])))
    reach = max(2, round(3 * smoothing_px / step))
    places = cusps(
        xy[:-1] if closed else xy, line.uv[:-1] if closed else line.uv, reach, _CUSP, closed=closed
    )
    if closed and not places:
        run, sharp = _fitted(floor, line, limits, smoothing_px, closed=True)
        if not sharp:
            return [run], True
        places = sharp
    runs: list[Run] = []
    pieces: list[Polyline] = []
    todo = _split(line, places)
    while todo:
        piece = todo.pop(0)
        long = len(piece.uv) >= _LEAST
        if not long:
            piece = even(piece, step, least=_LEAST)
        run, sharp = _fitted(floor, piece, limits, smoothing_px)
        if sharp and long:
            todo = [*_split(piece, sharp), *todo]
            continue
        if sharp:  # a scribble of a few pixels: straight across
            f = np.linspace(0, 1, _LEAST)[:, None]
            ends = floor.position(piece.uv[[0, -1]])
            run = replace(run, xy=ends[0] + f * (ends[1] - ends[0]))
            if float(np.hypot(*(ends[1] - ends[0]))) < _NOTHING:
                continue
        pieces.append(piece)
        runs.append(run)
    if not runs:
        raise InputError("the drawing has fewer than two distinct points; draw a line")
    if limits.turn_radius_m > 0 and limits.reverse_mps > 0:
        runs = _reversing(floor, pieces, runs, limits, smoothing_px)
    return runs, False


def _split(line: Polyline, places: list[int]) -> list[Polyline]:
    """The line in pieces that share the points where they meet."""
    edges = [0, *(k for k in places if 0 < k < len(line.uv) - 1), len(line.uv) - 1]
    return [Polyline(line.uv[a : b + 1], line.wish[a : b + 1]) for a, b in pairwise(edges)]


def _reversing(
    floor: Floor, pieces: list[Polyline], runs: list[Run], limits: Limits, smoothing_px: float
) -> list[Run]:
    """Runs that a car drives forwards and in reverse by turns: where two meet, their tangents are one line."""
    leads: list[list[FloatArray | None]] = [[None, None] for _ in runs]
    for k in range(len(runs) - 1):
        before, after = runs[k].xy[-1] - runs[k].xy[-2], runs[k + 1].xy[0] - runs[k + 1].xy[1]
        before, after = before / np.hypot(*before), after / np.hypot(*after)
        if float(before @ after) > _ALIGNABLE:
            middle = (before + after) / np.hypot(*(before + after))
            leads[k][1], leads[k + 1][0] = middle, -middle
    found = []
    way = 1
    for piece, run, lead in zip(pieces, runs, leads, strict=True):
        if lead[0] is not None:
            way = -way
        if lead[0] is not None or lead[1] is not None:
            again, sharp = _fitted(floor, piece, limits, smoothing_px, leads=(lead[0], lead[1]))
            run = run if sharp else again  # noqa: PLW2901
        found.append(replace(run, direction=way))
    return found


def _fitted(
    floor: Floor,
    line: Polyline,
    limits: Limits,
    smoothing_px: float,
    *,
    closed: bool = False,
    leads: tuple[FloatArray | None, FloatArray | None] = (None, None),
) -> tuple[Run, list[int]]:
    """One smooth run, and the points of it that are no curve; `leads` are directions at its ends."""
    uv = line.uv[:-1] if closed else line.uv
    q, J = floor.position(uv), floor.model.jacobian(uv)
    step = float(np.hypot(*(line.uv[1] - line.uv[0])))
    count = len(q)
    tolerance, weight = np.full(count, smoothing_px), np.ones(count)
    window = 2 * round(smoothing_px / step / 2) + 1
    held = {} if closed else {0: q[0], count - 1: q[-1]}
    for lead, ends in zip(leads, ((0, 1, 2), (-1, -2, -3)), strict=True):
        if lead is not None:
            pace = float(np.hypot(*(q[ends[1]] - q[ends[0]])))
            sense = 1 if ends[0] == 0 else -1
            held |= {ends[j] % count: q[ends[0]] + sense * j * pace * lead for j in (1, 2)}
    radius = limits.turn_radius_m
    length = min(4 * smoothing_px / step, count / 2)

    def fit() -> tuple[FloatArray, FloatArray, FloatArray]:
        p = in_tube(q, J, tolerance, weight, length, closed=closed, held=held, window=window)
        if closed:
            p = np.concatenate([p, p[:1]])
        pace, turn, kappa = bends(p, closed=closed)
        tight = np.abs(kappa) * (radius / _MARGIN)
        tight[:-1] = np.maximum(tight[:-1], turn * radius / (2 * pace[:-1]))
        return p, turn, tight

    p, turn, tight = fit()
    for k in range(_WIDENINGS):
        if not (tight > 1).any():
            break
        near = _around(p, tight > 1, (2 + 0.5 * k) * radius, closed=closed)[:count]
        for first, end in _stretches(near):
            tolerance[first:end] = inf
            # Curvature falls with the length that is smoothed, and that is as the sixth root of the weight.
            weight[first:end] /= min(max(float(tight[first:end].max()) ** 4, 12.0), 1e4)
        p, turn, tight = fit()
    if (tight > 1).any():  # in vain there: rather as drawn, for `check_path` to tell
        for first, end in _stretches(weight < 1):
            if (tight[first:end] > 1).any():
                tolerance[first:end], weight[first:end] = smoothing_px, 1.0
        p, turn, tight = fit()
    if not closed:
        p[[0, -1]] = q[[0, -1]]  # the fit holds them to micrometres
    return Run(p, line.wish), _corners(turn)


def _corners(turn: FloatArray) -> list[int]:
    """Sharp points inside a run, a few steps apart."""
    found: list[int] = []
    for k in np.flatnonzero(turn > _SHARPEST).tolist():
        place = k if k > len(turn) // 2 else k + 1
        if found and place - found[-1] < 3:
            if turn[k] > turn[found[-1] - 1]:
                found[-1] = place
        else:
            found.append(place)
    return [k for k in found if 0 < k < len(turn)]


def _around(xy: FloatArray, at: BoolArray, reach_m: float, *, closed: bool) -> BoolArray:
    """Points within a distance, along the line, of marked ones."""
    step = np.hypot(*np.diff(xy, axis=0).T)
    s = np.concatenate([[0.0], np.cumsum(step)])
    marked = s[at]
    if closed:
        marked = np.concatenate([marked - s[-1], marked, marked + s[-1]])
    after = np.clip(np.searchsorted(marked, s), 1, max(len(marked) - 1, 1))
    last = np.minimum(after, len(marked) - 1)
    gap = np.minimum(np.abs(marked[after - 1] - s), np.abs(marked[last] - s))
    return np.asarray(gap <= reach_m)


def _stretches(where: BoolArray) -> list[tuple[int, int]]:
    """First point of each stretch, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
