"""What a whole-drive estimate is made from, and what it minimises."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.trajectory.rows import residuals
from airground.calibration.trajectory.state import Free, Layout, Noise, Priors, Robot, State
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    from airground.calibration.trajectory.chain import Chain, Odometry
    from airground.calibration.trajectory.view import View

__all__ = ["KNEE", "Problem", "cost", "prior_information", "processes", "robust_weight"]

KNEE = 3.0  # deviations (of two coordinates) up to which a residual has its full weight


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """All that a whole-drive estimate is made from."""

    view: View
    """Normalisation of the image."""

    chains: tuple[Chain, ...]
    """Sightings and readings."""

    noise: Noise
    """Noise levels."""

    priors: Priors
    """What is known beforehand."""

    free: Free
    """What is estimated."""

    offset: float
    """Clock offset about which its prior lies [s]."""

    knee: float = KNEE
    """Where residuals lose weight; infinite for plain least squares."""

    @property
    def layout(self) -> Layout:
        """Places of the global unknowns."""
        return Layout(self.free, len(self.chains))


def robust_weight(norm: FloatArray, knee: float) -> FloatArray:
    """Weight of a residual of two coordinates: full up to the knee, then falling with the square.

    Parameters
    ----------
    norm : (N,) array
        Length of the residual, in deviations.
    knee : float
        Where it starts to fall.

    Returns
    -------
    weight : (N,) array
        Its influence falls beyond the knee, so that gross errors have next to none.
    """
    return np.minimum(1.0, (knee / np.maximum(norm, 1e-12)) ** 2)


def _robust_cost(norm: FloatArray, knee: float) -> float:
    """Sum of the loss whose weight `robust_weight` is."""
    squared = norm**2
    if not np.isfinite(squared).all():
        return np.inf
    over = squared > knee**2
    far = knee**2 * (1 + np.log(np.maximum(squared, 1e-300) / knee**2)) if np.isfinite(knee) else 0
    return float(np.sum(np.where(over, far, squared)))


def cost(problem: Problem, state: State, odometries: Sequence[Odometry] | None = None) -> float:
    """Robust cost of a state.

    Parameters
    ----------
    problem : Problem
        Data and noise.
    state : State
        Where.
    odometries : sequence of Odometry, optional
        The chains' readings at the state's offset, where they are at hand.

    Returns
    -------
    cost : float
        Infinite where the camera could not have made the sightings.
    """
    total = prior_information(problem, state)[2]
    noise = problem.noise
    if odometries is None:
        odometries = [chain.odometry(state.offset) for chain in problem.chains]
    for chain, robot, odometry in zip(problem.chains, state.robots, odometries, strict=True):
        r = residuals(problem.view, chain, odometry, state, robot)
        total += _robust_cost(np.linalg.norm(r.sighting, axis=1) / noise.pixel, problem.knee)
        o = r.odometry / (noise.along, noise.across)
        total += _robust_cost(np.linalg.norm(o, axis=1), problem.knee)
        for value, sigma, memory in processes(problem.free, noise, robot):
            keep = np.where(chain.link, np.exp(-np.diff(chain.t) / memory), 0.0)
            step = value[1:] - keep * value[:-1]
            total += (
                float(value[0] ** 2 + np.sum(step**2 / np.maximum(1 - keep**2, 1e-12))) / sigma**2
            )
        if not np.isfinite(total):
            return np.inf
    return total


def processes(free: Free, noise: Noise, robot: Robot) -> list[tuple[FloatArray, float, float]]:
    """Unknowns that wander, in the order of the local ones.

    Parameters
    ----------
    free : Free
        What is estimated.
    noise : Noise
        How much they wander.
    robot : Robot
        Their values.

    Returns
    -------
    processes : list of (array, float, float)
        Values, deviation and memory [s] of each.
    """
    found = []
    if free.drift:
        found.append((robot.drift, noise.drift, noise.drift_s))
    if free.slip:
        found.append((robot.slip, noise.slip, noise.slip_s))
    return found


def prior_information(problem: Problem, state: State) -> tuple[FloatArray, FloatArray, float]:
    """What is known beforehand about the global unknowns.

    Parameters
    ----------
    problem : Problem
        With its priors.
    state : State
        Where.

    Returns
    -------
    diagonal : (B,) array
        Information; it has no other entries.
    right : (B,) array
        Right side.
    cost : float
        Sum of squares.
    """
    layout, priors = problem.layout, problem.priors
    diagonal, right = np.zeros(layout.size), np.zeros(layout.size)

    def add(place: int | None, value: float, sigma: float) -> None:
        if place is not None:
            diagonal[place] = sigma**-2
            right[place] = -value / sigma**2

    add(layout.offset, state.offset - problem.offset, priors.offset_s)
    add(layout.bend, state.bend, priors.bend)
    for k, (chain, robot) in enumerate(zip(problem.chains, state.robots, strict=True)):
        add(layout.own(k), robot.scale, max(priors.scale, 1e-6))
        if (lever := layout.lever(k)) is not None:
            reach = max(priors.lever_s * chain.usual_speed, 1e-9)
            add(lever, robot.lever[0], reach)
            add(lever + 1, robot.lever[1], reach)
    known = diagonal > 0
    return diagonal, right, float(np.sum(right[known] ** 2 / diagonal[known]))
