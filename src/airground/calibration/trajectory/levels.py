"""Noise levels from the residuals: restricted maximum likelihood of a linearised whole drive.

At a linearisation, everything is Gaussian, and the likelihood of the noise levels with all unknowns integrated out is::

    -2 log p = cost at the optimum + log det(information) + 2 sum(log sigma)

The information is a sum of one part for each kind of measurement over its variance, so that a new set of levels costs
one banded factorisation and no new derivatives. The levels are found one after the other, on a logarithmic scale.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.trajectory.normal import (
    Normal,
    eliminate,
    of_odometry,
    of_sightings,
)
from airground.calibration.trajectory.problem import Problem, prior_information, processes
from airground.calibration.trajectory.rows import odometry_rows, sighting_rows
from airground.calibration.trajectory.solver import Solution, refine
from airground.calibration.trajectory.wander import of_process
from airground.errors import UnobservableMotionError

if TYPE_CHECKING:
    from airground.calibration.trajectory.chain import Chain
    from airground.calibration.trajectory.state import Noise, Robot, State
    from airground.geometry.arrays import FloatArray

__all__ = ["Bounds", "estimate_levels", "likelihood"]

SWEEPS = 4
SETTLED = 0.1  # of the likelihood's logarithm: a sweep that gains less is the last
FIRST_STEP = 0.7  # of a logarithm
LAST_STEP = 0.05
LEAST_WEIGHT = 0.5  # a residual of less weight is gross and tells nothing of the noise
WIDTH = {
    "pixel": 2.0,
    "along": 0.3,
    "across": 0.3,
    "slip": 1.0,
    "drift": 1.0,
    "slip_s": 0.5,
    "drift_s": 1.0,
}
"""Deviation of the logarithm of each level about where it starts: keeps what the data do not tell from running away."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Where each level may lie."""

    pixel: tuple[float, float] = (0.1, 1e3)
    """[px]."""

    along: tuple[float, float] = (1e-4, 0.5)
    """[sqrt(s)]."""

    across: tuple[float, float] = (1e-4, 0.5)
    """[rad sqrt(s)]."""

    slip: tuple[float, float] = (1e-4, 0.2)
    """[1]."""

    drift: tuple[float, float] = (1e-4, 0.5)
    """[rad]."""

    slip_s: tuple[float, float] = (0.5, 30.0)
    """[s]."""

    drift_s: tuple[float, float] = (0.3, 1e3)
    """[s]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Pieces:
    """One chain's normal equations, in units of the noise."""

    chain: Chain
    """Its sightings and readings."""

    robot: Robot
    """Its unknowns where it is linearised."""

    sightings: Normal
    """Of the sightings [px]."""

    along: Normal
    """Of the increments along their direction."""

    across: Normal
    """Of the increments across it."""

    counted: float
    """Sightings that are not gross."""

    linked: float
    """Increments that are not gross."""

    def total(self, problem: Problem, noise: Noise) -> tuple[Normal, float]:
        """All rows at some noise levels, and the sum of the logarithms of their deviations."""
        normal = (
            self.sightings.scaled(noise.pixel**-2)
            + self.along.scaled(noise.along**-2)
            + self.across.scaled(noise.across**-2)
        )
        logs = 2 * self.counted * np.log(noise.pixel) + self.linked * (
            np.log(noise.along) + np.log(noise.across)
        )
        free, size, dt = problem.free, len(normal.corner_right), np.diff(self.chain.t)
        for place, (value, sigma, memory) in enumerate(processes(free, noise, self.robot), start=2):
            process, log_sigma = of_process(
                value,
                self.chain.link,
                dt,
                sigma=sigma,
                memory=memory,
                place=place,
                width=free.width,
                size=size,
            )
            normal, logs = normal + process, logs + log_sigma
        return normal, logs


def _pieces(problem: Problem, solution: Solution) -> list[_Pieces]:
    found = []
    state, layout = solution.state, problem.layout
    for k, (chain, robot) in enumerate(zip(problem.chains, state.robots, strict=True)):
        odometry = chain.odometry(state.offset)
        seen = sighting_rows(problem.view, chain, odometry, state, robot, layout=layout, number=k)
        driven = odometry_rows(chain, odometry, robot, layout=layout, number=k)
        # What is gross counts neither as a measurement nor by its squares.
        w, v = (np.where(x >= LEAST_WEIGHT, x, 0.0) for x in solution.weights[k])
        along, across = (v[:, None] * np.eye(2)[j] for j in (0, 1))
        found.append(
            _Pieces(
                chain,
                robot,
                of_sightings(seen, w),
                of_odometry(driven, along, len(chain)),
                of_odometry(driven, across, len(chain)),
                float(np.sum(w > 0)),
                float(np.sum(v > 0)),
            )
        )
    return found


