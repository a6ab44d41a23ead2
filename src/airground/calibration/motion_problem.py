"""Motion correspondences as a problem for `ransac`: in units of order one, with their minimal sets."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.minimal_four import FourSamples
from airground.calibration.minimal_sets import MinimalSets
from airground.calibration.minimal_three import ThreeSamples
from airground.calibration.motion_table import MotionTable, motion_table
from airground.calibration.two_lines import TwoLines

if TYPE_CHECKING:
    from airground.calibration.ransac import IntArray
    from airground.calibration.samples import MotionSamples
    from airground.geometry.arrays import FloatArray

__all__ = ["MotionProblem"]

_SLOW = 0.25
"""Samples slower than this share of the median speed tell too little to be drawn into minimal sets."""

_MANY = 50
"""Samples among which the slow ones can be spared."""

_ROUNDING = 1e-9
"""Least sigma, as a share of the image velocities: what rounding leaves."""

_SEEN = 3.0
"""Deviations of its image velocity above which a sample moves in the image."""

_FARTHEST = 1e6
"""Where wrong sightings are put that are farther away than this many spreads of the image points."""

_TABLE = 2000
"""Samples up to which it is quicker to fill one table for all and to take from it."""

_SOME = 60
"""Samples from which the units are taken."""


class MotionProblem:
    """N motion correspondences in units of order one.

    Parameters
    ----------
    samples : MotionSamples
        One or more.
    sigma : (N,) or () array [px/s]
        Standard deviation of each component of the image velocities.
    """

    def __init__(self, samples: MotionSamples, sigma: FloatArray) -> None:
        columns = np.empty((6, len(samples)))
        columns[:2], columns[2:4], columns[4:] = samples.uv.T, samples.uv_dot.T, samples.xy_dot.T
        square = columns[4] * columns[4]
        square += columns[5] * columns[5]
        # Medians, as half of the samples may be wrong; of moving robots, as many may stand in one place.
        # Standing robots read a speed too, that of their noise: who moves in the image says what a speed is.
        seen = np.flatnonzero(square * (np.abs(columns[2:4]).max(axis=0) > _SEEN * sigma))
        some = _some(seen if len(seen) >= _MANY else np.flatnonzero(square))
        self._ground_speed = math.sqrt(_medians(square[some])) if len(some) else 1.0
        slow = _SLOW * self._ground_speed if len(samples) >= _MANY else 0.0
        self.moving: IntArray = np.flatnonzero(square > slow * slow)
        """(R,). Samples that move; from these minimal sets are drawn."""
        some = _some(self.moving) if len(self.moving) else np.arange(len(samples))
        image = columns[:4].take(some, axis=1)
        self._centre = _medians(image[:2])[:, None]
        image[:2] -= self._centre
        half, fastest = _medians(np.abs(image).reshape(2, 2, -1).max(axis=1)).tolist()
        self._spread, speed_px = 1.5 * half or 1.0, fastest or 1.0
        self._typical_image_speed = (
            fastest / speed_px
        )  # 1, or 0 where most samples stand in the image
        self._image_speed = speed_px / self._spread

        self._table: MotionTable | None = None
        self.columns = columns
        """(6, N). Image points, image velocities and ground velocities."""
        place = columns[:2]
        place -= self._centre
        place /= self._spread
        np.minimum(place, _FARTHEST, out=place)
        np.maximum(place, -_FARTHEST, out=place)
        columns[2:4] /= speed_px
        columns[4:] /= self._ground_speed
        weight = speed_px / np.maximum(sigma, _ROUNDING * speed_px)
        self.weight: FloatArray | float = weight if weight.ndim else float(weight)
        """(N,) or a number. Inverse deviation of the image velocities."""
        four, three, lines = (
            MinimalSets(self.moving, self.columns, solver, paired)
            for solver, paired in (
                (FourSamples(), False),
                (ThreeSamples(), False),
                (TwoLines(), True),
            )
        )
        self.sources = (four, lines, four, three)
        """What gives hypotheses: the quickest most often, then the one for what it cannot do, the slowest last."""

    def __len__(self) -> int:
        return self.columns.shape[1]

    def on(self, rows: IntArray | None) -> MotionTable:
        """Some samples, to judge hypotheses by.

        Parameters
        ----------
        rows : (n,) array of int or None
            Samples; None for all.

        Returns
        -------
        table : MotionTable
            Those samples.
        """
        if rows is None or len(self) <= _TABLE:
            if self._table is None:
                self._table = motion_table(self.columns, self.weight)
            return self._table if rows is None else self._table.take(rows)
        weight = self.weight.take(rows) if isinstance(self.weight, np.ndarray) else self.weight
        return motion_table(self.columns.take(rows, axis=1), weight)

    def g(self, model: FloatArray) -> FloatArray:
        """Give g in pixels and metres.

        Parameters
        ----------
        model : (6,) array
            g in the problem's own units.

        Returns
        -------
        g : (3, 2) array
            Scaled as in eq. 21.
        """
        # Eq. 15 is cubic in g: a factor on velocities is its cube root on g; the image's scale s, G -> T G with
        # det T = s^2, is s^(2/3) more.
        factor = math.cbrt(self._image_speed / self._ground_speed) * self._spread ** (-2 / 3)
        g: FloatArray = model.reshape(3, 2) * factor
        g[:2] *= self._spread
        g[:2] += self._centre * g[2]
        return g

    @property
    def image_speed_over_noise(self) -> float:
        """Median speed in the image of what moves, in sigma; the speed is that of the faster component."""
        some = _some(self.moving)
        if not isinstance(self.weight, np.ndarray) or not len(some):
            return self._typical_image_speed * float(self.weight) if len(some) else 0.0
        return float(_medians(np.abs(self.columns[2:4, some]).max(axis=0) * self.weight[some]))


def _some(rows: IntArray) -> IntArray:
    """About `_SOME` of the rows, evenly over their order."""
    return rows[:: 1 + len(rows) // _SOME]


def _medians(values: FloatArray) -> FloatArray:
    """Over the last axis, the upper one of two; np.median takes ten times as long for few values."""
    return np.asarray(np.sort(values)[..., values.shape[-1] // 2])
