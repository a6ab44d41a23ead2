"""A first g from a little data, and its refinement by the filter itself: what the recursive estimator starts from."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.calibration.ground_path import ground_path
from airground.calibration.online_filter import DriveFilter
from airground.calibration.robust import robust_fit
from airground.calibration.samples import MotionSamples
from airground.errors import AirgroundError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from airground.calibration.online_rows import Frame, Outcome
    from airground.calibration.recordings import Motion, Tracks
    from airground.geometry.arrays import FloatArray

__all__ = ["Refined", "refine", "start"]

CHORD = 0.1  # of the sightings' extent: long for the noise, short for the perspective
LEAST_CHORD_SIGMAS = 8.0
MODEL_NOISE = 0.03  # of a velocity: readings, and chords of bent paths
MOST = 400  # samples
FEWEST = 12
GUESS_SIGMA = 0.1  # of the first g, for the gate of the first pass
PASSES = 6
SETTLED = 0.01  # squared step, in units of the deviation, at which Gauss-Newton stops
FEWEST_GOOD = 0.5  # of the sightings that the result must explain
MOST_NIS = 12.0  # mean normalised innovation squared of those; 2 where the stated noise is true
LOST = 4  # refused sightings in a row: it was the first that was wrong, or the robot was moved
LONGEST_S = 10.0  # of a chord


def start(
    tracks: Tracks, motion: Motion, *, sigma_px: float, time_offset_s: float = 0.0
) -> FloatArray | None:
    """Find g from recordings that are short, and of which many sightings may be wrong (eqs. 15 and 16).

    Chords of the image path against those of the integrated readings are the motion correspondences.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    sigma_px : float [px]
        Standard deviation of each coordinate of a sighting.
    time_offset_s : float [s]
        To be added to times of the tracks to get times of the readings.

    Returns
    -------
    g : (3, 2) array or None
        None while the data do not determine it, or leave two different answers.
    """
    samples, sigma = _chords(tracks, motion, sigma_px, time_offset_s)
    if len(samples) < FEWEST:
        return None
    try:
        fit = robust_fit(samples, sigma_pxps=sigma, rng=np.random.default_rng(0))
    except AirgroundError:
        return None
    return None if fit.alternative is not None else fit.model.g


def _chords(
    tracks: Tracks, motion: Motion, sigma_px: float, offset: float
) -> tuple[MotionSamples, FloatArray]:
    """Motion correspondences from chords, and the noise of their image velocities."""
    extent = float(
        np.max(np.quantile(tracks.uv, 0.95, axis=0) - np.quantile(tracks.uv, 0.05, axis=0))
    )
    wanted = max(CHORD * extent, LEAST_CHORD_SIGMAS * sigma_px)
    uv, uv_dot, xy_dot, spans = [], [], [], []
    for name in tracks.targets:
        rows = tracks.rows(name)
        t, c = tracks.t[rows], tracks.uv[rows]
        path = ground_path(motion, name)
        if path is None or len(t) < 2:
            continue
        xy, stretch = path.at(t + offset)
        lag = _lag(c, wanted)
        first = np.arange(0, len(t) - lag)
        last = first + lag
        dt = t[last] - t[first]
        whole = (stretch[first] >= 0) & (stretch[first] == stretch[last]) & (dt < LONGEST_S)
        first, last, dt = first[whole], last[whole], dt[whole, None]
        uv.append((c[first] + c[last]) / 2)
        uv_dot.append((c[last] - c[first]) / dt)
        xy_dot.append((xy[last] - xy[first]) / dt)
        spans.append(dt[:, 0])
    if not uv:
        empty = np.zeros((0, 2))
        return MotionSamples(empty, empty, empty), np.zeros(0)
    joined = [np.concatenate(parts) for parts in (uv, uv_dot, xy_dot, spans)]
    thin = slice(None, None, max(1, -(-len(joined[3]) // MOST)))
    samples = MotionSamples(joined[0][thin], joined[1][thin], joined[2][thin])
    speed = np.linalg.norm(samples.uv_dot, axis=1)
    return samples, np.hypot(np.sqrt(2.0) * sigma_px / joined[3][thin], MODEL_NOISE * speed)


def _lag(c: FloatArray, wanted: float) -> int:
    """Sightings that a chord spans, so that a typical moving one has the wanted length."""
    lag = 1
    while lag < len(c) // 4:
        length = np.abs(c[lag:] - c[:-lag]).max(axis=1)
        if np.quantile(length, 0.6) >= wanted:
            break
        lag = max(lag + 1, lag * 5 // 4)
    return lag


class Refined(NamedTuple):
    """A filter that has seen a recording, linearised at its own answer."""

    filter: DriveFilter
    """Ready for more."""

    nis: float
    """Mean normalised innovation squared of the sightings that counted."""

    share: float
    """Of the sightings that counted."""


def refine(
    x: FloatArray,
    frames_at: Callable[[float], Sequence[Frame]],
    prior: FloatArray,
    *,
    mean: FloatArray,
    covariance: FloatArray | None = None,
    bias_sigma: float = 0.0,
    bias_drift: float = 0.0,
) -> Refined | None:
    """Gauss-Newton over a whole recording, each step a pass of the held filter.

    Parameters
    ----------
    x : (K,) array
        Where to begin.
    frames_at : callable
        Gives the recording, in order, for an addition to the clock offset that `x` begins with [s].
    prior : (K, K) array
        Information about the globals beforehand; zero for those that the recording has to tell.
    mean : (K,) array
        What that is about.
    covariance : (K, K) array, optional
        Of `x`, for the first gate; a tenth of each entry of g where not given.
    bias_sigma : float [rad]
        Prior deviation of the robots' heading biases.
    bias_drift : float [rad/sqrt(s)]
        Their random walk.

    Returns
    -------
    refined : Refined or None
        None if it does not converge, or explains too little.
    """
    begin = x
    frames = frames_at(0.0)
    if covariance is None:
        size = np.repeat(np.linalg.norm(x[:6].reshape(3, 2), axis=1), 2)
        covariance = np.diag(np.append(GUESS_SIGMA * size, np.full(len(x) - 6, 0.1)) ** 2)
    for k in range(PASSES):
        if k and len(x) == 7:
            frames = frames_at(float(x[6] - begin[6]))
        filter_ = DriveFilter(
            x, prior, bias_sigma=bias_sigma, bias_drift=bias_drift, gate_covariance=covariance
        )
        filter_.pull(mean)
        some = frames[:: 1 + (len(frames) > 600 and k < 2)]
        outcomes = _pass(filter_, some)
        if not _determined(filter_.information):
            return None
        step = filter_.release()
        x = filter_.x
        if not np.isfinite(x).all() or x[0] * x[3] - x[1] * x[2] == 0:
            return None
        # What is not settled yet may be as wrong as its last step.
        covariance = filter_.covariance + np.outer(step, step)
        if len(some) == len(frames) and step @ filter_.information @ step < SETTLED:
            break
    else:
        return None
    weight = np.concatenate([o.weight for o in outcomes])
    nis = np.concatenate([o.nis for o in outcomes])
    if not weight.any():
        return None
    refined = Refined(filter_, float(nis[weight > 0].mean()), float((weight > 0).mean()))
    return refined if refined.nis < MOST_NIS and refined.share > FEWEST_GOOD else None


def _pass(filter_: DriveFilter, frames: Sequence[Frame]) -> list[Outcome]:
    """Show it all frames; a robot that is refused again and again is put where it is seen."""
    outcomes = []
    refused: dict[int, int] = {}
    for frame in frames:
        outcome = filter_.update(frame)
        outcomes.append(outcome)
        if not refused and outcome.weight.all():
            continue
        for robot, weight in zip(outcome.robots.tolist(), outcome.weight, strict=True):
            if weight > 0:
                refused.pop(robot, None)
            elif (count := refused.pop(robot, 0) + 1) >= LOST:
                filter_.lose(robot)
            else:
                refused[robot] = count
    return outcomes


def _determined(information: FloatArray) -> bool:
    size = np.sqrt(np.diag(information))
    if not (np.isfinite(size).all() and (size > 0).all()):
        return False
    return bool(np.linalg.eigvalsh(information / np.outer(size, size))[0] > 1e-12)
