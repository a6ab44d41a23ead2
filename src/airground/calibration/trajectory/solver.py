"""Gauss-Newton over a whole drive: robust weights, damped by halving steps that do not help."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.trajectory.normal import (
    Eliminated,
    eliminate,
    of_odometry,
    of_sightings,
)
from airground.calibration.trajectory.problem import (
    Problem,
    cost,
    prior_information,
    processes,
    robust_weight,
)
from airground.calibration.trajectory.rows import odometry_rows, sighting_rows
from airground.calibration.trajectory.state import Robot, State
from airground.calibration.trajectory.wander import of_process
from airground.errors import UnobservableMotionError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.trajectory.chain import Odometry

__all__ = ["Problem", "Solution", "invert", "refine"]

HALVINGS = 6
ENOUGH = 0.03  # the step after one so short is far shorter
STEADY = 1e-3  # share of the cost that the last step may take off


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """An estimate and what is known about it."""

    state: State
    """The estimate."""

    information: FloatArray
    """(B, B). Of the global unknowns, positions eliminated."""

    cost: float
    """Robust cost."""

    weights: tuple[tuple[FloatArray, FloatArray], ...]
    """For each chain, weights of the sightings (N,) and of the increments (L,)."""

    sightings: tuple[FloatArray, ...]
    """For each chain, (N, 2) residuals over their deviations."""

    increments: tuple[FloatArray, ...]
    """For each chain, (L, 2) residuals over their deviations."""

    converged: bool
    """Whether the last step was small."""

    @property
    def covariance(self) -> FloatArray:
        """(B, B). Inverse of the information."""
        return invert(self.information)


def invert(information: FloatArray) -> FloatArray:
    """Invert a symmetric matrix whose rows have their own units each.

    Parameters
    ----------
    information : (B, B) array
        Positive definite, or nearly so.

    Returns
    -------
    covariance : (B, B) array
        With directions that nothing determines at a deviation of ten million of those units.
    """
    diagonal = np.diag(information)
    size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(information / size[:, None] / size)
    floor = 1e-14 * float(values[-1])
    scaled = vectors / np.sqrt(np.maximum(values, floor))
    root = scaled / size[:, None]
    return np.asarray(root @ root.T)


def refine(
    problem: Problem,
    start: State,
    *,
    rounds: int = 20,
) -> Solution:
    """Minimise the robust cost.

    Parameters
    ----------
    problem : Problem
        Data, noise, and what is estimated.
    start : State
        Where to start.
    rounds : int
        Most steps.

    Returns
    -------
    solution : Solution
        The estimate.

    Raises
    ------
    UnobservableMotionError
        If the iteration leaves what a camera can see.
    """
    odometries = _odometries(problem, start)
    state, now = start, cost(problem, start, odometries)
    converged = False
    linear = _linearise(problem, state, odometries)
    for _ in range(rounds):
        step, squared, gain = linear.step(problem)
        size, trial = 1.0, linear.moved(problem, state, step, 1.0)
        odometries = _odometries(problem, trial)
        new = cost(problem, trial, odometries)
        # A step that makes things worse is halved.
        while not new <= now * (1 + 1e-9) + 1e-9 and size > 0.5**HALVINGS:
            size /= 2
            trial = linear.moved(problem, state, step, size)
            odometries = _odometries(problem, trial)
            new = cost(problem, trial, odometries)
        if not new <= now * (1 + 1e-9) + 1e-9:
            converged = squared < 1.0
            break
        converged = squared < ENOUGH and gain < STEADY * (now + 1)
        state, now = trial, new
        if converged:
            break  # so short a step changes nothing else
        linear = _linearise(problem, state, odometries)
    return Solution(
        state,
        linear.information(problem),
        now,
        tuple(linear.weights),
        tuple(linear.sightings),
        tuple(linear.increments),
        converged,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Linear:
    """A problem linearised at a state."""

    eliminated: list[Eliminated]
    """One for each chain."""

    prior: FloatArray
    """(B,). Information on the globals beforehand."""

    prior_right: FloatArray
    """(B,). Its right side."""

    weights: list[tuple[FloatArray, FloatArray]]
    """As in `Solution`."""

    sightings: list[FloatArray]
    """As in `Solution`."""

    increments: list[FloatArray]
    """As in `Solution`."""

    def information(self, problem: Problem) -> FloatArray:
        """Information on the globals."""
        layout = problem.layout
        total = np.diag(self.prior)
        for k, chain in enumerate(self.eliminated):
            columns = layout.columns(k)
            total[np.ix_(columns, columns)] += chain.schur
        return total

    def step(self, problem: Problem) -> tuple[FloatArray, float, float]:
        """Change of the globals, its squared length in their deviations, and what all unknowns' take off the cost."""
        information = self.information(problem)
        right = self.prior_right.copy()
        for k, chain in enumerate(self.eliminated):
            right[problem.layout.columns(k)] += chain.right
        change = invert(information) @ right
        squared = float(change @ right)
        gain = squared + sum(float(chain.local @ chain.local) for chain in self.eliminated)
        return change, squared, gain

    def moved(self, problem: Problem, state: State, change: FloatArray, size: float) -> State:
        """Go that way."""
        layout, free = problem.layout, problem.free
        robots = []
        for k, (robot, chain) in enumerate(zip(state.robots, self.eliminated, strict=True)):
            local = size * chain.back(change[layout.columns(k)]).reshape(-1, free.width)
            turn, lever, own = layout.turn(k), layout.lever(k), layout.own(k)
            robots.append(
                Robot(
                    xy=robot.xy + local[:, :2],
                    drift=robot.drift + local[:, 2] if free.drift else robot.drift,
                    slip=robot.slip + local[:, -1] if free.slip else robot.slip,
                    turn=robot.turn + (0.0 if turn is None else size * float(change[turn])),
                    scale=robot.scale + size * float(change[own]),
                    lever=robot.lever
                    if lever is None
                    else (
                        robot.lever[0] + size * float(change[lever]),
                        robot.lever[1] + size * float(change[lever + 1]),
                    ),
                )
            )
        offset, bend = layout.offset, layout.bend
        return replace(
            state,
            g=state.g + size * change[:6].reshape(3, 2),
            offset=state.offset + (0.0 if offset is None else size * float(change[offset])),
            bend=state.bend + (0.0 if bend is None else size * float(change[bend])),
            robots=tuple(robots),
        )


