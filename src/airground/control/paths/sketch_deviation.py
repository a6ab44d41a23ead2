"""How a path and the drawing that it came from differ, and a closed drawing's ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.control.paths.sketch_clean import Polyline, even
from airground.control.paths.sketch_undrivable import Undrivable

if TYPE_CHECKING:
    from airground.control.paths.image_path import ImagePath
    from airground.geometry.arrays import FloatArray

__all__ = ["deviation", "distances", "leaves", "without_overlap"]


_BLOCK = 256
"""Points at a time, which stay in the cache with a line of a thousand vertices."""

_LOOKS = 400
"""Places of a path, about, that are compared with the drawing: a few pixels apart."""


def distances(points_uv: FloatArray, line_uv: FloatArray) -> FloatArray:
    """Distances of points from a line.

    Parameters
    ----------
    points_uv : (N, 2) array [px]
        The points.
    line_uv : (M, 2) array [px]
        Vertices of the line, dense: only the two segments at the nearest vertex count.

    Returns
    -------
    distance : (N,) array [px]
        From the line.
    """
    middle = line_uv.mean(axis=0)
    at = line_uv - middle
    square = (at * at).sum(axis=1)
    nearest = np.concatenate(
        [
            np.argmin(square - 2 * ((some - middle) @ at.T), axis=1)
            for some in np.array_split(points_uv, len(points_uv) // _BLOCK + 1)
        ]
    )
    best = np.full(len(points_uv), np.inf)
    for side in (-1, 0):
        i = np.clip(nearest + side, 0, len(line_uv) - 2)
        a, d = line_uv[i], line_uv[i + 1] - line_uv[i]
        square = np.maximum((d * d).sum(axis=1), 1e-300)
        f = np.clip(((points_uv - a) * d).sum(axis=1) / square, 0.0, 1.0)
        off = points_uv - a - f[:, None] * d
        best = np.minimum(best, np.hypot(off[:, 0], off[:, 1]))
    return best


def deviation(
    path_uv: FloatArray, drawn_uv: FloatArray, line_uv: FloatArray
) -> tuple[float, float]:
    """Deviation of a path from a drawing.

    Parameters
    ----------
    path_uv : (M, 2) array [px]
        The path.
    drawn_uv : (N, 2) array [px]
        Points as they were drawn.
    line_uv : (K, 2) array [px]
        The line through them, dense, to find what of the path is away from all of it.

    Returns
    -------
    most, rms : float [px]
        Largest distance either way, and root mean square of the drawn points' distances from the path.
    """
    there, back = (
        distances(drawn_uv, path_uv),
        distances(path_uv[:: len(path_uv) // _LOOKS + 1], line_uv),
    )
    return max(float(there.max()), float(back.max())), float(np.sqrt(np.mean(there**2)))


def leaves(
    path: ImagePath, line_uv: FloatArray, far_px: float, radius_m: float
) -> list[Undrivable]:
    """Where the path had to leave the drawing, as the robot cannot turn so tightly.

    Parameters
    ----------
    path : ImagePath
        The path.
    line_uv : (K, 2) array [px]
        The drawing, dense.
    far_px : float [px]
        Distances above it are told.
    radius_m : float [m]
        The robot's smallest radius, for the message.

    Returns
    -------
    undrivable : list of Undrivable
        One for each stretch of the path.
    """
    away = distances(path.uv, line_uv)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], away > far_px, [0]])))
    found = []
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        worst = first + int(np.argmax(away[first:end]))
        u, v = path.uv[worst]
        reason = (
            f"near pixel ({u:.0f}, {v:.0f}) the path is {away[worst]:.0f} px from the drawing: "
            f"the robot cannot turn within {radius_m:g} m"
        )
        span = (float(path.s[first]), float(path.s[end - 1]))
        found.append(Undrivable("departs", reason, first, end - 1, span, path.uv[worst]))
    return found


def without_overlap(
    line: Polyline, step_px: float, smoothing_px: float, closed: bool | None
) -> tuple[bool, Polyline]:
    """Tell whether a line goes round, and if so end it where it meets its start.

    Parameters
    ----------
    line : Polyline
        At even steps.
    step_px : float [px]
        About those steps.
    smoothing_px : float [px]
        Width of the hand's noise; ends nearer than four times that, or 3 % of the length, meet.
    closed : bool, optional
        What the caller says; the answer where given.

    Returns
    -------
    closed : bool
        Whether it goes round.
    line : Polyline
        Then with the first point again at the end.
    """
    count = len(line.uv)
    step_px = float(np.hypot(*(line.uv[1] - line.uv[0])))
    length = step_px * (count - 1)
    enough = max(4 * smoothing_px, 0.03 * length)
    if closed is None and length < 6 * enough:
        closed = False
    if closed is False or count < 12:
        return False, line
    ends = max(1, min(count // 7, round(12 * smoothing_px / step_px)))
    head, tail = line.uv[:ends], line.uv[count - ends :]
    gap = np.hypot(*(head[:, None] - tail[None]).transpose(2, 0, 1))
    lost = np.arange(ends)[:, None] + np.arange(ends)[None, ::-1]
    i, j = np.unravel_index(int(np.argmin(gap + 0.1 * step_px * lost)), gap.shape)
    if closed is None and gap[i, j] > enough:
        return False, line
    first, last = int(i), count - ends + int(j)
    uv, wish = line.uv[first : last + 1], line.wish[first : last + 1]
    if np.hypot(*(uv[-1] - uv[0])) > 0:
        uv, wish = np.concatenate([uv, uv[:1]]), np.append(wish, wish[0])
    return True, even(Polyline(uv, wish), step_px)
