"""The first whole-drive estimate: noise levels to begin with, gross errors out, a second solution looked at."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.local_polynomial import noise_level
from airground.calibration.trajectory.levels import Bounds
from airground.calibration.trajectory.positions import first_robot
from airground.calibration.trajectory.scatter import reading_scatter
from airground.calibration.trajectory.solver import refine
from airground.calibration.trajectory.state import Noise, State
from airground.errors import UnobservableMotionError

if TYPE_CHECKING:
    from airground.calibration.recordings import Motion
    from airground.calibration.trajectory.chain import Chain
    from airground.calibration.trajectory.problem import Problem
    from airground.calibration.trajectory.solver import Solution
    from airground.calibration.trajectory.start import Start
    from airground.geometry.limited import LimitedHomography

__all__ = ["first_noise", "first_solution", "noise_bounds"]

GRADUAL = (
    8.0,
    2.5,
)  # factors on the noise with which gross errors are found, before it is taken as it is
LEAST_SCATTER = 0.001  # sqrt(s); no odometry is better than this
MORE, LESS = (
    1.5,
    4.0,
)  # how far the odometry's white noise may be from what its readings scatter by: that errs up
RIVAL_APART = 100.0  # squared distance of two solutions, in deviations, from which they are two
ALIKE = 12.0  # how much more a second solution may cost


def first_noise(few: list[Chain], motion: Motion) -> Noise:
    """Noise levels to begin with.

    Parameters
    ----------
    few : list of Chain
        Sightings.
    motion : Motion
        Readings.

    Returns
    -------
    noise : Noise
        From what sightings and readings scatter by.
    """
    rough = [noise_level(c.uv) for c in few]
    known = [r for r in rough if np.isfinite(r)]
    pixel = float(np.clip(np.median(known) if known else 1.0, 0.1, 20.0))
    along, across = _scatter(few, motion) or (0.02, 0.02)
    return Noise(
        pixel=pixel,
        along=float(np.clip(along, LEAST_SCATTER, 0.1)),
        across=float(np.clip(across, LEAST_SCATTER, 0.1)),
        slip=0.03,
        drift=0.05,
    )


def _scatter(few: list[Chain], motion: Motion) -> tuple[float, float] | None:
    levels = [s for c in few if (s := reading_scatter(motion, c.name)) is not None]
    if len(levels) < len(few):
        return None
    return max(s[0] for s in levels), max(s[1] for s in levels)


def noise_bounds(few: list[Chain], motion: Motion) -> Bounds:
    """Where noise levels may lie.

    White noise of the odometry is what its readings scatter by, where they are many; the rest hangs together.

    Parameters
    ----------
    few : list of Chain
        Sightings.
    motion : Motion
        Readings.

    Returns
    -------
    bounds : Bounds
        Of all levels.
    """
    scatter = _scatter(few, motion)
    if scatter is None:
        return Bounds()
    along, across = (max(s, LEAST_SCATTER) for s in scatter)
    return Bounds(along=(along / LESS, along * MORE), across=(across / LESS, across * MORE))


def first_solution(problem: Problem, start: Start) -> tuple[Solution, bool]:
    """First estimate.

    Parameters
    ----------
    problem : Problem
        With noise levels to begin with.
    start : Start
        g, clock and headings to begin with.

    Returns
    -------
    solution : Solution
        The better of the two where the start has a second g.
    rival : bool
        Whether the other fits alike and is clearly different.

    Raises
    ------
    UnobservableMotionError
        If the iteration leaves what a camera can see.
    """
    solution = _gradually(problem, start, start.fit.model)
    if start.fit.alternative is None:
        return solution, False
    try:
        other = _gradually(problem, start, start.fit.alternative)
    except UnobservableMotionError:
        return solution, False
    if other.cost < solution.cost:
        solution, other = other, solution
    apart = (other.state.g - solution.state.g).ravel()
    clear = float(apart @ np.linalg.solve(solution.covariance[:6, :6], apart)) > RIVAL_APART
    return solution, clear and other.cost < solution.cost + ALIKE


def _gradually(problem: Problem, start: Start, model: LimitedHomography) -> Solution:
    """First estimate: with noise taken so large that only the grossest errors fall out, then less."""
    names = {name: float(t) for name, t in zip(start.targets, start.turns, strict=True)}
    state = State(
        problem.view.to_normal(model.g),
        start.offset,
        tuple(
            first_robot(problem.view, model, c, start.offset, names.get(c.name, 0.0))
            for c in problem.chains
        ),
    )
    noise = problem.noise
    for factor in GRADUAL:
        large = replace(
            noise,
            pixel=noise.pixel * factor,
            along=noise.along * factor,
            across=noise.across * factor,
        )
        state = refine(replace(problem, noise=large), state, rounds=6).state
    return refine(problem, state)
