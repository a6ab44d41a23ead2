"""Image position and velocity at each sighting, by parabolas; beside a start, a stop or a bump, by those that fit.

A parabola over a window that holds a kink of the motion is wrong there by more than noise explains, and its residuals
show it; so do windows that end or begin with the sighting. Such a sighting is given the window, among shorter ones and
ones that lie more to one side, whose velocity has the smallest deviation, with what its residuals beyond noise say of a
kink in it: so no window reaches over a kink that can be avoided, and where none can, as amid the braking itself, the
deviation says so.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import gammaincinv  # type: ignore[import-untyped,unused-ignore]

from airground.calibration.local_polynomial import MIN_PARABOLA, windows

if TYPE_CHECKING:
    from airground.calibration.identify_windows import BoolArray
    from airground.calibration.local_polynomial import Windows
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["ImageMotion", "image_motion"]

CHANCE = 0.001  # of white noise to be taken for a kink
SIDE_SIGMAS = 3.7  # the same, for the largest of four differences that hang together
# A parabola whose window of length L holds a kink of the velocity by J scatters by up to 0.018 J L about the points,
# and its velocity is wrong by up to J/2, 28 times that over L, but mostly by far less: this holds 95 % of errors.
KINK = 4.0


class ImageMotion(NamedTuple):
    """What was found at each sighting; NaN where it has no neighbour."""

    uv: FloatArray
    """(N, 2) [px]. Where the target was, smoothed."""

    uv_dot: FloatArray
    """(N, 2) [px/s]. Its velocity."""

    sigma: FloatArray
    """(N,) [px/s]. Standard deviation of a coordinate of that."""


def image_motion(
    t: FloatArray, uv: FloatArray, *, wanted: int, limit: float, sigma: FloatArray
) -> ImageMotion:
    """Find image velocities of one target.

    Parameters
    ----------
    t : (N,) array [s]
        Times of its sightings, ascending.
    uv : (N, 2) array [px]
        The sightings.
    wanted : int
        Rows in a window, where there are so many.
    limit : float [s]
        Time between two sightings that a window does not reach over.
    sigma : (N,) array [px]
        Noise of a coordinate.

    Returns
    -------
    motion : ImageMotion
        At the sightings.
    """
    broken = np.concatenate([[True], np.diff(t) > limit])
    run = np.cumsum(broken) - 1
    first_of_run = np.flatnonzero(broken)
    track = _Track(t, uv, sigma, first_of_run[run], np.append(first_of_run, len(t))[run + 1])
    found = ImageMotion(np.full_like(uv, np.nan), np.full_like(uv, np.nan), np.full(len(t), np.nan))
    rows = np.arange(len(t))
    count = np.minimum(wanted, track.end - track.start)
    kinked = np.zeros(len(t), dtype=bool)
    for size in np.unique(count[count >= 2]).tolist():
        mine = rows[count == size]
        w = windows(t, np.clip(mine - size // 2, track.start[mine], track.end[mine] - size), size)
        found.uv[mine], found.uv_dot[mine] = w.fit(t, uv, at=t[mine])
        found.sigma[mine] = w.velocity_gain(t[mine]) * sigma[mine]
        if size >= MIN_PARABOLA:
            kinked[mine] = w.scatter(t, uv) > _usual(size) * sigma[mine]
            kinked[mine] |= _one_sided(found, track, mine, size)
            found.sigma[mine[kinked[mine]]] = _deviation(track, w, mine)[kinked[mine]]
    for size in _sizes(wanted):
        for before in sorted({0, size // 4, size // 2, size - 1 - size // 4, size - 1}):
            _improve(found, track, *track.windows(rows[kinked], size, before))
    return found


class _Track(NamedTuple):
    """Sightings of one target, and the runs of them that no gap breaks."""

    t: FloatArray
    uv: FloatArray
    sigma: FloatArray
    start: IntArray  # (N,) of a sighting's run
    end: IntArray  # (N,) one past its last

    def windows(self, rows: IntArray, size: int, before: int) -> tuple[IntArray, Windows]:
        """Of those rows that have so many before and so many in all, and their windows."""
        first = rows - before
        inside = (first >= self.start[rows]) & (first + size <= self.end[rows])
        return rows[inside], windows(self.t, first[inside], size)


def _one_sided(found: ImageMotion, track: _Track, rows: IntArray, size: int) -> BoolArray:
    """Whether windows that end or begin with a sighting contradict what was found at it."""
    differs = np.zeros(len(track.t), dtype=bool)
    for before in (0, size - 1):
        mine, w = track.windows(rows, size, before)
        velocity = w.fit(track.t, track.uv, at=track.t[mine])[1]
        off = np.abs(velocity - found.uv_dot[mine]).max(axis=1, initial=0.0)
        noise = w.velocity_gain(track.t[mine]) * track.sigma[mine]
        fits = w.scatter(track.t, track.uv) <= _usual(size) * track.sigma[mine]
        differs[mine] |= fits & (off > SIDE_SIGMAS * noise)
    return differs[rows]


def _improve(found: ImageMotion, track: _Track, rows: IntArray, w: Windows) -> None:
    """Take over what these windows say of their rows, where it is surer."""
    deviation = _deviation(track, w, rows)
    better = deviation < found.sigma[rows]
    position, velocity = w.fit(track.t, track.uv, at=track.t[rows])
    found.uv[rows[better]], found.uv_dot[rows[better]] = position[better], velocity[better]
    found.sigma[rows[better]] = deviation[better]


def _deviation(track: _Track, w: Windows, rows: IntArray) -> FloatArray:
    """(W,) [px/s]. From noise, and from the kink that scatter beyond noise is taken to be."""
    sigma = track.sigma[rows]
    excess = np.sqrt(np.maximum(w.scatter(track.t, track.uv) ** 2 - sigma**2, 0.0))
    gain = w.velocity_gain(track.t[rows])
    outside = gain / w.velocity_gain()  # at the ends of a window all errors are larger
    return np.hypot(gain * sigma, KINK * outside * excess / w.span)


def _sizes(wanted: int) -> list[int]:
    """Of the windows to try: the wanted one, and halves, down to the shortest parabola that shows a scatter."""
    sizes = []
    while wanted > MIN_PARABOLA:
        sizes.append(wanted)
        wanted //= 2
    return [*sizes, MIN_PARABOLA] if wanted == MIN_PARABOLA or sizes else []


@lru_cache(maxsize=32)
def _usual(size: int) -> float:
    """Scatter over the noise that white noise stays below."""
    dof = 2 * (size - 3)
    return float(np.sqrt(2 * gammaincinv(dof / 2, 1 - CHANCE) / dof))  # chi squared over dof
