"""A part of a long drive that tells the noise levels and the nuisances as well as all of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.trajectory.chain import Chain

__all__ = ["thinned"]

FEW = 1500  # sightings that noise levels and nuisances are found on
READINGS = 2  # in an increment of the thinned drive
LEAST_KEPT = 100  # sightings of a robot
LONGEST_S = 0.2  # between neighbours of the thinned drive
STRETCHES = 6  # of a long drive, evenly over it


def thinned(drive: list[Chain]) -> list[Chain]:
    """Take some sightings, evenly over all robots, or in stretches where they would come too far apart.

    Parameters
    ----------
    drive : list of Chain
        All sightings.

    Returns
    -------
    few : list of Chain
        About `FEW` of them.
    """
    every = max(1, -(-sum(len(c) for c in drive) // FEW))
    return [_stretches(c, every) for c in drive]


def _stretches(chain: Chain, every: int) -> Chain:
    between = max(float(np.median(np.diff(chain.t))), 1e-9)
    reading = float(np.median(np.diff(chain.path.t)))
    # Increments of several readings each: shorter ones share noise. Short drives keep their sightings.
    several = min(round(READINGS * reading / between), len(chain) // LEAST_KEPT)
    stride = max(several, min(every, int(LONGEST_S / between)), 1)
    if max(every, stride) == 1:
        return chain
    rows = np.arange(0, len(chain), stride)
    skip = -(-every // stride)
    if skip > 1:
        # Whole stretches of neighbours: the noise of sightings and that of the way between need both.
        parts = np.array_split(rows, max(1, STRETCHES * skip))
        rows = np.concatenate(parts[::skip])
    return chain.take(rows)
