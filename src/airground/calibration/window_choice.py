"""How long to look for a velocity: windows from the data's rate and noise, never across a gap."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.ground_path import reading_noise
from airground.calibration.local_polynomial import MIN_PARABOLA, Windows, noise_level, windows

if TYPE_CHECKING:
    from airground.calibration.ground_path import GroundPath
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["choose_count", "gap_limit", "unbroken"]

COUNTS = (2, 3, 5, 7, 9, 11, 15, 21, 31, 41, 61, 81, 121)
WANTED_NOISE = 0.01  # of the velocity, from pixel noise and from reading noise each
MAX_SHARE = 0.1  # of the track's extent that a window may cover: over it g's perspective must be nearly constant
BEND_SHARE = 0.975  # a target may turn for a small part of its time only
BEND_SIGMAS = 3.5  # 97.5 per cent of noise in two coordinates stay within 2.7 deviations
MAX_GAP = 0.25  # s; sightings further apart than this, and than GAP_FACTOR intervals, do not share a window
GAP_FACTOR = 4.0
ENOUGH = 4000  # windows to judge a length by


def unbroken(t: FloatArray, count: int, *, step: int = 1) -> IntArray:
    """First rows of all windows of `count` rows that no gap breaks.

    Parameters
    ----------
    t : (N,) array [s]
        Times, strictly ascending.
    count : int
        Rows in a window.
    step : int
        Take every so many windows.

    Returns
    -------
    first : (W,) array of int
        Empty where there are too few rows.
    """
    dt = np.diff(t)
    if len(t) < count or count < 2:
        return np.zeros(0, dtype=np.intp)
    broken = np.concatenate([[0], np.cumsum(dt > gap_limit(t))])
    first = np.arange(0, len(t) - count + 1, step)
    return np.asarray(first[broken[first + count - 1] == broken[first]])


def gap_limit(t: FloatArray) -> float:
    """Time between two sightings beyond which they do not share a window.

    Parameters
    ----------
    t : (N,) array [s]
        Times of one target's sightings.

    Returns
    -------
    limit : float [s]
        From the usual interval.
    """
    return max(MAX_GAP, GAP_FACTOR * float(np.median(np.diff(t)))) if len(t) > 1 else MAX_GAP


def choose_count(
    t: FloatArray, uv: FloatArray, *, sigma: float | None = None, path: GroundPath | None = None
) -> int:
    """Rows in a window, from the data's rate and noise.

    The shortest window over which the velocity's noise, from pixels and from readings, falls to one per
    cent; but none that covers more than a tenth of the track's extent. With readings, what the window smooths
    away is smoothed away on both sides of eq. 15. Without, it also stops growing where a longer window gives
    another velocity than noise explains: there the target turns or brakes within it.

    Parameters
    ----------
    t : (N,) array [s]
        Times of one target's sightings.
    uv : (N, 2) array [px]
        Its positions.
    sigma : float, optional [px]
        Noise of a coordinate, if the detector states it.
    path : GroundPath, optional
        The readings, if there are any.

    Returns
    -------
    count : int
        One of `COUNTS`.
    """
    noise = noise_level(uv) if sigma is None else sigma
    if not np.isfinite(noise):
        return COUNTS[0]
    reading = reading_noise(path) if path is not None else 0.0
    reading_dt = float(np.median(np.diff(path.t))) if path is not None else 0.0
    extent = float(np.linalg.norm(np.ptp(uv, axis=0)))
    best = COUNTS[0]
    for count in COUNTS:
        first = unbroken(t, count, step=max(1, count // 2))
        if len(first) == 0:
            break
        first = first[:: -(-len(first) // ENOUGH)]
        w = windows(t, first, count)
        moved = np.linalg.norm(uv[first + count - 1] - uv[first], axis=1)
        moving = moved > 0.1 * float(np.quantile(moved, 0.9))
        if not moving.any():
            break
        way = float(np.median(moved[moving]))
        if count > 2 and way > MAX_SHARE * extent:
            break
        if path is None and count > MIN_PARABOLA and _bends(t, uv, w, best, noise):
            break
        best = count
        speed = np.median((moved / w.span)[moving])
        from_pixels = float(np.median(w.velocity_gain()[moving]) * noise / speed)
        per_window = max(1.0, float(np.median(w.span)) / reading_dt) if reading_dt > 0 else 1.0
        from_readings = reading / np.sqrt(per_window)
        enough = reading_dt == 0 or per_window >= 2
        if enough and from_pixels <= WANTED_NOISE and from_readings <= WANTED_NOISE:
            break
    return best


def _bends(t: FloatArray, uv: FloatArray, wide: Windows, count: int, noise: float) -> bool:
    """Whether velocities over wide windows differ from those over narrower ones by more than their noise."""
    narrow = windows(t, wide.first + (wide.count - count) // 2, count)
    at = narrow.centre
    difference = np.linalg.norm(wide.fit(t, uv, at)[1] - narrow.fit(t, uv, at)[1], axis=1)
    return float(np.quantile(difference, BEND_SHARE)) > BEND_SIGMAS * noise * float(
        np.median(narrow.velocity_gain())
    )
