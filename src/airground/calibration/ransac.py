"""Random sample consensus: hypotheses from few samples, judged by all, the best of them polished.

The loop knows nothing of what is estimated; a `Problem` does. Everything in it goes by batches, as a batch of hundred
hypotheses costs NumPy little more than one: many hypotheses meet few samples, a few of them many samples, and the
best of these are fitted to their inliers (local optimisation) before the share of inliers says whether that was enough.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = [
    "ComplexArray",
    "Consensus",
    "Evidence",
    "IntArray",
    "Options",
    "Problem",
    "Source",
    "ransac",
]

ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]


class Source(Protocol):
    """Draws minimal sets and solves them."""

    @property
    def size(self) -> int:
        """Samples in a minimal set."""
        ...

    def hypotheses(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Solve minimal sets.

        Parameters
        ----------
        count : int
            How many sets to draw; fewer come where there are no more.
        rng : numpy.random.Generator
            Random numbers.

        Returns
        -------
        models : (H, P) array
            Hypotheses; none where all sets are degenerate. NaN is allowed.
        """
        ...


class Evidence(Protocol):
    """Samples that judge hypotheses."""

    def costs(self, models: FloatArray) -> FloatArray:
        """Truncated squares of the residuals, over the threshold: 0 is perfect and 1 without any inlier.

        Parameters
        ----------
        models : (H, P) array
            Hypotheses.

        Returns
        -------
        costs : (H,) array
            Means over the samples; never NaN.
        """
        ...

    def refine(self, models: FloatArray) -> FloatArray:
        """Fit models to their inliers.

        Parameters
        ----------
        models : (H, P) array
            Starts.

        Returns
        -------
        models : (H, P) array
            Fits.
        """
        ...


class Problem(Protocol):
    """What is estimated from N samples."""

    @property
    def sources(self) -> Sequence[Source]:
        """Ways to hypotheses, the quickest first."""
        ...

    def __len__(self) -> int:
        """Give the number of samples."""
        ...

    def on(self, rows: IntArray | None) -> Evidence:
        """Some samples, to judge hypotheses by.

        Parameters
        ----------
        rows : (n,) array of int or None
            Samples; None for all.

        Returns
        -------
        evidence : Evidence
            Those samples.
        """
        ...


@dataclass(frozen=True, slots=True)
class Options:
    """How hard to search."""

    confidence: float = 0.99
    """Wanted probability that one of the sets drawn holds inliers only, and gives a start that is good enough."""

    good_sets: float = 0.5
    """Share of sets of inliers that give such a start, in spite of noise."""

    inlier_cost: float = 0.21
    """Mean cost of an inlier, by its noise alone: for two degrees of freedom, cut off at 99 %."""

    batch: int = 64
    """Minimal sets at a time."""

    max_sets: int = 4000
    """Minimal sets after which to stop in any case."""

    few: int = 56
    """Samples that all hypotheses meet."""

    many: int = 360
    """Samples that the better hypotheses meet."""

    keep: int = 16
    """Hypotheses of a batch that are the better ones. Of the first batch, which mostly is the last, `polish` are."""

    polish: int = 3
    """Hypotheses of a batch that are fitted to their inliers."""

    pool: int = 24
    """Of all these, the ones that are kept."""


@dataclass(frozen=True, slots=True, eq=False)
class Consensus:
    """What the search found."""

    models: FloatArray
    """(C, P). Polished hypotheses, the best first; empty where all minimal sets were degenerate."""

    costs: FloatArray
    """(C,). Their costs on the samples that they met."""

    judges: int
    """Samples that these are the costs on."""

    tried: int
    """Hypotheses."""


def ransac(problem: Problem, rng: np.random.Generator, options: Options) -> Consensus:
    """Search for the models that most samples follow.

    Parameters
    ----------
    problem : Problem
        Samples, solvers, residuals.
    rng : numpy.random.Generator
        Random numbers.
    options : Options
        How hard to search.

    Returns
    -------
    consensus : Consensus
        The best hypotheses.
    """
    few, many = _judges(problem, rng, options)
    pool, costs = np.empty((0, 0)), np.empty(0)
    tried = drawn = 0
    idle = 0  # sources in a row that gave nothing
    for source in itertools.cycle(problem.sources):
        models = source.hypotheses(options.batch, rng)
        drawn += options.batch
        idle = 0 if len(models) else idle + 1
        if found := len(models):
            models = _best(models, few, options.keep if tried else options.polish)
            tried += found
            models = _best(models, many, options.polish)
            models = many.refine(models)
            pool = np.concatenate([pool, models]) if len(pool) else models
            costs = np.concatenate([costs, many.costs(models)])
            order = np.argsort(costs, kind="stable")[: options.pool]
            pool, costs = pool.take(order, axis=0), costs.take(order)
            enough = _needed(float(costs[0]), source.size, options)
        if drawn >= options.max_sets or idle == len(problem.sources) or (tried and drawn >= enough):
            return Consensus(pool, costs, min(len(problem), options.many), tried)
    raise AssertionError("a problem has sources")  # pragma: no cover


def _judges(
    problem: Problem, rng: np.random.Generator, options: Options
) -> tuple[Evidence, Evidence]:
    total = len(problem)
    some = (rng.random(options.many) * total).astype(np.intp)  # rng.integers takes twice as long
    few = some[: options.few] if total > options.few else None
    return problem.on(few), problem.on(some if total > options.many else None)


def _best(models: FloatArray, on: Evidence, count: int) -> FloatArray:
    if len(models) <= count:
        return models
    return models.take(np.argpartition(on.costs(models), count)[:count], axis=0)


def _needed(cost: float, size: int, options: Options) -> float:
    """Sets to draw so that one of inliers only, and good, is among them with the wanted probability."""
    share = min((1 - cost) / (1 - options.inlier_cost), 1.0)
    good = options.good_sets * share**size
    return math.log(1 - options.confidence) / math.log1p(-good) if good > 0 else math.inf
