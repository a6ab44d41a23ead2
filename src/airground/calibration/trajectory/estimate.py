"""The whole-drive estimate, from recordings: start, noise levels, nuisances, covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.clock import REACH
from airground.calibration.headings import distinct_headings_deg
from airground.calibration.recordings import Tracks
from airground.calibration.trajectory.agreement import following
from airground.calibration.trajectory.chain import Chain, chains
from airground.calibration.trajectory.first import first_noise, first_solution, noise_bounds
from airground.calibration.trajectory.positions import resampled
from airground.calibration.trajectory.problem import Problem
from airground.calibration.trajectory.selection import (
    covariance_in_doubt,
    covariance_with_lens,
    select_nuisances,
    select_wander,
)
from airground.calibration.trajectory.solver import Solution, refine
from airground.calibration.trajectory.start import Start, find_start, plausible_tracks
from airground.calibration.trajectory.state import Free, Priors
from airground.calibration.trajectory.thinning import thinned
from airground.calibration.trajectory.view import View
from airground.calibration.trajectory.whiteness import HANGING, correlation_factor
from airground.errors import InputError, UnobservableMotionError
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    from airground.calibration.recordings import Motion
    from airground.calibration.trajectory.levels import Bounds
    from airground.calibration.trajectory.selection import Distortion
    from airground.geometry.arrays import FloatArray

__all__ = ["WholeDrive", "estimate_whole_drive"]

LEAST_PX = 0.01  # deviation of a sighting; no detector is better than this
FULL = 0.5  # weight from which a sighting counts as one that follows
REACH_S = 0.3  # how far the clock offset may move from where the search put it


@dataclass(frozen=True, slots=True, eq=False)
class WholeDrive:
    """A whole-drive estimate."""

    problem: Problem
    """What it was made from, with the noise levels found."""

    solution: Solution
    """The estimate."""

    covariance: FloatArray
    """(B, B). Of the global unknowns of `problem.layout`."""

    start: Start
    """Where it started."""

    hanging: float
    """Factor on the sightings' variance that their correlation needed; 1 for white errors."""

    inliers: float
    """Share of the sightings that have their full weight."""

    following: dict[str, float]
    """Of each robot, the share of full weight among the sightings that fit in with their neighbours: what a detector
    threw anywhere does not count here, what moves on a way of its own does."""

    followed: float
    """That of all robots together."""

    rival: bool
    """Whether a clearly different solution fits alike."""

    cautious: FloatArray
    """(6, 6). Covariance of g_T with the doubt whether there is a lens, where none was found and one was looked for."""

    @property
    def model(self) -> LimitedHomography:
        """G in pixels."""
        return LimitedHomography(self.problem.view.to_px(self.solution.state.g))


