"""The offset between the clock of the tracks and the clock of the readings.

A wrong offset is an error of velocity that flips with the heading, so the image motion that eq. 15
leaves unexplained is smallest at the right one. It shows only where the robot turns or changes its speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.linear import denormalized, linear_system, null_vector, scale_by_speed
from airground.errors import UnobservableMotionError
from airground.geometry.velocity import image_velocity

if TYPE_CHECKING:
    from airground.calibration.correspondences import Correspondences, Pairing
    from airground.calibration.samples import MotionSamples
    from airground.geometry.arrays import FloatArray

__all__ = [
    "ASSUMED_SIGMA",
    "ClockFit",
    "find_offset",
    "fit_samples",
    "parabola_minimum",
    "unexplained",
]

REACH = 1.0  # s; how far apart two clocks are looked for
STEP = 0.05  # s; shorter than any change of a ground vehicle's velocity
MAX_SAMPLES = 5_000  # for the search; the estimate itself uses all
ASSUMED_SIGMA = 0.05  # s; of an offset of zero that the data could neither confirm nor refute


@dataclass(frozen=True, slots=True)
class ClockFit:
    """Result of a search for the clock offset."""

    offset: float
    """[s] to be added to times of the tracks; 0 where it was not found."""

    found: bool
    """Whether the data have a clear best offset inside the reach of the search."""


def fit_samples(samples: MotionSamples) -> FloatArray:
    """Eqs. 16 and 17 without a rank test.

    Parameters
    ----------
    samples : MotionSamples
        Motion correspondences.

    Returns
    -------
    g : (3, 2) array
        Some g, also where the motion does not determine it.
    """
    A, T = linear_system(samples)
    g_hat, _ = null_vector(A)
    return scale_by_speed(denormalized(g_hat, T), samples)


def unexplained(g: FloatArray, samples: MotionSamples) -> float:
    """Share of the image motion that eq. 15 leaves unexplained.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography.
    samples : MotionSamples
        Motion correspondences.

    Returns
    -------
    share : float
        Root mean square of the residual over that of the image velocity: 0 is perfect, 1 is nothing explained.
    """
    residual = samples.uv_dot - image_velocity(g, samples.uv, samples.xy_dot)
    power = float(np.sum(samples.uv_dot**2))
    return float(np.sqrt(np.sum(residual**2) / power)) if power > 0 else 1.0


def find_offset(pairing: Pairing) -> ClockFit:
    """Search the clock offset at which eq. 15 explains the image motion best.

    Parameters
    ----------
    pairing : Pairing
        Sightings and readings.

    Returns
    -------
    fit : ClockFit
        Offset zero, not found, where the best one lies at the end of the search or too few samples overlap.
    """
    none = ClockFit(0.0, found=False)
    pairing = pairing.thinned(MAX_SAMPLES)
    usual = len(pairing.at_offset(0.0).samples)

    def cost(offset: float) -> float:
        c: Correspondences = pairing.at_offset(offset)
        count = len(c.samples)
        if count < max(6, usual // 2):
            return np.inf
        try:
            return unexplained(fit_samples(c.samples), c.samples)
        except UnobservableMotionError:
            return np.inf

    grid = STEP * np.arange(-round(REACH / STEP), round(REACH / STEP) + 1)
    costs = np.array([cost(float(offset)) for offset in grid])
    best = int(np.argmin(costs))
    if best in {0, len(grid) - 1} or not np.isfinite(costs[best - 1 : best + 2]).all():
        return none
    width, centre = STEP, float(grid[best])
    while width > 1e-3:
        near = [cost(centre - width), cost(centre), cost(centre + width)]
        centre += width * parabola_minimum(near)
        width /= 4
    return ClockFit(float(centre), found=True)


def parabola_minimum(values: list[float], *, limit: float = 1.0) -> float:
    """Where a parabola through three values at -1, 0 and 1 is smallest.

    Parameters
    ----------
    values : list of float
        Three values.
    limit : float
        How far out to go.

    Returns
    -------
    place : float
        Kept to -limit..limit; 0 where the values do not curve upwards.
    """
    left, middle, right = values
    bend = left - 2 * middle + right
    if not (np.isfinite(bend) and bend > 0):
        return 0.0
    return float(np.clip((left - right) / (2 * bend), -limit, limit))
