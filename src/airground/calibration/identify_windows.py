"""Velocities to compare: of every fragment in the image, of every robot on the ground, on one grid of times.

A fragment's velocity is the slope of a straight line through the sightings of a short window. The ground goes through
the same filter, at any offset of the clocks, so that what it smooths away is smoothed away on both sides of eq. 15.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.calibration.ground_path import ground_path
from airground.calibration.identify_evidence import noise, on_its_own
from airground.calibration.local_polynomial import noise_level
from airground.calibration.trajectory.plausible import plausible_sightings

if TYPE_CHECKING:
    from airground.calibration.ground_path import GroundPath
    from airground.calibration.recordings import Motion, Tracks
    from airground.geometry.arrays import FloatArray

__all__ = ["Fragment", "RobotMotion", "fragments", "robot_motion", "window_length"]

BoolArray = NDArray[np.bool_]

SHORTEST_S, LONGEST_S = 0.4, 2.0
"""Of a window; a ground vehicle's velocity changes little in the one, and hides its turns in the other."""

ROWS = 8
"""Sightings wanted in a window."""

NOISE_SHARE = 0.05
"""Of the usual speed in the image: the noise of a velocity for which windows are made longer."""

COVERED = 0.6
"""Share of a window that its sightings must span."""

STEP_S = 0.05
"""Grid of a robot's smoothed velocity; changes within it are below what a window shows."""

TAPS = 9
"""Points of the ground path in a window."""

MOVES = 10.0
"""Extent of a fragment's place, in deviations of a sighting, below which it is taken to stand."""

SLOW = 0.1
"""Speed, over the usual one, below which something is at rest."""

CORRELATION_S = (0.8, 10.0)
"""Least and longest time after which a velocity counts as a new one."""


@dataclass(frozen=True, slots=True, eq=False)
class Fragment:
    """One track of unknown origin, as velocities over windows."""

    name: str
    """Its name."""

    first_s: float
    """First sighting [s]."""

    last_s: float
    """Last sighting [s]."""

    ends: FloatArray
    """(2, 2) [px]. Where it was first and last seen."""

    t: FloatArray
    """(K,) [s]. Middles of the windows, on the clock of the tracks."""

    uv: FloatArray
    """(K, 2) [px]. Places."""

    uv_dot: FloatArray
    """(K, 2) [px/s]. Velocities."""

    gain: FloatArray
    """(K,) [px/s]. What the noise of the sightings makes of a component of the velocity."""

    usual: float
    """Root mean square speed while it moves [px/s]; 0 for what stands."""

    step: float
    """From window to window [s]."""

    alone: FloatArray
    """(K,). Log density of each velocity, for a vehicle that nobody knows."""

    def noise(self, relative: float) -> FloatArray:
        """Deviation of each component of the velocities at a level of noise.

        Parameters
        ----------
        relative : float
            Deviation over speed.

        Returns
        -------
        sigma : (K,) array [px/s]
            With what the sightings' noise makes.
        """
        return noise(self.uv_dot, self.gain, self.usual, relative)

    @property
    def moves(self) -> bool:
        """Whether it moves at all."""
        return self.usual > 0 and len(self.t) > 0


@dataclass(frozen=True, slots=True, eq=False)
class RobotMotion:
    """A robot's ground velocity, smoothed as the fragments' are."""

    name: str
    """Its name."""

    t: FloatArray
    """(M,) [s]. Even grid, on the clock of the readings."""

    xy_dot: FloatArray
    """(M, 2) [m/s]. Velocities; NaN where there are no readings."""

    usual: float
    """Root mean square speed while it moves [m/s]; 0 where it never does."""

    memory_s: float
    """Time after which its velocity is a new one [s]."""

    path: GroundPath | None
    """The readings, integrated; None where there are fewer than two."""

    def way(self, first_s: float, last_s: float) -> FloatArray | None:
        """Displacement between two times, not smoothed.

        Parameters
        ----------
        first_s : float [s]
            From when.
        last_s : float [s]
            Until when; may be before.

        Returns
        -------
        way : (2,) array or None [m]
            None where readings are missing.
        """
        if self.path is None:
            return None
        xy, stretch = self.path.at(np.array([first_s, last_s]))
        return xy[1] - xy[0] if stretch[0] == stretch[1] >= 0 else None

    def at(self, t: FloatArray) -> FloatArray:
        """Velocities at given times.

        Parameters
        ----------
        t : (...) array [s]
            Times, on the clock of the readings.

        Returns
        -------
        xy_dot : (..., 2) array [m/s]
            NaN where there are no readings.
        """
        if len(self.t) == 0:
            return np.full((*t.shape, 2), np.nan)
        x = np.interp(t, self.t, self.xy_dot[:, 0], left=np.nan, right=np.nan)
        y = np.interp(t, self.t, self.xy_dot[:, 1], left=np.nan, right=np.nan)
        return np.stack([x, y], axis=-1)