def estimate_whole_drive(
    tracks: Tracks,
    motion: Motion,
    *,
    offset: float | None = None,
    distortion: Distortion = "auto",
    center: FloatArray | None = None,
    scale_sigma: float = 0.02,
) -> WholeDrive:
    """Estimate g, the positions and the nuisances together.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    offset : float, optional [s]
        Clock offset, where known.
    distortion : {"auto", "none", "division"}
        Whether to estimate a lens: where the data show one, never, or always.
    center : (2,) array, optional [px]
        Centre of the lens.
    scale_sigma : float
        Relative deviation of a robot's speed scale.

    Returns
    -------
    estimate : WholeDrive
        The estimate.

    Raises
    ------
    UnobservableMotionError
        If there is no start from which to estimate, or the estimate leaves it.
    InputError
        If tracks and motion do not belong together.
    """
    smooth = plausible_tracks(tracks, motion)
    start = find_start(_only(tracks, smooth), motion, offset)
    keep = following(tracks, motion, start, smooth)
    span = float(np.ptp(tracks.t))
    reach = 0.0 if offset is not None else min(REACH_S, span / 20)
    drive = chains(tracks, motion, start.offset, keep=keep, reach=reach)
    if not drive:
        raise InputError(
            "no target has two sightings inside its readings; both files need one clock"
        )
    view = View.around(np.concatenate([c.uv for c in drive]), center)
    few = [chain.sharing(motion) for chain in thinned(drive)]
    problem = Problem(
        view=view,
        chains=tuple(few),
        noise=first_noise(few, motion),
        priors=Priors(scale=scale_sigma, bend=view.usual_bend),
        free=Free(
            offset=offset is None,
            turn=_apart(start, few),
            # Velocities in a frame that does not turn come from no wheels.
            slip=motion.heading is not None,
            drift=motion.heading is not None,
        ),
        offset=start.offset,
    )
    bounds = noise_bounds(few, motion)
    solution, rival = first_solution(problem, start)
    free = problem.free
    problem, solution = select_wander(problem, solution, bounds)
    if _finer(problem, solution, bounds):
        bounds = replace(bounds, pixel=(LEAST_PX, bounds.pixel[1]))
        problem, solution = select_wander(replace(problem, free=free), solution, bounds)
    problem, solution, hanging = _whole_model(problem, solution, bounds, distortion)
    moved = abs(solution.state.offset - start.offset)
    if moved > REACH:
        raise UnobservableMotionError(
            f"the clocks' offset runs away ({solution.state.offset:+.1f} s)",
            rank=0,
            headings_deg=distinct_headings_deg(start.data.samples.xy_dot),
            advice="give the offset if you know it, or check that tracks and motion belong together",
        )
    if moved > reach / 2 > 0:  # near the ends of the readings other sightings have some now
        again = chains(tracks, motion, solution.state.offset, keep=keep, reach=reach)
        drive = again if [c.name for c in again] == [c.name for c in drive] else drive
    problem, solution = _all(problem, solution, drive)
    covariance = solution.covariance
    cautious = covariance[:6, :6]
    if problem.free.lens or distortion != "auto":
        pass
    elif hanging <= HANGING:
        cautious = covariance_in_doubt(problem, solution)
    else:
        # An image begins at (0, 0) and holds all sightings: its middle is there or further out, if not known.
        middles = [view.center] if center is not None else [view.center, tracks.uv.max(axis=0) / 2]
        wider = [covariance_with_lens(problem, solution, middle) for middle in middles]
        cautious = max(wider, key=lambda c: float(np.trace(c)))
    full = np.array([np.count_nonzero(w >= FULL) for w, _ in solution.weights])
    inside = np.array([len(chain) for chain in drive])
    seen, fit_in, kept = (
        np.array([np.count_nonzero(which[tracks.rows(chain.name)]) for chain in drive])
        for which in (np.ones(len(tracks), dtype=bool), smooth, keep)
    )
    whole = full.sum() / inside.sum() * kept.sum()
    each = full / inside * kept / fit_in
    return WholeDrive(
        problem,
        solution,
        covariance,
        start,
        hanging,
        inliers=float(whole / seen.sum()),
        following={chain.name: float(x) for chain, x in zip(drive, each, strict=True)},
        followed=float(whole / fit_in.sum()),
        rival=rival,
        cautious=cautious,
    )


def _only(tracks: Tracks, keep: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Tracks:
    if keep.all():
        return tracks
    return Tracks(
        tracks.targets,
        tracks.target_index[keep],
        tracks.t[keep],
        tracks.uv[keep],
        None if tracks.sigma is None else tracks.sigma[keep],
    )


def _apart(start: Start, few: list[Chain]) -> tuple[int, ...]:
    names = {start.targets[k] for k in start.apart}
    return tuple(k for k, chain in enumerate(few) if chain.name in names)


def _finer(problem: Problem, solution: Solution, bounds: Bounds) -> bool:
    """Whether the sightings are better than any is taken to be at first.

    Taken as worse than they are, they are given what the odometry errs by, and that hangs together. Where all is white
    at that level it stays, as stiffer sightings make the cost less smooth.
    """
    at_floor = problem.noise.pixel < bounds.pixel[0] * (1 + 1e-6)
    return at_floor and correlation_factor(problem, solution) > HANGING


def _whole_model(
    problem: Problem, solution: Solution, bounds: Bounds, distortion: Distortion
) -> tuple[Problem, Solution, float]:
    """Nuisances, and how much the sightings' errors hang together even so.

    Where they do, a lens or a lever is believed only if it makes an end of it: else it would take up what is not one.
    """
    fuller, found = select_nuisances(problem, solution, distortion)
    if fuller is not problem:  # drift and slip, and the noise, have taken up what these now explain
        fuller, found = select_wander(fuller, found, bounds)
    if correlation_factor(problem, solution) <= HANGING:
        return fuller, found, 1.0
    hanging = correlation_factor(fuller, found)
    if hanging > HANGING and distortion != "division":
        fuller, found = problem, solution
        hanging = correlation_factor(problem, solution)
    if hanging > 1:
        fuller = _noisier(fuller, hanging)
        found = refine(fuller, found.state)
    return fuller, found, hanging


def _noisier(problem: Problem, factor: float) -> Problem:
    noise = problem.noise
    return replace(problem, noise=replace(noise, pixel=noise.pixel * float(np.sqrt(factor))))


def _all(problem: Problem, solution: Solution, drive: list[Chain]) -> tuple[Problem, Solution]:
    """The estimate on all sightings, from that on some."""
    state = solution.state
    robots = tuple(
        resampled(robot, some, many, state.offset)
        for robot, some, many in zip(state.robots, problem.chains, drive, strict=True)
    )
    problem = replace(problem, chains=tuple(drive))
    return problem, refine(problem, replace(state, robots=robots), rounds=12)
