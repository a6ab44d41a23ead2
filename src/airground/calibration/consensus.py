"""Whether a consensus means anything: against chance, and against motion that leaves g open."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.cubic_form import coefficient_gradient, coefficients
from airground.calibration.headings import advise, distinct_headings_deg
from airground.calibration.motion_table import THRESHOLD
from airground.errors import UnobservableMotionError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.calibration.motion_problem import MotionProblem
    from airground.calibration.ransac import IntArray
    from airground.calibration.samples import MotionSamples
    from airground.geometry.arrays import FloatArray

__all__ = [
    "RANK",
    "different",
    "rank_of_one_heading",
    "require_consensus",
    "require_rank",
    "unobservable",
]

RANK = 6
"""Of eq. 15 in full, where g is determined."""

_EXACT_RANK = 1e-6
"""Singular values below this share of the largest are rounding."""

_GUESS = 0.30
"""Relative deviation of ground velocities beyond which they are guesses."""

_CHANCE = 1e-3
"""Probability below which a consensus is not by chance."""

_ONE_LINE = 0.02
"""Share of the largest singular value below which lines are one, within the noise of real recordings."""

_LEAST = 4
"""Inliers, where there are that many samples: any three have a g."""

_PLACES = 20
"""Samples at whose places velocities are compared."""


def require_consensus(
    samples: MotionSamples, problem: MotionProblem, inliers: NDArray[np.bool_], tried: int
) -> None:
    """Raise where as many samples would follow some hypothesis if image and ground had nothing to do with each other.

    Parameters
    ----------
    samples : MotionSamples
        Motion correspondences.
    problem : MotionProblem
        The same, normalised.
    inliers : (N,) array of bool
        Those that follow the model.
    tried : int
        Hypotheses among which it is the best.

    Raises
    ------
    UnobservableMotionError
        If there are too few inliers.
    """
    moving = inliers[problem.moving]
    count, following = len(moving), int(np.count_nonzero(moving))
    if following == count:
        return
    if following >= _LEAST:
        # Each inlier but three is one by chance; the tail of the binomial distribution by Chernoff's bound.
        share = (following - 3) / (count - 3)
        # The area that is accepted, over the area in which image velocities lie.
        chance = THRESHOLD / max(2 * problem.image_speed_over_noise**2, THRESHOLD)
        if share > chance:
            divergence = share * math.log(share / chance)
            divergence += (1 - share) * math.log((1 - share) / (1 - chance)) if share < 1 else 0.0
            if math.log(tried) - (count - 3) * divergence < math.log(_CHANCE):
                return
    headings = distinct_headings_deg(samples.xy_dot)
    raise UnobservableMotionError(
        f"the image velocities do not follow the ground velocities: {following} of {count} samples agree at best, "
        "which may be chance",
        rank=0,
        headings_deg=headings,
        advice="check that tracks and motion belong together, the clock, and sigma_pxps",
    )


def require_rank(
    samples: MotionSamples,
    problem: MotionProblem,
    model: FloatArray,
    information: FloatArray,
    inliers: NDArray[np.bool_],
) -> float:
    """Raise where the inliers leave g open, exactly or within their noise.

    Parameters
    ----------
    samples : MotionSamples
        Motion correspondences.
    problem : MotionProblem
        The same, normalised.
    model : (6,) array
        The fit.
    information : (6, 6) array
        Its inverse covariance, from both components of eq. 15.
    inliers : (N,) array of bool
        Those that follow it.

    Returns
    -------
    relative_sigma : float
        Relative standard deviation of a ground velocity, over the inliers' places and all headings.

    Raises
    ------
    UnobservableMotionError
        With the rank of eq. 15 in full, and what to drive next.
    """
    values, axes = np.linalg.eigh(information)
    places = _monomials(problem, np.flatnonzero(inliers))
    # Relative change of ground velocities of length one, for fixed image velocities: solve J dw = -(dJ/dg) w.
    # Along each axis, and along g itself: by Euler's theorem that is three times the Jacobian.
    along = np.concatenate([model[None] / 3, axes.T]) @ coefficient_gradient(model[None])[0]
    change = along.reshape(7, 2, 6, 2).transpose(0, 1, 3, 2) @ places
    each = _squares_of_solutions(change[0], change[1:]) / (2 * places.shape[1])
    exact = values > _EXACT_RANK**2 * values[-1]
    variance = np.where(exact, each / np.where(exact, values, 1.0), np.inf)
    total = float(np.sqrt(variance.sum()))
    if total <= _GUESS:
        return total
    rank = min(int(np.count_nonzero(variance <= _GUESS**2)), RANK - 1)
    what = "would be guesses" if not total < 10 else f"would be uncertain by {total:.0%}"
    raise unobservable(samples, inliers, rank, f"ground velocities {what}")


def rank_of_one_heading(problem: MotionProblem) -> int:
    """Rank of eq. 15 in full where all motion is on one heading.

    Parameters
    ----------
    problem : MotionProblem
        Motion correspondences, normalised.

    Returns
    -------
    rank : int
        Parallel lines give the vanishing point, two constraints, one line only that it is on it; speeds give two more.
    """
    u, v, u_dot, v_dot = problem.columns[:4, problem.moving]
    if not (np.any(u_dot) or np.any(v_dot)):
        return 0
    lines = np.stack([-v_dot, u_dot, u * v_dot - v * u_dot])  # eq. 18
    values = np.linalg.eigvalsh(lines @ lines.T)
    rank = 2 + min(2, int(np.count_nonzero(values > _ONE_LINE**2 * values[-1])))
    return min(rank, 2 * len(u))


def unobservable(
    samples: MotionSamples, inliers: NDArray[np.bool_] | None, rank: int, what: str
) -> UnobservableMotionError:
    """Give the error for motion that leaves g open.

    Parameters
    ----------
    samples : MotionSamples
        Motion correspondences.
    inliers : (N,) array of bool or None
        Those that count; None for all.
    rank : int
        Independent constraints.
    what : str
        What it comes to.

    Returns
    -------
    error : UnobservableMotionError
        To be raised.
    """
    headings = distinct_headings_deg(samples.xy_dot if inliers is None else samples.xy_dot[inliers])
    seen = ", ".join(f"{h:.0f}" for h in headings) or "none"
    return UnobservableMotionError(
        f"the motion gives {rank} of the {RANK} constraints of eq. 15: {what} "
        f"(headings seen, modulo 180 degrees: {seen})",
        rank=rank,
        headings_deg=headings,
        advice=advise(headings),
    )


def different(
    problem: MotionProblem, models: FloatArray, than: FloatArray, by: float
) -> NDArray[np.bool_]:
    """Tell which models give clearly different velocities where robots moved.

    Parameters
    ----------
    problem : MotionProblem
        Says where that was.
    models : (H, 6) array
        Models to ask about.
    than : (6,) array
        The model to compare with.
    by : float
        Least root mean square difference over places and headings, relative to the velocities.

    Returns
    -------
    different : (H,) array of bool
        False for NaN.
    """
    places = _monomials(problem, problem.moving)
    J = _jacobians(np.concatenate([than[None], models]), places)
    size = np.square(J[0]).sum(axis=(0, 1))
    away = np.square(J[1:] - J[0]).sum(axis=(1, 2)) / size
    return np.asarray(away.mean(axis=1) > by * by)


def _squares_of_solutions(J: FloatArray, D: FloatArray) -> FloatArray:
    """Squares of the entries of ``inv(J) @ D``, summed, for J (2, 2, n) and D (H, 2, 2, n)."""
    (a, b), (c, d) = J
    first, second = d * D[:, 0] - b * D[:, 1], a * D[:, 1] - c * D[:, 0]
    squares = first * first + second * second
    squares /= np.square(a * d - b * c)
    return np.asarray(squares.sum(axis=(1, 2)))


def _monomials(problem: MotionProblem, rows: IntArray) -> FloatArray:
    """(6, n): 1, u, v, u^2, u v, v^2 at the places of some of the samples."""
    uv = problem.columns[:2].take(rows[:: 1 + len(rows) // _PLACES], axis=1)
    monomials = np.ones((6, uv.shape[1]))
    monomials[1:3] = uv
    np.multiply(uv[0], uv, out=monomials[3:5])
    np.multiply(uv[1], uv[1], out=monomials[5])
    return monomials


def _jacobians(models: FloatArray, places: FloatArray) -> FloatArray:
    """(H, 2, 2, n): derivatives of image by ground (eq. 15)."""
    K = coefficients(models).reshape(-1, 2, 6, 2).transpose(0, 1, 3, 2)
    return np.asarray(K @ places)
