"""Who stands still, when nothing is known yet: judged over all of the first frames, not over one.

From one frame to the next, traffic may look as fixed as the ground: cars of one lane move alike, and two lanes that
move against each other are sheared, which a homography can follow. Over many frames they come apart and parked cars do
not. So each frame proposes who stands since the first one, and each proposal is tried on all frames so far.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray
from airground.vision.moving.fit_types import LEAST, HomographyFit, NoiseScale, closeness
from airground.vision.moving.homography import fit_homography
from airground.vision.moving.point_map import IntArray, PointMap

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["FirstLook"]

SIZES = (2.0, 0.5)  # deviations over the stated ones, at which each frame is searched
NEARLY_ALL = 0.9  # share that agrees where there is nothing to choose
EVERY = 3  # frames between searches
MOST_TRIALS = 6  # frames that a proposal is tried on


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    """Points of one frame that are in the map."""

    at: IntArray
    """(M,). Rows of the map."""

    uv: FloatArray
    """(M, 2) [px]. Positions."""

    R: FloatArray
    """(M, 2, 2) [px2]. Their covariances."""


class FirstLook:
    """The first frames.

    Parameters
    ----------
    frames : int
        How many of them.
    """

    def __init__(self, frames: int) -> None:
        self._left = frames
        self._sights: list[_Sight] = []
        self._best: IntArray = np.empty(0, dtype=np.intp)
        self._last: tuple[FloatArray, ...] = ()

    @property
    def over(self) -> bool:
        """Whether all have been seen."""
        return self._left <= 0

    @property
    def standing(self) -> IntArray:
        """(M,) rows of the map that are thought to stand."""
        return self._best

    def fit(self, places: PointMap, at: IntArray, uv: FloatArray, R: FloatArray) -> HomographyFit:
        """Take the next frame.

        Parameters
        ----------
        places : PointMap
            The map; rows must not go away during the first look.
        at : (M,) array of int
            Its rows that the frame shows.
        uv : (M, 2) array [px]
            Where.
        R : (M, 2, 2) array [px2]
            Covariances of that.

        Returns
        -------
        fit : HomographyFit
            Of those that stand, by what is known now.
        """
        sight = _Sight(at, uv, R)
        self._sights.append(sight)
        self._left -= 1
        everything = np.arange(len(at))
        plain = _fit(places, sight, everything, 1.0, self._last)
        proposals = [self._best] if len(self._best) else []
        if plain.matrix is not None:
            proposals.append(at[plain.inliers])
        turn = self._left % EVERY == 0 or not proposals
        if turn and plain.inliers.sum() < NEARLY_ALL * len(at):
            for size in SIZES:
                found = _fit(places, sight, everything, size)
                if found.matrix is not None:
                    proposals.append(at[found.inliers])
        if not proposals:
            return plain
        if plain.matrix is not None and plain.inliers.sum() >= NEARLY_ALL * len(at):
            self._best = at[plain.inliers]
        elif turn or self.over or not len(self._best):
            self._best = max(proposals, key=lambda rows: self._score(places, rows))
        fit = _fit(places, sight, np.flatnonzero(np.isin(at, self._best)), 1.0, self._last)
        self._last = () if fit.matrix is None else (fit.matrix,)
        return fit

    def _score(self, places: PointMap, rows: IntArray) -> float:
        """How many of the proposed follow one homography in each frame, and how closely."""
        count = len(self._sights)
        total = 0.0
        for k in np.unique(np.linspace(0, count - 1, min(count, MOST_TRIALS)).astype(np.intp)):
            sight = self._sights[k]
            mine = np.flatnonzero(np.isin(sight.at, rows))
            total += closeness(_straight_fit(places, sight, mine).d2)
        return total


def _fit(
    places: PointMap,
    sight: _Sight,
    rows: IntArray,
    size: float,
    starts: Sequence[FloatArray] = (),
    *,
    search: bool = True,
) -> HomographyFit:
    at = sight.at[rows]
    return fit_homography(
        sight.uv[rows],
        places.x[at],
        source_covariance=size**2 * sight.R[rows],
        target_covariance=size**2 * places.blocks(at),
        prior=NoiseScale(1.0, np.inf if size != 1.0 else 8.0),
        starts=starts,
        parallax=False,
        least=LEAST,
        search=search,
    )


def _straight_fit(places: PointMap, sight: _Sight, rows: IntArray) -> HomographyFit:
    """From all of the rows at once, as they were proposed together."""
    if len(rows) < LEAST:
        return HomographyFit.failed("too few points", len(rows))
    answer: Any = cv2.findHomography(sight.uv[rows], places.x[sight.at[rows]], 0)
    starts = () if answer[0] is None else (np.asarray(answer[0], dtype=np.float64),)
    return _fit(places, sight, rows, 1.0, starts, search=False)
