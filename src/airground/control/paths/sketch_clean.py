"""From a drawing as the hand gave it to an even polyline: what is not ground, pauses and jitter removed."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, nan
from typing import TYPE_CHECKING

import numpy as np

from airground.control.paths.sketch_undrivable import Undrivable
from airground.errors import InputError
from airground.geometry.arrays import LARGEST, FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.control.floor import Floor

    BoolArray = NDArray[np.bool_]

__all__ = ["Polyline", "clean", "cusps", "even", "ground_per_pixel"]


@dataclass(frozen=True, slots=True, eq=False)
class Polyline:
    """Points that follow a drawing."""

    uv: FloatArray
    """(N, 2) [px]. No two in a row are the same."""

    wish: FloatArray
    """(N,) [m/s]. Speeds asked for there; infinite where none is."""


def ground_per_pixel(floor: Floor, uv: FloatArray) -> FloatArray:
    """How much ground one pixel spans, in the direction in which it spans most.

    Parameters
    ----------
    floor : Floor
        The ground.
    uv : (N, 2) array [px]
        Image points.

    Returns
    -------
    scale : (N,) array [m/px]
        Infinite on the horizon; NaN where `uv` is.
    """
    J = floor.model.jacobian(uv)
    square = (J * J).sum(axis=(-2, -1))
    det = np.abs(J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0])
    # Smaller singular value: s1 s2 = det and s1^2 + s2^2 = square.
    larger = np.sqrt((square + np.sqrt(np.maximum(square**2 - 4 * det**2, 0.0))) / 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(larger / det)


def clean(
    floor: Floor, uv: FloatArray, wish: FloatArray, radius_px: float, coarsest_m: float
) -> tuple[Polyline, tuple[Undrivable, ...]]:
    """Drop what is no ground and gather points that lie together.

    Parameters
    ----------
    floor : Floor
        The ground.
    uv : (N, 2) array [px]
        The drawing; it may hold NaN.
    wish : (N,) array [m/s]
        Speeds asked for; infinite where none is.
    radius_px : float [px]
        Points within it of their mean become that mean; the ends stay where they are.
    coarsest_m : float [m]
        Ground that one pixel may span.

    Returns
    -------
    polyline : Polyline
        Two points or more.
    undrivable : tuple of Undrivable
        What was dropped.

    Raises
    ------
    InputError
        If fewer than two distinct points are left.
    """
    finite = np.asarray((np.isfinite(uv) & (np.abs(uv) < LARGEST / 1e6)).all(axis=1))
    safe = np.where(finite[:, None], uv, floor.origin_uv)
    ground = np.asarray(np.isfinite(floor.position(safe)).all(axis=1))
    near = np.asarray(ground_per_pixel(floor, safe) <= coarsest_m)
    notes = (
        *_dropped("not_finite", "not a number", ~finite, uv),
        *_dropped("horizon", "on or beyond the horizon, no ground", finite & ~ground, uv),
        *_dropped(
            "far",
            f"so far away that one pixel spans more than {coarsest_m:g} m",
            finite & ground & ~near,
            uv,
        ),
    )
    kept = finite & ground & near
    if not kept.any():
        why = notes[0].reason if notes else "the drawing is empty"
        raise InputError(f"nothing of the drawing is ground that can be driven on: {why}")
    return _gathered(uv[kept], wish[kept], radius_px), notes


def _dropped(kind: str, what: str, where: BoolArray, uv: FloatArray) -> list[Undrivable]:
    """One entry for each stretch of drawn points."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(np.int8)))
    found = []
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        points = (
            f"drawn point {first}" if end - first == 1 else f"drawn points {first} to {end - 1}"
        )
        are = "is" if end - first == 1 else "are"
        reason = f"{points} {are} {what}; the path leaves that out"
        found.append(Undrivable(kind, reason, first, end - 1, (nan, nan), uv[first], drawn=True))
    return found