def window_length(tracks: Tracks) -> float:
    """Length of the windows of all fragments.

    Parameters
    ----------
    tracks : Tracks
        All fragments.

    Returns
    -------
    length : float [s]
        Long enough for some sightings in each, and for the noise to average out of what moves.
    """
    wanted, steps, weights = [], [], []
    for name in tracks.targets:
        rows = tracks.rows(name)
        t, uv = tracks.t[rows], tracks.uv[rows]
        if len(t) < ROWS:
            continue
        dt = float(np.median(np.diff(t)))
        steps.append(dt)
        sigma = _sigma(tracks, rows, uv)
        if np.linalg.norm(np.ptp(uv, axis=0)) < MOVES * sigma:
            continue
        stride = max(1, round(SHORTEST_S / dt))
        way = np.linalg.norm(uv[stride:] - uv[:-stride], axis=1)
        if len(way) == 0:
            continue
        speed = float(np.sqrt(np.mean(way**2))) / (stride * dt)
        # Deviation of a slope over L at rate 1/dt: sigma sqrt(12 dt / L^3).
        wanted.append((sigma * np.sqrt(12 * dt) / (NOISE_SHARE * max(speed, 1e-9))) ** (2 / 3))
        weights.append(t[-1] - t[0])
    shortest = max([SHORTEST_S, *([ROWS * float(np.median(steps))] if steps else [])])
    if wanted:
        order = np.argsort(wanted)
        share = np.cumsum(np.array(weights)[order]) / max(float(np.sum(weights)), 1e-9)
        middle = int(order[min(int(np.searchsorted(share, 0.5)), len(order) - 1)])
        shortest = max(shortest, float(wanted[middle]))
    return float(min(shortest, max(LONGEST_S, 3 * float(np.median(steps)) if steps else 0.0)))


def fragments(tracks: Tracks, length: float) -> list[Fragment]:
    """Velocities of all fragments.

    Parameters
    ----------
    tracks : Tracks
        All fragments.
    length : float [s]
        Of a window; its middles are multiples of half of it.

    Returns
    -------
    fragments : list of Fragment
        In the order of the tracks' targets.
    """
    return [_fragment(tracks, name, length) for name in tracks.targets]


