"""The whole-drive estimate of the paper's simulated trials (section 3.1), from the same end points and velocities.

The noise levels are those of the simulation: the standard deviations b / sqrt(3) of its uniform noise. The solver is
the one that `calibrate` uses; what recordings need beside it, clocks and lenses and wrong sightings, is switched off.
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

if TYPE_CHECKING:
    from airground.calibration.samples import MotionSamples
    from airground.studies.simulation import PaperSimulation, Progress, Trials

__all__ = ["WholeDriveTrials", "whole_drive_trial", "whole_drive_trials"]

PROGRESS_STEPS = 100


@dataclass(frozen=True, slots=True, eq=False)
class WholeDriveTrials:
    """Whole-drive estimates of the trials that have a linear one."""

    g_hat: FloatArray
    """(M, 3, 2). Estimates."""

    uv_dot: FloatArray
    """(M, N, 2) [px/s]. Image velocities by eq. 15, at the estimated middles and velocities of the segments."""


def whole_drive_trials(
    trials: Trials, simulation: PaperSimulation, *, progress: Progress | None = None
) -> WholeDriveTrials:
    """Estimate all trials.

    Parameters
    ----------
    trials : Trials
        With their samples.
    simulation : PaperSimulation
        Duration and noise.
    progress : callable, optional
        Told of the trials done, about a hundred times.

    Returns
    -------
    estimates : WholeDriveTrials
        In the same order.
    """
    each = []
    total = len(trials.samples)
    for k, (samples, g) in enumerate(zip(trials.samples, trials.g_hat, strict=True), start=1):
        each.append(whole_drive_trial(samples, g, simulation))
        if progress is not None and (k == total or k % max(total // PROGRESS_STEPS, 1) == 0):
            progress(k, total)
    return WholeDriveTrials(np.stack([g for g, _ in each]), np.stack([v for _, v in each]))


def whole_drive_trial(
    samples: MotionSamples, g_start: FloatArray, simulation: PaperSimulation
) -> tuple[FloatArray, FloatArray]:
    """Estimate one trial.

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
    half = samples.uv_dot * duration / 2
    ends = np.concatenate([samples.uv[:1] - half[:1], samples.uv + half])
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
        raise UnobservableMotionError(
            "no start leads to an estimate", rank=0, headings_deg=(), advice="drive more headings"
        )
    g_hat, xy = view.to_px(best.state.g), best.state.robots[0].xy
    middle = project(view, best.state.g, 0.0, (xy[1:] + xy[:-1]) / 2)
    return g_hat, image_velocity(g_hat, middle, np.diff(xy, axis=0) / duration)


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