def _gathered(uv: FloatArray, wish: FloatArray, radius_px: float) -> Polyline:
    """Means of points that lie together, in order.

    A brush on a string of one and a half radii is dragged after the hand: how far it came orders the points, and does
    not grow while the hand trembles. Points whose brush lies within one radius become their mean.
    """
    rows: list[tuple[float, float, float]] = []
    string = 1.5 * radius_px
    x, y = uv[0].tolist()
    came = begun = u_sum = v_sum = 0.0
    slowest, count = np.inf, 0
    for u, v, speed in zip(uv[:, 0].tolist(), uv[:, 1].tolist(), wish.tolist(), strict=True):
        pulled = hypot(u - x, v - y)
        if pulled > string:
            f = 1 - string / pulled
            x, y, came = x + f * (u - x), y + f * (v - y), came + f * pulled
            if came - begun > radius_px:
                rows.append((u_sum / count, v_sum / count, slowest))
                begun, u_sum, v_sum, slowest, count = came, 0.0, 0.0, np.inf, 0
        u_sum, v_sum, slowest, count = u_sum + u, v_sum + v, min(slowest, speed), count + 1
    rows.append((u_sum / count, v_sum / count, slowest))
    ends = (*uv[0].tolist(), rows[0][2]), (*uv[-1].tolist(), rows[-1][2])
    table = np.array([ends[0], *rows, ends[1]])
    for end, inner, sense in ((0, 1, 1), (-1, -2, -1)):  # those at the ends must not lead backwards
        if len(table) > 3:
            ahead = table[inner + sense, :2] - table[inner, :2]
            if (ahead * sense * (table[inner, :2] - table[end, :2]) * sense).sum() <= 0:
                table = np.delete(table, inner, axis=0)
    step = np.hypot(*np.diff(table[:, :2], axis=0).T)
    table = table[np.concatenate([[True], step > 1e-6 * max(1.0, radius_px)])]
    if len(table) < 2:
        raise InputError("the drawing has fewer than two distinct points; draw a line")
    return Polyline(table[:, :2], table[:, 2])


def even(line: Polyline, step_px: float, *, least: int = 8) -> Polyline:
    """The same line with points at even distances along it.

    Parameters
    ----------
    line : Polyline
        Two points or more.
    step_px : float [px]
        Distance between points, about.
    least : int
        How many points there shall be at least.

    Returns
    -------
    polyline : Polyline
        With the same ends; a speed between two points is the one between theirs, or the only one.
    """
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line.uv, axis=0).T))])
    count = max(least, round(along[-1] / step_px) + 1)
    places = np.linspace(0.0, along[-1], count)
    uv = np.column_stack([np.interp(places, along, line.uv[:, k]) for k in (0, 1)])
    after = np.clip(np.searchsorted(along, places), 1, len(along) - 1)
    f = (places - along[after - 1]) / (along[after] - along[after - 1])
    a, b = line.wish[after - 1], line.wish[after]
    both = np.isfinite(a) & np.isfinite(b)
    with np.errstate(invalid="ignore"):
        wish = np.where(both, a + f * (b - a), np.minimum(a, b))
    return Polyline(uv, wish)


def cusps(xy: FloatArray, uv: FloatArray, reach: int, angle: float, *, closed: bool) -> list[int]:
    """Points where the line doubles back: where the directions before and after differ by more than an angle.

    Parameters
    ----------
    xy : (M, 2) array [m]
        The line on the ground, at even steps in the image.
    uv : (M, 2) array [px]
        The same in the image, where it must double back too, by more than a right angle.
    reach : int
        How many steps before and after count, and twice as many.
    angle : float [rad]
        Change of direction that is a cusp.
    closed : bool
        Whether the last point is followed by the first.

    Returns
    -------
    indices : list of int
        Increasing; of each such stretch, the sharpest point.
    """
    count = len(xy)
    # A trembling hand blunts a tip: then it shows at twice the reach only.
    both = [_bends(points, reach, closed=closed) for points in (xy, uv)]
    wide = [_bends(points, 2 * reach, closed=closed) for points in (xy, uv)]
    limit = np.cos(angle)
    near = (both[0] < limit) & (both[1] < 0)
    sharp = near | ((wide[0] < limit) & (wide[1] < 0))
    depth = np.minimum(both[0], wide[0])
    found: list[int] = []
    last = -count
    for k in np.flatnonzero(sharp).tolist():
        if k - last == 1 and depth[k] < depth[found[-1]]:
            found[-1] = k
        elif k - last > 1:
            found.append(k)
        last = k
    return found


def _bends(points: FloatArray, reach: int, *, closed: bool) -> FloatArray:
    """Cosine of the change of direction at each point, between chords of some steps; 1 where they do not fit."""
    count = len(points)
    reach = max(1, min(reach, (count - 1) // 2))
    index = np.arange(count) if closed else np.arange(reach, count - reach)
    a = points[index] - points[(index - reach) % count]
    b = points[(index + reach) % count] - points[index]
    cos = np.ones(count)
    cos[index] = (a * b).sum(axis=1) / np.maximum(np.hypot(*a.T) * np.hypot(*b.T), 1e-300)
    return cos
