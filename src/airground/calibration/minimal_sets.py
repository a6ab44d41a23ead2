"""Minimal sets: a few samples each, on headings that differ, drawn and solved by the hundred."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.ransac import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["MinimalSets", "Solver"]

_ONE_HEADING = 1e-6
"""Squared sine below which two headings count as one: 0.06 degrees."""

_PARALLEL = 3e-3
"""Squared sine below which a solver for two headings takes two samples for one heading: 3 degrees."""

_OVERSAMPLING = 4
"""Sets drawn for each that is solved: those on the most different headings are."""


class Solver(Protocol):
    """A minimal solver."""

    @property
    def size(self) -> int:
        """Samples in a set."""
        ...

    def solve(self, columns: FloatArray) -> FloatArray:
        """Solve many sets at once.

        Parameters
        ----------
        columns : (6, size, M) array
            Image points (u, v), image velocities and ground velocities, normalised.

        Returns
        -------
        g : (H, 6) array
            Hypotheses.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class MinimalSets:
    """Draws minimal sets for a solver; a `ransac.Source`."""

    rows: IntArray
    """(R,). Samples to draw from."""

    columns: FloatArray
    """(6, N). Image points, image velocities and ground velocities, normalised."""

    solver: Solver
    """What the sets are for."""

    paired: bool
    """Whether the solver wants two headings: the third sample's that of the first, the fourth's that of the second."""

    @property
    def size(self) -> int:
        """Samples in a set."""
        return self.solver.size

    def hypotheses(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Draw and solve sets.

        Parameters
        ----------
        count : int
            Sets wanted.
        rng : numpy.random.Generator
            Random numbers.

        Returns
        -------
        models : (H, 6) array
            Hypotheses; none where the headings of all sets are too much alike.
        """
        sets = self.draw(count, rng)
        if not sets.shape[1]:
            return np.empty((0, 6))
        models = self.solver.solve(self.columns.take(sets, axis=1))
        return models.take(np.flatnonzero(np.isfinite(models[:, 0])), axis=0)

    def draw(self, count: int, rng: np.random.Generator) -> IntArray:
        """Draw sets, those on the most different headings out of some more.

        Parameters
        ----------
        count : int
            Sets wanted.
        rng : numpy.random.Generator
            Random numbers.

        Returns
        -------
        sets : (size, M) array of int
            Rows of the samples; the first two are on different headings, and so are the third and the fourth.
        """
        total, size = len(self.rows), self.size
        if total < size:
            return np.empty((size, 0), dtype=np.intp)
        if math.comb(total, size) <= _OVERSAMPLING * count:
            every = itertools.combinations(range(total), size)
            sets = self._best_order(self.rows[np.array(list(every), dtype=np.intp).T])
        else:
            # rng.integers takes twice as long
            picks = (rng.random((size, _OVERSAMPLING * count)) * total).astype(np.intp)
            sets = self.rows.take(picks)
        apart = self._apart(sets)
        if len(apart) > count:
            keep = np.argpartition(apart, -count)[-count:]
            if apart[keep[0]] <= _ONE_HEADING:  # the least of those kept
                keep = keep[apart[keep] > _ONE_HEADING]
        else:
            keep = np.flatnonzero(apart > _ONE_HEADING)
        sets = sets.take(keep, axis=1)
        return self._pair(sets) if self.paired else sets

    def _best_order(self, sets: IntArray) -> IntArray:
        """Put samples on different headings side by side."""
        orders = sets[_ORDERS[self.size]]  # (size, 3, M)
        best = self._apart(orders).argmax(axis=0)
        return np.asarray(orders[:, best, np.arange(len(best))])

    def _apart(self, sets: IntArray) -> FloatArray:
        """How far the first sample's heading is from the second's, and the third's from the fourth's: the lesser.

        Where both are apart no three of them are on one heading.
        """
        end = self.size // 2 * 2
        return np.asarray(self._squared_sines(sets[:end:2], sets[1:end:2]).min(axis=0))

    def _pair(self, sets: IntArray) -> IntArray:
        """Put the third beside the first and the fourth beside the second, if they are parallel at all."""
        straight = self._squared_sines(sets[:2], sets[2:]).max(axis=0)
        crossed = self._squared_sines(sets[:2], sets[:1:-1]).max(axis=0)
        sets = np.where(straight <= crossed, sets, sets[[0, 1, 3, 2]])
        return np.asarray(sets[:, np.minimum(straight, crossed) < _PARALLEL])

    def _squared_sines(self, one: IntArray, other: IntArray) -> FloatArray:
        """Of the angles between headings."""
        ground = self.columns[4:]
        (x, y), (p, q) = ground.take(one, axis=1), ground.take(other, axis=1)
        cross = x * q - y * p
        cross *= cross
        cross /= (x * x + y * y) * (p * p + q * q)
        return np.asarray(cross)


_ORDERS = {
    3: np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]]),
    4: np.array([[0, 0, 0], [1, 2, 3], [2, 1, 1], [3, 3, 2]]),
}
"""One column for each way to split a set into pairs."""
