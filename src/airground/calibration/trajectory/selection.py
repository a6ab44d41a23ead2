"""Which nuisances the data show: wandering headings and scales, a lens, levers. Each stays only if it earns it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.calibration.trajectory.levels import Bounds, estimate_levels
from airground.calibration.trajectory.problem import cost
from airground.calibration.trajectory.solver import refine
from airground.errors import UnobservableMotionError

if TYPE_CHECKING:
    from airground.calibration.trajectory.problem import Problem
    from airground.calibration.trajectory.solver import Solution
    from airground.calibration.trajectory.state import State
    from airground.geometry.arrays import FloatArray

__all__ = [
    "Distortion",
    "covariance_in_doubt",
    "covariance_with_lens",
    "lens_probability",
    "level_names",
    "select_nuisances",
    "select_wander",
]

Distortion = Literal["auto", "none", "division"]

WANDER = (
    1.0  # how much likelier drift or slip must make the data: to miss one is worse than to keep it
)
ANY_BEND = 0.1  # k1 in normalised units, of what stands for all that is not in the model
LIKELY = 0.75  # probability from which a lens is taken: where data tell nothing, it is one half
SHIFTS_S = (0.0, -0.5, -0.25, 0.25, 0.5)  # of the clock, that a lever may have been taken for
LEVER = 16.0  # how much less a lever must cost: two numbers


def level_names(problem: Problem) -> tuple[str, ...]:
    """Noise levels that a problem has.

    Parameters
    ----------
    problem : Problem
        With what wanders.

    Returns
    -------
    names : tuple of str
        Fields of `Noise`.
    """
    wanders = [name for name in ("drift", "slip") if getattr(problem.free, name)]
    return ("pixel", "along", "across", *wanders, *(f"{name}_s" for name in wanders))


def select_wander(problem: Problem, solution: Solution, bounds: Bounds) -> tuple[Problem, Solution]:
    """Noise levels, and whether headings drift and wheels slip: first with both, then without what is not needed.

    Parameters
    ----------
    problem : Problem
        With drift and slip switched on where they may be.
    solution : Solution
        Its estimate.
    bounds : Bounds
        Where noise levels may lie.

    Returns
    -------
    problem : Problem
        With the noise levels found, and what wanders.
    solution : Solution
        Its estimate.
    """
    wanders = [name for name in ("drift", "slip") if getattr(problem.free, name)]

    def levels(problem: Problem, solution: Solution) -> tuple[Problem, Solution, float]:
        return estimate_levels(problem, solution, level_names(problem), bounds)

    problem, solution, value = levels(problem, solution)
    for field in wanders:
        free, zero = problem.free, field == "drift"
        plain = replace(
            problem,
            free=replace(free, drift=free.drift and not zero, slip=free.slip and zero),
        )
        robots = tuple(
            replace(
                r,
                drift=np.zeros_like(r.drift) if zero else r.drift,
                slip=r.slip if zero else np.zeros_like(r.slip),
            )
            for r in solution.state.robots
        )
        try:
            first = refine(plain, replace(solution.state, robots=robots), rounds=8)
            trial, tried, new = levels(plain, first)
        except UnobservableMotionError:
            continue
        if new < value + WANDER:
            problem, solution, value = trial, tried, new
    return problem, solution


def select_nuisances(
    problem: Problem, solution: Solution, distortion: Distortion
) -> tuple[Problem, Solution]:
    """Switch on the lens and the levers that the data show.

    Parameters
    ----------
    problem : Problem
        With its noise levels.
    solution : Solution
        Its estimate.
    distortion : {"auto", "none", "division"}
        Whether to look for a lens.

    Returns
    -------
    problem : Problem
        With what was switched on.
    solution : Solution
        Its estimate.

    Raises
    ------
    UnobservableMotionError
        If a lens is asked for and leads nowhere.
    """
    if distortion != "none":
        trial = replace(problem, free=replace(problem.free, lens=True))
        try:
            found = refine(trial, solution.state)
            if distortion == "division" or lens_probability(problem, solution, found) > LIKELY:
                problem, solution = trial, found
        except UnobservableMotionError:
            if distortion == "division":
                raise
    for k in range(len(problem.chains)):
        trial = replace(problem, free=replace(problem.free, lever=(*problem.free.lever, k)))
        other = _with_lever(trial, solution.state, k)
        if other is None:
            continue
        if cost(problem, solution.state) - cost(trial, other.state) > LEVER:
            problem, solution = trial, other
    return problem, solution


def _with_lever(problem: Problem, state: State, robot: int) -> Solution | None:
    """The cheapest estimate with a lever, if there is any.

    On an arc a lever ahead looks like a later clock: a wrong clock may have been found before the lever was thought of.
    """
    # Speeds that wander, or a lever already, are what a wrong clock shows by.
    free = problem.free
    shifts = SHIFTS_S if free.offset and free.slip and not free.lever[:-1] else (0.0,)
    best: Solution | None = None
    for shift in shifts:
        ahead = (shift * problem.chains[robot].usual_speed, 0.0)
        robots = list(state.robots)
        robots[robot] = replace(robots[robot], lever=ahead)
        start = replace(state, offset=state.offset - shift, robots=tuple(robots))
        try:
            found = refine(problem, start)
        except UnobservableMotionError:
            continue
        if best is None or found.cost < best.cost:
            best = found
    return best


def lens_probability(problem: Problem, without: Solution, found: Solution) -> float:
    """How likely the image is bent, by the evidence of both models; as likely as not before the data.

    A lens that is free always fits better. What it costs is the range that it might have had beforehand over the one
    that the data leave it: the more exactly they would show one, the less likely it is that they show none by chance.

    Parameters
    ----------
    problem : Problem
        Without a lens.
    without : Solution
        Its estimate.
    found : Solution
        That with a lens.

    Returns
    -------
    probability : float
        By Laplace's approximation, everything else being as sure with a lens as without.
    """
    place = replace(problem, free=replace(problem.free, lens=True)).layout.bend
    assert place is not None
    left = float(np.sqrt(found.covariance[place, place]))
    evidence = (without.cost - found.cost) / 2 + np.log(min(1.0, left / problem.priors.bend))
    return float(1 / (1 + np.exp(-np.clip(evidence, -500, 500))))


def covariance_in_doubt(problem: Problem, solution: Solution) -> FloatArray:
    """Covariance of g_T where a lens was not found and there may be one: the mean over both, about the one without.

    Parameters
    ----------
    problem : Problem
        Without a lens.
    solution : Solution
        Its estimate.

    Returns
    -------
    covariance : (6, 6) array
        Of g_T, row by row.
    """
    own = solution.covariance[:6, :6]
    wider = replace(problem, free=replace(problem.free, lens=True))
    try:
        found = refine(wider, solution.state)
    except UnobservableMotionError:
        return own
    share = lens_probability(problem, solution, found)
    apart = (found.state.g - solution.state.g).ravel()
    other = found.covariance[:6, :6] + np.outer(apart, apart)
    return np.asarray(own + share * (other - own))


def covariance_with_lens(problem: Problem, solution: Solution, center: FloatArray) -> FloatArray:
    """Covariance of g_T as if a lens were estimated too: something is not in the model, and it might be that.

    Parameters
    ----------
    problem : Problem
        Without a lens.
    solution : Solution
        Its estimate.
    center : (2,) array [px]
        Of the lens.

    Returns
    -------
    covariance : (6, 6) array
        Of g_T, row by row.
    """
    free, view = replace(problem.free, lens=True), replace(problem.view, center=center)
    priors = replace(problem.priors, bend=ANY_BEND)
    wider = replace(problem, free=free, view=view, priors=priors)
    return refine(wider, solution.state, rounds=0).covariance[:6, :6]
