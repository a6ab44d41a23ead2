"""The offset between the clock of the tracks and the clock of the readings.

A wrong offset is an error of velocity that flips with the heading, so the image motion that eq. 15
leaves unexplained is smallest at the right one. It shows only where the robot turns or changes its speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.alignment import fit_linear, unexplained
from airground.errors import UnobservableMotionError

if TYPE_CHECKING:
    from airground.calibration.correspondences import Correspondences, Pairing

__all__ = ["ASSUMED_SIGMA", "REACH", "ClockFit", "find_offset", "parabola_minimum"]

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
            fit = fit_linear(c)
            return unexplained(fit.g, fit.samples)
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
