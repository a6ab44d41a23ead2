"""g from motion correspondences of which many may be wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.calibration.consensus import (
    different,
    rank_of_one_heading,
    require_consensus,
    require_rank,
    unobservable,
)
from airground.calibration.motion_problem import MotionProblem
from airground.calibration.motion_table import THRESHOLD
from airground.calibration.ransac import Options, ransac
from airground.errors import InputError, SampleError
from airground.geometry.arrays import numbers
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.calibration.ransac import Consensus
    from airground.calibration.samples import MotionSamples
    from airground.geometry.arrays import FloatArray

__all__ = ["RobustFit", "estimate_robust", "robust_fit"]

MIN_SAMPLES = 3
"""Six equations (eq. 15, both components) for the six entries of g."""

_APART = 0.02
"""Relative difference of the velocities that two solutions give, above which they are two."""

_SAME = 2e-3
"""Relative difference of g, in units of order one, below which the velocities are the same."""

_ALIKE = 9.0
"""Excess of the sum of squared residuals, in sigma, within which two fits are alike: 3 standard deviations."""

_SEVERAL = 50
"""Samples below which a second solution is likely enough to be searched for at length."""

_ALIKE_ON_SOME = 4.0
"""How much more it may be on the samples of the search, which are fewer."""


@dataclass(frozen=True, slots=True, eq=False)
class RobustFit:
    """A robust fit, and what else the samples allow."""

    model: LimitedHomography
    """The estimate: least squares over the inliers."""

    inliers: NDArray[np.bool_]
    """(N,). Samples that follow the model: 99 % of those whose noise is as stated do."""

    cost: float
    """Mean of the squared residuals, in sigma, cut off at `THRESHOLD`; about 2 where all samples are inliers."""

    alternative: LimitedHomography | None
    """Another solution, clearly different, that fits about as well; None where there is none. A few more samples,
    elsewhere and on other headings, tell the two apart."""

    alternative_cost: float
    """Its cost; infinite where there is none."""

    hypotheses: int
    """Solutions of minimal sets that were tried."""

    relative_sigma: float
    """Relative standard deviation of a ground velocity, over the inliers' places and all headings."""


def estimate_robust(
    samples: MotionSamples,
    *,
    sigma_pxps: ArrayLike,
    rng: np.random.Generator,
) -> tuple[LimitedHomography, NDArray[np.bool_]]:
    """Estimate g where many samples may be wrong: sightings of something else, swapped identities (eqs. 15 and 16).

    Minimal sets of three or four samples give hypotheses, both components of eq. 15 judge them, and the best is
    fitted to its inliers. Two headings are enough: rectangles and lawn-mowers, on which the linear method fails.
    Where a second, different solution fits as well, this gives the better one and is silent; `robust_fit` names both.

    Parameters
    ----------
    samples : MotionSamples
        Three or more; up to about half of them may be wrong.
    sigma_pxps : float or (N,) array_like [px/s]
        Standard deviation of each component of the image velocities, for good samples.
    rng : numpy.random.Generator
        Random numbers; the same generator state gives the same answer.

    Returns
    -------
    model : LimitedHomography
        The estimate, scaled as in eq. 21.
    inliers : (N,) array of bool
        Samples that follow it.

    Raises
    ------
    SampleError
        If there are fewer than three samples.
    InputError
        If `sigma_pxps` is not positive and finite, or of a wrong shape.
    UnobservableMotionError
        If the inliers leave more than one g possible, or there is no consensus beyond chance.
    """
    fit = robust_fit(samples, sigma_pxps=sigma_pxps, rng=rng)
    return fit.model, fit.inliers


