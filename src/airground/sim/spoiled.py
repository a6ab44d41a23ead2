"""What becomes of true sightings and readings on their way into a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.calibration.recordings import IntArray
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.sim.recording_noise import RecordingNoise
    from airground.sim.route_drive import Pose

__all__ = ["Readings", "Sightings", "spoil_readings", "spoil_sightings"]

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """What the tracker wrote down, sorted by name and time."""

    rows: IntArray
    """(N,). Which true rows."""

    uv: FloatArray
    """(N, 2) [px]. Where it saw them."""

    name: IntArray
    """(N,). Number of the robot that it took them for."""

    wrong: BoolArray
    """(N,). Outlier, repeated position or another robot's name."""


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """What the robots wrote down."""

    heading: FloatArray
    """(M,) [rad]. Does not wrap."""

    speed: FloatArray
    """(M,) [m/s]. Along the heading."""

    distance: FloatArray
    """(M,) [m]. Odometer, 0 at each robot's first reading."""

    slip: FloatArray
    """(M,). The slow part of the speed's relative error."""

    drift: FloatArray
    """(M,) [rad]. The slow part of the heading's error, without the bias."""


def spoil_sightings(
    uv: FloatArray,
    t: FloatArray,
    robot: IntArray,
    *,
    size_px: FloatArray,
    noise: RecordingNoise,
    rng: np.random.Generator,
) -> Sightings:
    """Noise, outliers, duplicates, rounding, dropouts and swapped names.

    Parameters
    ----------
    uv : (N, 2) array [px]
        Through the lens; NaN for what is not in front of the camera.
    t : (N,) array [s]
        Times, ascending for each robot.
    robot : (N,) array of int
        Numbers, ascending.
    size_px : (2,) array [px]
        Of the image.
    noise : RecordingNoise
        How much.
    rng : Generator
        Where it comes from.

    Returns
    -------
    sightings : Sightings
        Of what is in the image and not dropped.
    """
    inside = ((uv >= -0.5) & (uv <= size_px - 0.5)).all(axis=1)  # NaN compares as False
    shown = uv + rng.normal(0.0, noise.pixel_px, uv.shape)
    wrong = rng.random(len(t)) < noise.outlier_share
    shown = np.where(wrong[:, None], rng.uniform(-0.5, size_px - 0.5, uv.shape), shown)
    if noise.whole_pixels:
        shown = np.rint(shown)
    keep = np.flatnonzero(inside & ~_dropped(t, robot, noise, rng))
    repeats = rng.random(len(keep)) < noise.duplicate_share
    repeats &= np.diff(robot[keep], prepend=-1) == 0  # a robot's first sighting has none before it
    source = np.maximum.accumulate(np.where(repeats, 0, np.arange(len(keep))))

    name = robot[keep]
    if noise.swapped_s is not None:
        start, end = noise.swapped_s
        swapped = (t[keep] >= start) & (t[keep] < end) & (name < 2) & (robot.max() > 0)
        name = np.where(swapped, 1 - name, name)
    order = np.lexsort((t[keep], name))
    bad = wrong[keep][source] | repeats | (name != robot[keep])
    return Sightings(keep[order], shown[keep][source][order], name[order], bad[order])


def _dropped(
    t: FloatArray, robot: IntArray, noise: RecordingNoise, rng: np.random.Generator
) -> BoolArray:
    """Times of seeing and of not seeing take turns, each of exponential duration."""
    if noise.dropout_share == 0:
        return np.zeros(len(t), dtype=np.bool_)
    gap = noise.dropout_s
    seen = gap * (1 / noise.dropout_share - 1)
    clock = t + robot * (np.ptp(t) + 1.0)  # one robot's time after the other's
    total = float(np.ptp(clock)) + 1.0
    turns = int(2 * total / (gap + seen) + 40)
    while True:
        spans = rng.exponential(1.0, (turns, 2)) * (seen, gap)
        ends = clock.min() + np.cumsum(spans.ravel())
        if ends[-1] > clock.max():
            return np.asarray(np.searchsorted(ends, clock) % 2 == 1)
        turns *= 2


def spoil_readings(
    read: Pose,
    t: FloatArray,
    robot: IntArray,
    *,
    bias: FloatArray,
    scale: FloatArray,
    noise: RecordingNoise,
    rng: np.random.Generator,
) -> Readings:
    """Bias, scale, slip, drift, white noise and an odometer that stands.

    Parameters
    ----------
    read : Pose
        Truth at the readings, M of them.
    t : (M,) array [s]
        Times on the clock of the tracks, in equal steps for each robot.
    robot : (M,) array of int
        Numbers, ascending; as many readings of each.
    bias : (K,) array [rad]
        Of each robot's headings.
    scale : (K,) array
        Of each robot's speeds.
    noise : RecordingNoise
        How much.
    rng : Generator
        Where it comes from.

    Returns
    -------
    readings : Readings
        The distance is the way driven, with the noise of the speeds integrated over it.
    """
    count = len(bias)
    dt = 1 / noise.motion_hz
    shape = (count, len(t) // count)
    slip = (noise.slip * _slow(shape, dt / noise.slip_s, rng)).ravel()
    steps = noise.heading_drift * np.sqrt(dt) * rng.normal(size=shape)
    steps[:, 0] = 0.0
    drift = np.cumsum(steps, axis=1).ravel()

    heading = read.theta + bias[robot] + drift + rng.normal(0.0, noise.heading_rad, len(t))
    true = scale[robot] * read.speed
    error = true * (slip + rng.normal(0.0, noise.speed_share, len(t)))
    error = error + rng.normal(0.0, noise.speed_mps, len(t))
    moves = np.ones(len(t))
    if noise.stuck_s is not None:
        start, end = noise.stuck_s
        moves[(robot == 0) & (t >= start) & (t < end)] = 0.0
    counted = scale[robot][1:] * np.diff(read.way) + dt * (error[1:] + error[:-1]) / 2
    counted = np.where(np.diff(robot) == 0, counted * moves[1:] * moves[:-1], 0.0)
    distance = np.concatenate([[0.0], np.cumsum(counted)]).reshape(shape)
    distance = (distance - distance[:, :1]).ravel()
    return Readings(heading, (true + error) * moves, distance, slip, drift)


def _slow(shape: tuple[int, int], step: float, rng: np.random.Generator) -> FloatArray:
    """Rows of noise of unit variance that forgets by exp(-step) from one entry to the next.

    The recursion x_k = a x_(k-1) + e_k by doubling: after pass j an entry holds its last 2^j kicks.
    """
    keep = float(np.exp(-step))
    x = rng.normal(size=shape) * np.sqrt(1 - keep**2)
    x[:, 0] = rng.normal(size=shape[0])  # starts in its steady state
    reach = 1
    while reach < shape[1] and keep**reach > 1e-17:
        x[:, reach:] = x[:, reach:] + keep**reach * x[:, :-reach]
        reach *= 2
    return np.asarray(x)