def _odometries(problem: Problem, state: State) -> list[Odometry]:
    return [chain.odometry(state.offset) for chain in problem.chains]


def _linearise(problem: Problem, state: State, odometries: list[Odometry]) -> _Linear:
    layout, noise, free = problem.layout, problem.noise, problem.free
    eliminated, weights, sightings, increments = [], [], [], []
    prior, right, _ = prior_information(problem, state)
    for k, (chain, robot, odometry) in enumerate(
        zip(problem.chains, state.robots, odometries, strict=True)
    ):
        seen = sighting_rows(problem.view, chain, odometry, state, robot, layout=layout, number=k)
        driven = odometry_rows(chain, odometry, robot, layout=layout, number=k)
        z, o = seen.residual / noise.pixel, driven.residual / (noise.along, noise.across)
        if not np.isfinite(z).all():
            raise UnobservableMotionError(
                "the estimate puts sightings behind the camera",
                rank=0,
                headings_deg=(),
                advice="look for wrong sightings or readings",
            )
        w = robust_weight(np.hypot(z[:, 0], z[:, 1]), problem.knee)
        v = robust_weight(np.hypot(o[:, 0], o[:, 1]), problem.knee)
        normal = of_sightings(seen, w / noise.pixel**2) + of_odometry(
            driven, v[:, None] / np.array([noise.along, noise.across]) ** 2, len(chain)
        )
        for place, (value, sigma, memory) in enumerate(processes(free, noise, robot), start=2):
            process, _ = of_process(
                value,
                chain.link,
                np.diff(chain.t),
                sigma=sigma,
                memory=memory,
                place=place,
                width=free.width,
                size=len(normal.corner_right),
            )
            normal += process
        eliminated.append(eliminate(normal))
        weights.append((w, v))
        sightings.append(z)
        increments.append(o)
    return _Linear(eliminated, prior, right, weights, sightings, increments)
