"""From tracks and motion readings to motion correspondences: clocks, gaps, windows, several targets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.ground_path import GroundPath, ground_path, reading_noise
from airground.calibration.local_polynomial import MIN_PARABOLA, Windows, noise_level, windows
from airground.calibration.recordings import IntArray
from airground.calibration.samples import MotionSamples
from airground.errors import InputError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.recordings import Motion, Tracks

__all__ = ["Correspondences", "Pairing", "choose_count", "gap_limit", "pair_recordings", "unbroken"]

COUNTS = (2, 3, 5, 7, 9, 11, 15, 21, 31, 41, 61, 81, 121)
WANTED_NOISE = 0.01  # of the velocity, from pixel noise and from reading noise each
MAX_SHARE = 0.1  # of the track's extent that a window may cover: over it g's perspective must be nearly constant
BEND_SHARE = 0.975  # a target may turn for a small part of its time only
BEND_SIGMAS = 3.5  # 97.5 per cent of noise in two coordinates stay within 2.7 deviations
MAX_GAP = 0.25  # s; sightings further apart than this, and than GAP_FACTOR intervals, do not share a window
GAP_FACTOR = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Correspondences:
    """Motion correspondences of all targets at one clock offset."""

    samples: MotionSamples
    """W samples."""

    window: IntArray
    """(W,). Number of the window that each came from: the same at every clock offset."""

    target_index: IntArray
    """(W,). Which target."""

    span: FloatArray
    """(W,) [s]. Time over which the velocities were taken."""

    sightings: dict[str, int]
    """How many sightings of each target the samples rest on."""


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """One target's sightings in windows, and its path on the ground."""

    index: int
    """Which of the pairing's targets."""

    t: FloatArray
    """(N,) [s]. Times of its sightings."""

    windows: Windows
    """W windows over them."""

    uv: FloatArray
    """(W, 2) [px]. Position in each window."""

    uv_dot: FloatArray
    """(W, 2) [px/s]. Velocity in each window."""

    path: GroundPath
    """Its readings, integrated."""


@dataclass(frozen=True, slots=True, eq=False)
class Pairing:
    """Sightings and readings of the targets that are in both files, ready for any clock offset."""

    targets: tuple[str, ...]
    """Names of the targets that can be calibrated on."""

    pairs: tuple[_Pair, ...]
    """Windows over the sightings, and paths of the readings."""

    def thinned(self, most: int) -> Pairing:
        """Keep every so many windows, for what need not see all of them.

        Parameters
        ----------
        most : int
            About so many windows to keep.

        Returns
        -------
        pairing : Pairing
            Itself where it has no more.
        """
        count = sum(len(pair.windows.first) for pair in self.pairs)
        if count <= most:
            return self
        every = slice(None, None, -(-count // most))
        return Pairing(
            self.targets,
            tuple(
                replace(p, windows=p.windows.take(every), uv=p.uv[every], uv_dot=p.uv_dot[every])
                for p in self.pairs
            ),
        )

    def at_offset(self, offset: float) -> Correspondences:
        """Motion correspondences with the readings' clock ahead by `offset`.

        Parameters
        ----------
        offset : float [s]
            To be added to a sighting's time to get the readings' time.

        Returns
        -------
        correspondences : Correspondences
            Those windows that lie in unbroken stretches of readings.
        """
        uv, uv_dot, xy_dot, number, target, span = [], [], [], [], [], []
        sightings = {}
        base = 0
        for pair in self.pairs:
            xy, stretch = pair.path.at(pair.t + offset)
            w = pair.windows
            first, last = stretch[w.first], stretch[w.first + w.count - 1]
            keep = (first >= 0) & (first == last)
            for k in range(
                1, w.count - 1
            ):  # a gap may lie in between, where the number comes back to the same
                keep &= stretch[w.first + k] == first
            kept = w.take(keep)
            _, velocity = kept.fit(pair.t, xy)
            uv.append(pair.uv[keep])
            uv_dot.append(pair.uv_dot[keep])
            xy_dot.append(velocity)
            number.append(base + np.flatnonzero(keep))
            target.append(np.full(int(keep.sum()), pair.index, dtype=np.intp))
            span.append(kept.span)
            sightings[self.targets[pair.index]] = kept.rows_covered(len(pair.t))
            base += len(w.first)
        return Correspondences(
            samples=MotionSamples(
                np.concatenate(uv), np.concatenate(uv_dot), np.concatenate(xy_dot)
            ),
            window=np.concatenate(number),
            target_index=np.concatenate(target),
            span=np.concatenate(span),
            sightings=sightings,
        )


def pair_recordings(tracks: Tracks, motion: Motion) -> Pairing:
    """Match the targets of tracks and motion, and lay windows over their sightings.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.

    Returns
    -------
    pairing : Pairing
        Targets that are in both.

    Raises
    ------
    InputError
        If no target is in both, or none has enough rows.
    """
    common = [name for name in tracks.targets if name in motion.targets]
    if not common:
        raise InputError(
            f"no target is in both tracks ({_names(tracks.targets)}) and motion ({_names(motion.targets)}); "
            "name the robot the same in both"
        )
    pairs = []
    for index, name in enumerate(common):
        rows = tracks.rows(name)
        path = ground_path(motion, name)
        t, uv = tracks.t[rows], tracks.uv[rows]
        if path is None or len(t) < 2:
            continue
        sigma = None if tracks.sigma is None else float(np.median(tracks.sigma[rows]))
        count = choose_count(t, uv, sigma=sigma, path=path)
        laid = windows(t, unbroken(t, count, step=max(1, count // 4)), count)
        position, velocity = laid.fit(t, uv)
        pairs.append(_Pair(index, t, laid, position, velocity, path))
    if not pairs:
        raise InputError("no target has two sightings and two readings")
    return Pairing(tuple(common), tuple(pairs))


def _names(targets: tuple[str, ...]) -> str:
    shown = ", ".join(targets[:5])
    return shown if len(targets) <= 5 else f"{shown} and {len(targets) - 5} more"


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
