"""The nearest point of a path: from anywhere, or along the path from where one was."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["nearest_sample", "settle"]


def nearest_sample(xy: FloatArray, x: float, y: float, slack_m: float) -> int:
    """Sample nearest to a point; of stretches nearly as near as the nearest, that of the earliest.

    Parameters
    ----------
    xy : (M, 2) array [m]
        Samples of a path.
    x, y : float [m]
        The point.
    slack_m : float [m]
        How much farther than the nearest of all a stretch may be.

    Returns
    -------
    index : int
        Nearest sample of that stretch.
    """
    distance = np.hypot(xy[:, 0] - x, xy[:, 1] - y)
    near = distance <= distance.min() + slack_m
    first = int(np.argmax(near))
    beyond = np.flatnonzero(~near[first:])
    last = first + int(beyond[0]) if len(beyond) else len(near)
    return first + int(np.argmin(distance[first:last]))


def settle(
    rows: tuple[list[float], ...],
    point: tuple[float, float],
    start: float,
    i: int,
    *,
    run: tuple[int, int],
    within_m: float,
    closed: bool,
) -> float:
    """Arc length of the nearest point downhill from `start` (its own foot of the perpendicular).

    Walks over intervals as long as the foot lies beyond one, which for a path of small steps is where the distance
    stops to fall, then solves ``(p - c) . t = 0`` in the last, where it is nearly linear.

    Parameters
    ----------
    rows : tuple of lists
        s, x, y, theta, curvature, speed, cos and sin of theta, by sample.
    point : (float, float) [m]
        The point.
    start : float [m]
        Where the search starts.
    i : int
        Sample before it.
    run : (int, int)
        First and last sample that may be reached.
    within_m : float [m]
        How far from the start the answer may be.
    closed : bool
        Whether it may go on past the ends, once.

    Returns
    -------
    s : float [m]
        Arc length; on a closed path it may be below 0 or beyond the length.
    """
    x, y = point
    s_, x_, y_, cos_, sin_ = rows[0], rows[1], rows[2], rows[6], rows[7]
    low, high = run
    i = min(max(i, low), high - 1)
    length, lap = s_[-1], 0.0
    left, right = start - within_m, start + within_m
    came = 0
    for _ in range(2 * len(s_)):
        # Signed distances that the point is ahead of either end of the interval, along the tangents.
        ahead0 = (x - x_[i]) * cos_[i] + (y - y_[i]) * sin_[i]
        ahead1 = (x - x_[i + 1]) * cos_[i + 1] + (y - y_[i + 1]) * sin_[i + 1]
        if ahead1 > 0 and came >= 0 and s_[i + 1] + lap < right:
            came = 1
            if i + 1 < high:
                i += 1
                continue
            if closed:
                i, lap = low, lap + length
                continue
            return min(s_[high], right)
        if ahead0 < 0 and came <= 0 and s_[i] + lap > left:
            came = -1
            if i > low:
                i -= 1
                continue
            if closed:
                i, lap = high - 1, lap - length
                continue
            return max(s_[low], left)
        break
    h = s_[i + 1] - s_[i]
    slope = ahead0 - ahead1
    f = min(max(ahead0 / slope, 0.0), 1.0) if slope > 0 else (0.0 if ahead0 <= 0 else 1.0)
    return min(max(s_[i] + f * h + lap, left), right)
