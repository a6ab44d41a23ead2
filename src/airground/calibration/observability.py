"""Whether the motion determined g, by what its uncertainty does to ground velocities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from airground.calibration.headings import advise, distinct_headings_deg
from airground.calibration.linear import RANK
from airground.errors import UnobservableMotionError
from airground.geometry.velocity import ground_velocity, image_velocity_gradient

if TYPE_CHECKING:
    from airground.calibration.samples import MotionSamples
    from airground.geometry.arrays import FloatArray

__all__ = ["Observability", "ground_velocity_covariance", "judge", "relative_sigma", "verdict"]

OK_SIGMA = (
    0.10  # relative deviation of ground velocities up to which a calibration is good to drive on
)
WEAK_SIGMA = 0.30  # beyond it a velocity is a guess
MAX_UNEXPLAINED = 0.7  # share of the image motion that the readings may leave unexplained
RANK_FLOOR = (
    0.02  # singular values below this share of the largest drown in the noise of real recordings
)


@dataclass(frozen=True, slots=True)
class Observability:
    """Verdict on what the motion determined."""

    verdict: Literal["ok", "weak"]
    """Whether to drive on it as it is."""

    relative_sigma: float
    """Relative standard deviation of a ground velocity, over the driven region and all headings."""

    singular_values: tuple[float, ...]
    """Of eq. 16's system in normalised pixels, over the largest; the last is the fit's own noise."""

    advice: str
    """What to drive next."""


def ground_velocity_covariance(
    g: FloatArray, covariance: FloatArray, uv: FloatArray, xy_dot: FloatArray
) -> FloatArray:
    """Covariance of ground velocities from that of g, to first order.

    Differentiating ``uv_dot = J(g) xy_dot`` at fixed uv_dot: ``J d xy_dot = -(d uv_dot / d g) dg``.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography.
    covariance : (6, 6) array
        Of g, row by row.
    uv : (..., 2) array [px]
        Image points.
    xy_dot : (..., 2) array [m/s]
        Ground velocities there.

    Returns
    -------
    covariance : (..., 2, 2) array [m2/s2]
        NaN on the horizon.
    """
    D = image_velocity_gradient(g, uv, xy_dot)  # (..., 2, 6)
    each = ground_velocity(g, uv[..., None, :], D.swapaxes(-1, -2))  # (..., 6, 2)
    return np.asarray(each.swapaxes(-1, -2) @ covariance @ each)


def relative_sigma(g: FloatArray, covariance: FloatArray, uv: FloatArray) -> float:
    """Relative standard deviation of a ground velocity, over points and all headings.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography.
    covariance : (6, 6) array
        Of g, row by row.
    uv : (N, 2) array [px]
        Where to ask.

    Returns
    -------
    sigma : float
        Root mean square.
    """
    # Two headings at right angles give the mean over all, as the error is linear in the velocity.
    unit = np.eye(2)[:, None, :]
    each = ground_velocity_covariance(
        g, covariance, uv[None], np.broadcast_to(unit, (2, len(uv), 2))
    )
    return float(np.sqrt(np.mean(np.trace(each, axis1=-2, axis2=-1))))


def verdict(
    sigma: float,
    singular: FloatArray,
    headings: tuple[float, ...],
    advice: str,
    *,
    rank: int,
    doubtful: bool = False,
) -> Observability:
    """Say whether an estimate is good to drive on, from its uncertainty.

    Parameters
    ----------
    sigma : float
        Relative standard deviation of a ground velocity.
    singular : (6,) array
        Singular values, descending.
    headings : tuple of float [deg]
        Distinct headings seen.
    advice : str
        What to drive next.
    rank : int
        How many constraints are needed.
    doubtful : bool
        Whether another solution fits alike.

    Returns
    -------
    observability : Observability
        Verdict ok or weak.

    Raises
    ------
    UnobservableMotionError
        If a velocity computed from the estimate would be a guess.
    """
    relative = tuple(map(float, singular / singular[0]))
    if sigma <= OK_SIGMA and not doubtful:
        return Observability("ok", sigma, relative, "nothing more is needed")
    if sigma <= WEAK_SIGMA:
        return Observability("weak", sigma, relative, advice)
    seen = ", ".join(f"{h:.0f}" for h in headings) or "none"
    found = min(rank - 1, int(np.sum(np.array(relative) > RANK_FLOOR)))
    much = f"{min(sigma, 9.99):.0%}{' and more' if not sigma <= 9.99 else ''}"
    raise UnobservableMotionError(
        f"the motion does not determine g: ground velocities would be uncertain by {much} "
        f"({found} of {rank} constraints stand out of the noise; headings seen, modulo 180 degrees: {seen})",
        rank=found,
        headings_deg=headings,
        advice=advice,
    )


def judge(
    g: FloatArray,
    covariance: FloatArray,
    samples: MotionSamples,
    singular: FloatArray,
    unexplained: float,
) -> Observability:
    """Say whether the motion determined g.

    Parameters
    ----------
    g : (3, 2) array
        The estimate.
    covariance : (6, 6) array
        Its covariance.
    samples : MotionSamples
        What it was estimated from.
    singular : (6,) array
        Singular values of eq. 16's system.
    unexplained : float
        Share of the image motion that the estimate leaves unexplained.

    Returns
    -------
    observability : Observability
        Verdict ok or weak.

    Raises
    ------
    UnobservableMotionError
        If a velocity computed from g would be a guess.
    """
    headings = distinct_headings_deg(samples.xy_dot)
    relative = singular / singular[0]
    some = samples.uv[:: 1 + len(samples) // 500]
    sigma = relative_sigma(g, covariance, some)
    explained = unexplained <= MAX_UNEXPLAINED
    advice = advise(headings)
    if explained:
        return verdict(sigma, singular, headings, advice, rank=RANK)
    advice += "; and look for wrong sightings, or for readings of another robot or clock"
    rank = min(RANK - 1, int(np.sum(relative > RANK_FLOOR)))
    seen = ", ".join(f"{h:.0f}" for h in headings) or "none"
    what = f"the readings explain only {max(0.0, 1 - unexplained**2):.0%} of the image motion"
    raise UnobservableMotionError(
        f"the motion does not determine g: {what} ({rank} of {RANK} constraints stand out of the noise; "
        f"headings seen, modulo 180 degrees: {seen})",
        rank=rank,
        headings_deg=headings,
        advice=advice,
    )
