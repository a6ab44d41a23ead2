"""A track seen from its end: positions and velocities given all sightings, before and after.

The fixed-interval smoother of Rauch, Tung and Striebel (AIAA Journal 1965) over the model of `beliefs`, with the root
mean square acceleration that makes the track's sightings likeliest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import readonly
from airground.vision.tracker.beliefs import log_normal_2, transition
from airground.vision.tracker.options import TrackerOptions

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.geometry.arrays import FloatArray

__all__ = ["Smoothed", "smooth"]

LEVELS = np.geomspace(3.0, 3000.0, 13)  # accelerations to choose from [px/s2]


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """A track after the fact. Its errors are alike from row to row, so it is no set of independent sightings."""

    t: FloatArray
    """(N,) [s]. Times of the sightings."""

    uv: FloatArray
    """(N, 2) [px]. Positions."""

    uv_dot: FloatArray
    """(N, 2) [px/s]. Velocities."""

    covariance: FloatArray
    """(N, 4, 4). Of position and velocity."""

    acceleration_pxps2: float
    """Root mean square acceleration that fits best [px/s2]."""


def smooth(
    t: ArrayLike,
    uv: ArrayLike,
    covariance: ArrayLike,
    options: TrackerOptions | None = None,
) -> Smoothed:
    """Smooth a track's sightings.

    Parameters
    ----------
    t : (N,) array_like [s]
        Times, strictly ascending.
    uv : (N, 2) array_like [px]
        Sightings.
    covariance : (N, 2, 2) array_like [px2]
        Their covariances.
    options : TrackerOptions, optional
        Of the tracker: how long accelerations last, and the usual speed.

    Returns
    -------
    smoothed : Smoothed
        At the same times.

    Raises
    ------
    InputError
        If there are no sightings, shapes differ, an entry is not finite, or times do not ascend.
    """
    options = options or TrackerOptions()
    times = readonly(t, (None,), "t")
    count = len(times)
    if count == 0 or (np.diff(times) <= 0).any():
        raise InputError("t must hold one time or more, strictly ascending")
    seen = readonly(uv, (count, 2), "uv")
    noise = readonly(covariance, (count, 2, 2), "covariance")

    levels = len(LEVELS)
    x = np.zeros((levels, 6))
    x[:, :2] = seen[0]
    spread = np.zeros((levels, 6, 6))
    spread[:, :2, :2] = noise[0]
    spread[:, [2, 3], [2, 3]] = options.speed_pxps**2
    spread[:, [4, 5], [4, 5]] = LEVELS[:, None] ** 2
    after, before = [(x, spread)], [(x, spread)]
    steps = [np.eye(6)]
    log = np.zeros(levels)
    for k in range(1, count):
        step, jolt = transition(float(times[k] - times[k - 1]), options.manoeuvre_s)
        x = x @ step.T
        spread = step @ spread @ step.T + LEVELS[:, None, None] ** 2 * jolt
        before.append((x, spread))
        steps.append(step)
        off = seen[k] - x[:, :2]
        total = spread[:, :2, :2] + noise[k]
        log += log_normal_2(off, total)
        gain = spread[:, :, :2] @ np.linalg.inv(total)
        x = x + (gain @ off[..., None])[..., 0]
        left = spread - gain @ spread[:, :2, :]
        turned = gain.swapaxes(1, 2)
        spread = left - left[:, :, :2] @ turned + gain @ noise[k] @ turned
        spread = 0.5 * (spread + spread.swapaxes(1, 2))
        after.append((x, spread))

    best = int(np.argmax(log))
    mean, cover = after[-1][0][best], after[-1][1][best]
    means, covers = [mean], [cover]
    for k in range(count - 2, -1, -1):
        filtered, wide = after[k][0][best], after[k][1][best]
        ahead, wider = before[k + 1][0][best], before[k + 1][1][best]
        back = np.linalg.solve(wider, steps[k + 1] @ wide).T
        mean = filtered + back @ (mean - ahead)
        cover = wide + back @ (cover - wider) @ back.T
        cover = 0.5 * (cover + cover.T)
        means.append(mean)
        covers.append(cover)
    state, matrix = np.array(means[::-1]), np.array(covers[::-1])
    return Smoothed(times, state[:, :2], state[:, 2:4], matrix[:, :4, :4], float(LEVELS[best]))