def robust_fit(
    samples: MotionSamples,
    *,
    sigma_pxps: ArrayLike,
    rng: np.random.Generator,
    options: Options | None = None,
) -> RobustFit:
    """Estimate g as `estimate_robust` does, and say what else there is to know.

    Parameters
    ----------
    samples : MotionSamples
        Three or more; up to about half of them may be wrong.
    sigma_pxps : float or (N,) array_like [px/s]
        Standard deviation of each component of the image velocities, for good samples.
    rng : numpy.random.Generator
        Random numbers; the same generator state gives the same answer.
    options : Options, optional
        How hard to search.

    Returns
    -------
    fit : RobustFit
        The model, its inliers, and an alternative if there is one.

    Raises
    ------
    SampleError
        If there are fewer than three samples.
    InputError
        If `sigma_pxps` is not positive and finite, or of a wrong shape.
    UnobservableMotionError
        If the inliers leave more than one g possible, or there is no consensus beyond chance.
    """
    sigma = _checked(samples, sigma_pxps)
    with np.errstate(all="ignore"):  # degenerate minimal sets give NaN, and NaN is never an inlier
        problem = MotionProblem(samples, sigma)
        found = ransac(problem, rng, options or _options(len(samples)))
        if not len(found.models):
            rank = rank_of_one_heading(problem)
            raise unobservable(samples, None, rank, "no three samples move on two headings")
        table = problem.on(None)
        best = _Fit(*table.finish(found.models[0]))
        second = None
        for start in _others(problem, best.model, found):
            other = _Fit(*table.finish(start))
            if not different(problem, other.model[None], best.model, _APART)[0]:
                continue
            if _relation(problem, other) is None:  # no camera sees so
                continue
            if _excess(other, best) < 0:
                best, other = other, best
            if _excess(other, best) < _ALIKE and (second is None or _excess(other, second) < 0):
                second = other
        inliers = best.squares <= THRESHOLD
        require_consensus(samples, problem, inliers, found.tried)
        relative_sigma = require_rank(samples, problem, best.model, best.information, inliers)
        model = _relation(problem, best)
        if model is None:
            rank = rank_of_one_heading(problem)
            raise unobservable(samples, None, rank, "all that fits has parallel columns of g")
    return RobustFit(
        model=model,
        inliers=inliers,
        cost=_cost(best),
        alternative=None if second is None else _relation(problem, second),
        alternative_cost=math.inf if second is None else _cost(second),
        hypotheses=found.tried,
        relative_sigma=relative_sigma,
    )


def _options(count: int) -> Options:
    """Few samples may have several solutions: more of the hypotheses are fitted then."""
    return Options() if count >= _SEVERAL else Options(keep=64, polish=16)


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """What `MotionTable.finish` gives."""

    model: FloatArray
    """(6,). In the problem's own units."""

    squares: FloatArray
    """(N,). Squared residuals, in sigma."""

    information: FloatArray
    """(6, 6). Inverse covariance of the model."""


def _relation(problem: MotionProblem, fit: _Fit) -> LimitedHomography | None:
    """What was fitted, as a relation between image and ground; None where it is none, as its columns are parallel."""
    try:
        return LimitedHomography(problem.g(fit.model))
    except InputError:
        return None


def _others(problem: MotionProblem, best: FloatArray, found: Consensus) -> list[FloatArray]:
    """Polished hypotheses that differ from the best and from each other, and fit nearly as well."""
    slack = found.costs[0] + _ALIKE_ON_SOME * _ALIKE / (found.judges * THRESHOLD)
    models = found.models[found.costs <= slack]
    kept: list[FloatArray] = []
    if np.abs(models - best).max() < _SAME * np.abs(best).max():
        return kept
    while len(models := models[different(problem, models, best, _APART)]):
        best, models = models[0], models[1:]
        kept.append(best)
    return kept


def _excess(fit: _Fit, over: _Fit) -> float:
    """Twice the logarithm of the likelihood ratio, wrong samples counting alike."""
    return float(np.sum(np.fmin(fit.squares, THRESHOLD) - np.fmin(over.squares, THRESHOLD)))


def _cost(fit: _Fit) -> float:
    return float(np.fmin(fit.squares, THRESHOLD).sum()) / len(fit.squares)


def _checked(samples: MotionSamples, sigma_pxps: ArrayLike) -> FloatArray:
    count = len(samples)
    if count < MIN_SAMPLES:
        raise SampleError(
            f"{count} samples do not determine g; give {MIN_SAMPLES} or more, on two or more headings"
        )
    sigma = numbers(sigma_pxps, "sigma_pxps")
    if sigma.shape not in ((), (count,)):
        raise InputError(f"sigma_pxps must be a number or have shape ({count},), not {sigma.shape}")
    if not 0 < sigma.min() <= sigma.max() < math.inf:
        raise InputError("sigma_pxps must be positive and finite: it is the noise of the samples")
    return sigma