def _fragment(tracks: Tracks, name: str, length: float) -> Fragment:
    rows = tracks.rows(name)
    begin, end = float(tracks.t[rows][0]), float(tracks.t[rows][-1])
    good = plausible_sightings(tracks, name)  # one gross error would spoil a window
    t, uv = tracks.t[rows][good], tracks.uv[rows][good]
    sigma = _sigma(tracks, rows, uv)
    half = length / 2
    first, last = np.ceil((t[0] + 0.7 * half) / half), np.floor((t[-1] - 0.7 * half) / half)
    middle = half * np.arange(first, last + 1)
    start = np.searchsorted(t, middle - half)
    stop = np.searchsorted(t, middle + half, side="right")
    count = stop - start
    few = count < 2
    spans = t[np.minimum(stop, len(t)) - 1] - t[np.minimum(start, len(t) - 1)]
    good = ~few & (spans >= COVERED * length)
    middle, start, stop, count = middle[good], start[good], stop[good], count[good]
    # Sums over windows as differences of running sums, from numbers near zero so that no digits are lost.
    base_t, base = float(t.mean()), uv.mean(axis=0)
    s, w = t - base_t, uv - base

    def total(values: FloatArray) -> FloatArray:
        running = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
        return np.asarray(running[stop] - running[start])

    S0, S1, S2 = count.astype(np.float64), total(s), total(s * s)
    Sw, Ssw = total(w), total(s[:, None] * w)
    mean_t, mean = S1 / S0, Sw / S0[:, None]
    spread = np.maximum(S2 - S0 * mean_t**2, 1e-12)
    slope = (Ssw - (S0 * mean_t)[:, None] * mean) / spread[:, None]
    place = base + mean + slope * (middle - base_t - mean_t)[:, None]
    gain = sigma / np.sqrt(spread)
    speed = np.linalg.norm(slope, axis=1)
    usual = 0.0
    if len(middle) and np.linalg.norm(np.ptp(place, axis=0)) > MOVES * sigma / np.sqrt(S0.mean()):
        fast = speed[speed > max(SLOW * float(speed.max()), 3 * float(np.median(gain)))]
        usual = float(np.sqrt(np.mean(fast**2))) if len(fast) else 0.0
    return Fragment(
        name=name,
        first_s=begin,
        last_s=end,
        ends=uv[[0, -1]],
        t=middle,
        uv=place,
        uv_dot=slope,
        gain=gain,
        usual=usual,
        step=half,
        alone=on_its_own(slope, gain, usual),
    )


def _sigma(tracks: Tracks, rows: slice, uv: FloatArray) -> float:
    """Noise of a coordinate [px]; what stays within whole pixels may be rounded."""
    if tracks.sigma is not None:
        return float(np.median(tracks.sigma[rows]))
    rough = noise_level(uv)
    return max(0.3, rough if np.isfinite(rough) else 1.0)


def robot_motion(motion: Motion, name: str, length: float) -> RobotMotion:
    """Smooth a robot's readings as the fragments' windows do.

    Parameters
    ----------
    motion : Motion
        Readings.
    name : str
        Which robot.
    length : float [s]
        Of a window.

    Returns
    -------
    motion : RobotMotion
        Without times where there are fewer than two readings.
    """
    path = ground_path(motion, name)
    if path is None:
        return RobotMotion(name, np.zeros(0), np.zeros((0, 2)), 0.0, CORRELATION_S[1], None)
    t = np.arange(path.t[0], path.t[-1] + STEP_S / 2, STEP_S)
    taps = np.linspace(-length / 2, length / 2, TAPS)
    xy, stretch = path.at((t[:, None] + taps).ravel())
    xy, stretch = xy.reshape(len(t), TAPS, 2), stretch.reshape(len(t), TAPS)
    xy_dot = np.einsum("k,mkc->mc", taps, xy - xy[:, TAPS // 2, None]) / np.sum(taps**2)
    broken = (stretch < 0).any(axis=1) | (stretch != stretch[:, :1]).any(axis=1)
    xy_dot[broken] = np.nan
    speed = np.linalg.norm(xy_dot[~broken], axis=1)
    fast = speed[speed > SLOW * float(speed.max(initial=0.0))]
    usual = float(np.sqrt(np.mean(fast**2))) if len(fast) else 0.0
    return RobotMotion(name, t, xy_dot, usual, _memory(xy_dot[~broken]), path)


def _memory(xy_dot: FloatArray) -> float:
    """Lag at which the autocorrelation of the velocity falls below 1/e [s]."""
    shortest, longest = CORRELATION_S
    off = xy_dot - xy_dot.mean(axis=0) if len(xy_dot) else xy_dot
    power = float(np.sum(off**2))
    if power <= 0:
        return longest
    size = 2 * len(off)
    spectrum = np.abs(np.fft.rfft(off, size, axis=0)) ** 2
    correlation = np.fft.irfft(spectrum.sum(axis=1), size)[: len(off)] / power
    below = np.flatnonzero(correlation < np.exp(-1))
    return float(np.clip(below[0] * STEP_S if len(below) else longest, shortest, longest))