def likelihood(problem: Problem, solution: Solution, noise: Noise | None = None) -> float:
    """Minus the logarithm of the restricted likelihood of noise levels, up to a constant.

    Parameters
    ----------
    problem : Problem
        Data, and what is estimated.
    solution : Solution
        Where to linearise, with its weights.
    noise : Noise, optional
        Levels; the problem's own where not given.

    Returns
    -------
    value : float
        Smaller is likelier.
    """
    return _value(problem, solution.state, _pieces(problem, solution), noise or problem.noise)


def _value(problem: Problem, state: State, pieces: list[_Pieces], noise: Noise) -> float:
    layout = problem.layout
    information, right, constant = prior_information(problem, state)
    information = np.diag(information)
    value = constant
    for k, piece in enumerate(pieces):
        normal, logs = piece.total(problem, noise)
        try:
            chain = eliminate(normal)
        except UnobservableMotionError:
            return np.inf
        columns = layout.columns(k)
        information[np.ix_(columns, columns)] += chain.schur
        right[columns] += chain.right
        value += normal.cost - float(chain.local @ chain.local) + chain.log_det + 2 * logs
    size = np.sqrt(np.diag(information))
    if not (np.isfinite(size).all() and (size > 0).all()):
        return np.inf
    values, vectors = np.linalg.eigh(information / size[:, None] / size)
    values = np.maximum(values, 1e-14 * values[-1])
    along = vectors.T @ (right / size)
    value += float(np.sum(np.log(values)) + 2 * np.sum(np.log(size)) - np.sum(along**2 / values))
    return value / 2


def estimate_levels(
    problem: Problem,
    solution: Solution,
    names: tuple[str, ...],
    bounds: Bounds,
    *,
    rounds: int = 2,
) -> tuple[Problem, Solution, float]:
    """Find the likeliest noise levels, and the estimate that goes with them.

    Parameters
    ----------
    problem : Problem
        Data, with levels to start from.
    solution : Solution
        The estimate with those.
    names : tuple of str
        Fields of `Noise` to find.
    bounds : Bounds
        Where they may lie.
    rounds : int
        How often to linearise anew.

    Returns
    -------
    problem : Problem
        With the levels found.
    solution : Solution
        The estimate with them.
    value : float
        Minus the logarithm of their likelihood.
    """
    start, value = problem.noise, np.inf
    for turn in range(rounds):
        pieces = _pieces(problem, solution)
        noise, value = _search(
            problem,
            solution.state,
            pieces,
            limits={name: np.log(getattr(bounds, name)) for name in names},
            start=start,
            first=FIRST_STEP / 4**turn,
        )
        problem = replace(problem, noise=noise)
        solution = refine(problem, solution.state, rounds=8)
    return problem, solution, value


def _search(
    problem: Problem,
    state: State,
    pieces: list[_Pieces],
    *,
    limits: dict[str, FloatArray],
    start: Noise,
    first: float,
) -> tuple[Noise, float]:
    """Coordinate by coordinate, each to the minimum of a parabola through three values."""

    def at(x: dict[str, float]) -> float:
        noise = replace(problem.noise, **{k: float(np.exp(v)) for k, v in x.items()})
        penalty = sum(((v - np.log(getattr(start, k))) / WIDTH[k]) ** 2 / 2 for k, v in x.items())
        return _value(problem, state, pieces, noise) + float(penalty)

    x = {
        name: float(np.clip(np.log(getattr(problem.noise, name)), *limit))
        for name, limit in limits.items()
    }
    best = at(x)
    steps = dict.fromkeys(limits, first)
    for _ in range(SWEEPS):
        before = best
        for name, (low, high) in limits.items():
            h = steps[name]
            if h < LAST_STEP:
                continue
            tries = [min(max(x[name] + d, low), high) for d in (-h, h)]
            values = [at({**x, name: t}) for t in tries]
            bend = values[0] - 2 * best + values[1]
            step = h * (values[0] - values[1]) / (2 * bend) if bend > 0 else np.inf
            if not abs(step) < 2 * h:
                step = 2 * h * float(np.sign(values[0] - values[1]))
            place = min(max(x[name] + step, low), high)
            candidates = [(best, x[name]), *zip(values, tries, strict=True)]
            if place != x[name]:
                candidates.append((at({**x, name: place}), place))
            new, where = min(candidates)
            moved = abs(where - x[name])
            x[name], best = where, new
            steps[name] = min(first, max(moved, h / 4)) if moved >= h else h / 3
        if before - best < SETTLED:
            break
    return replace(problem.noise, **{k: float(np.exp(v)) for k, v in x.items()}), best
