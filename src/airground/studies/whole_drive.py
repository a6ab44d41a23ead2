"""The whole-drive estimate of the paper's simulated trials (section 3.1), from the same end points and velocities.

The noise levels are those of the simulation: the standard deviations b / sqrt(3) of its uniform noise. One trial is
estimated by the solver that `calibrate` uses; what recordings need beside it, clocks and lenses and wrong sightings, is
switched off. Many trials are estimated at once (`airground.studies.batch_fit`), which is the same and ten times faster.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.ground_path import GroundPath
from airground.calibration.robust import robust_fit
from airground.calibration.trajectory.chain import Chain
from airground.calibration.trajectory.solver import Problem, Solution, refine
from airground.calibration.trajectory.state import Free, Noise, Priors, Robot, State
from airground.calibration.trajectory.view import View, project
from airground.errors import UnobservableMotionError
from airground.geometry.arrays import FloatArray
from airground.geometry.limited import LimitedHomography
from airground.geometry.velocity import image_velocity
from airground.studies.batch_fit import Drives, fit_drives
from airground.studies.simulation import BLOCK
from airground.studies.workers import HERE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.calibration.samples import MotionSamples
    from airground.studies.simulation import PaperSimulation, Progress, Trials
    from airground.studies.workers import Workers

__all__ = ["WholeDriveTrials", "whole_drive_block", "whole_drive_trial", "whole_drive_trials"]


@dataclass(frozen=True, slots=True, eq=False)
class WholeDriveTrials:
    """Whole-drive estimates of the trials that have a linear one."""

    g_hat: FloatArray
    """(M, 3, 2). Estimates."""

    uv_dot: FloatArray
    """(M, N, 2) [px/s]. Image velocities by eq. 15, at the estimated middles and velocities of the segments."""


def whole_drive_trials(
    trials: Trials,
    simulation: PaperSimulation,
    *,
    progress: Progress | None = None,
    workers: Workers = HERE,
) -> WholeDriveTrials:
    """Estimate all trials.

    Parameters
    ----------
    trials : Trials
        With their samples.
    simulation : PaperSimulation
        Duration and noise.
    progress : callable, optional
        Told of the trials done, block by block.
    workers : Workers
        Who works; the outcome does not depend on it.

    Returns
    -------
    estimates : WholeDriveTrials
        In the same order.

    Raises
    ------
    UnobservableMotionError
        If a trial has no start that leads to an estimate.
    """
    total = len(trials.samples)
    firsts = range(0, total, BLOCK)
    tasks = (
        (trials.samples[k : k + BLOCK], trials.g_hat[k : k + BLOCK], simulation) for k in firsts
    )
    each = []
    for first, block in zip(
        firsts, workers.map(whole_drive_block, tasks, len(firsts)), strict=True
    ):
        each.append(block)
        if progress is not None:
            progress(min(first + BLOCK, total), total)
    return WholeDriveTrials(
        np.concatenate([block.g_hat for block in each]),
        np.concatenate([block.uv_dot for block in each]),
    )


def whole_drive_block(
    samples: Sequence[MotionSamples], g_start: FloatArray, simulation: PaperSimulation
) -> WholeDriveTrials:
    """Estimate some trials at once, as `whole_drive_trial` would one by one, and further down.

    Parameters
    ----------
    samples : sequence of MotionSamples
        M.
    g_start : (M, 3, 2) array
        Linear estimates.
    simulation : PaperSimulation
        Duration and noise.

    Returns
    -------
    estimates : WholeDriveTrials
        In the same order.

    Raises
    ------
    UnobservableMotionError
        If a trial has no start that leads to an estimate.
    """
    duration = simulation.drive.duration_s
    ends = np.stack([_ends(one, duration) for one in samples])
    views = [View.around(one) for one in ends]
    starts = [_starts(one, g, simulation) for one, g in zip(samples, g_start, strict=True)]
    which = np.repeat(np.arange(len(samples)), [len(some) for some in starts])
    scale = np.array([view.scale for view in views])
    middle = np.stack([view.middle for view in views])
    drives = Drives(
        (ends - middle[:, None]) * scale[:, None, None],
        np.stack([one.xy_dot for one in samples]) * duration,
        scale * simulation.pixel_bound_px / np.sqrt(3),
        duration * simulation.speed_bound_mps / np.sqrt(3),
    )
    flat = [g for some in starts for g in some]
    begun = np.stack([views[k].to_normal(g) for k, g in zip(which, flat, strict=True)])
    fit = fit_drives(drives.take(which), begun)
    order = np.lexsort((fit.cost, which))  # of each trial, the best first, and the first of alikes
    best = order[np.searchsorted(which, np.arange(len(samples)))]
    if not np.isfinite(fit.cost[best]).all():
        raise _no_start()
    g = np.stack([views[k].to_px(fit.g[row]) for k, row in enumerate(best)])
    xy = fit.xy[best]
    uv = np.stack(
        [
            project(view, fit.g[row], 0.0, (one[1:] + one[:-1]) / 2)
            for view, row, one in zip(views, best, xy, strict=True)
        ]
    )
    return WholeDriveTrials(g, image_velocity(g[:, None], uv, np.diff(xy, axis=1) / duration))


def whole_drive_trial(
    samples: MotionSamples, g_start: FloatArray, simulation: PaperSimulation
) -> tuple[FloatArray, FloatArray]:
    """Estimate one trial, by the solver that `calibrate` uses.

    Parameters
    ----------
    samples : MotionSamples
        Middles and differences of the noisy end points, and noisy velocities.
    g_start : (3, 2) array
        Linear estimate.
    simulation : PaperSimulation
        Duration and noise.

    Returns
    -------
    g : (3, 2) array
        Estimate.
    uv_dot : (N, 2) array [px/s]
        Image velocities in the middles of the segments.

    Raises
    ------
    UnobservableMotionError
        If no start leads to an estimate.
    """
    duration = simulation.drive.duration_s
    ends = _ends(samples, duration)
    chain = _chain(ends, samples.xy_dot, duration)
    view = View.around(ends)
    deviation_m = duration * simulation.speed_bound_mps / np.sqrt(3)
    problem = Problem(
        view=view,
        chains=(chain,),
        noise=Noise(simulation.pixel_bound_px / np.sqrt(3), deviation_m, deviation_m),
        priors=Priors(scale=0.0),
        free=Free(offset=False),
        offset=0.0,
        knee=np.inf,
    )
    best: Solution | None = None
    for g in _starts(samples, g_start, simulation):
        try:
            found = refine(problem, _state(view, g, chain), rounds=50)
        except UnobservableMotionError:
            continue
        if best is None or found.cost < best.cost:
            best = found
    if best is None:
        raise _no_start()
    g_hat, xy = view.to_px(best.state.g), best.state.robots[0].xy
    middle = project(view, best.state.g, 0.0, (xy[1:] + xy[:-1]) / 2)
    return g_hat, image_velocity(g_hat, middle, np.diff(xy, axis=0) / duration)


def _no_start() -> UnobservableMotionError:
    return UnobservableMotionError(
        "no start leads to an estimate", rank=0, headings_deg=(), advice="drive more headings"
    )


def _ends(samples: MotionSamples, duration: float) -> FloatArray:
    """The points that the samples are the middles and the differences of."""
    half = samples.uv_dot * duration / 2
    return np.concatenate([samples.uv[:1] - half[:1], samples.uv + half])


def _starts(
    samples: MotionSamples, g_start: FloatArray, simulation: PaperSimulation
) -> list[FloatArray]:
    """The linear estimate, and that by both components of eq. 15 with its rival."""
    starts = [g_start]
    duration = simulation.drive.duration_s
    pixel = simulation.pixel_bound_px / np.sqrt(3) * np.sqrt(2) / duration
    speed = np.hypot(samples.uv_dot[:, 0], samples.uv_dot[:, 1])
    sigma = np.hypot(pixel, simulation.speed_bound / np.sqrt(3) * speed)
    try:
        fit = robust_fit(samples, sigma_pxps=2 * sigma, rng=np.random.default_rng(0))
    except UnobservableMotionError:
        return starts
    starts.append(fit.model.g)
    if fit.alternative is not None:
        starts.append(fit.alternative.g)
    return starts


def _state(view: View, g: FloatArray, chain: Chain) -> State:
    """Positions from the odometry, moved to where the sightings are in the middle."""
    read = chain.odometry(0.0).xy
    seen = LimitedHomography(g).ground_position(chain.uv, view.middle)
    off = seen - read
    known = np.isfinite(off).all(axis=1)
    moved = np.median(off[known], axis=0) if known.any() else np.zeros(2)
    zero = np.zeros(len(chain))
    return State(view.to_normal(g), 0.0, (Robot(read + moved, zero, zero),))


def _chain(ends: FloatArray, xy_dot: FloatArray, duration: float) -> Chain:
    count = len(xy_dot)
    t = duration * np.arange(count + 1, dtype=np.float64)
    xy = np.concatenate([np.zeros((1, 2)), np.cumsum(xy_dot * duration, axis=0)])
    path = GroundPath(t, xy, xy_dot, xy_dot, np.zeros(count, dtype=np.intp))
    # Noise of a displacement is the same for all, whatever speed was read.
    power = t / duration
    linked = np.ones(count, dtype=bool)
    return Chain("robot", t, ends, np.ones(count + 1), path, None, power, 0.0, linked)
