"""Places of named points in the stable frame, their joint covariance, and which of them can be trusted to stand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.vision.moving.fit_types import BoolArray

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

__all__ = ["IntArray", "PointMap"]

IntArray = np.ndarray[tuple[int], np.dtype[np.intp]]

SHARE = 0.8  # of its sightings that a trusted point fits
MEMORY = 50.0  # sightings that count for that share
LONG = 2  # times patience: sightings that make trust
AGAIN = 6  # times patience: sightings that make a point that moved a fixed one again


class PointMap:
    """The map; a row is a point.

    Parameters
    ----------
    patience : int
        Misfits in a row that make a point a moving one.
    largest : int
        Most points it holds.
    """

    def __init__(self, patience: int, largest: int) -> None:
        self.patience, self.largest = patience, largest
        self.ids: list[Hashable] = []
        self.x: FloatArray = np.empty((0, 2))
        self.P: FloatArray = np.empty((0, 0))
        self._score: FloatArray = np.empty((0, 4))  # sightings, fits, misfits in a row, last seen
        self._row: dict[Hashable, int] = {}
        self._moving: dict[Hashable, tuple[FloatArray, int]] = {}
        self._clock = 0

    def __len__(self) -> int:
        return len(self.ids)

    def trusted(self) -> tuple[Hashable, ...]:
        """Names of points that have stood long enough.

        Returns
        -------
        ids : tuple
            In the order in which they came.
        """
        good = self.standing(np.arange(len(self)))
        return tuple(name for name, ok in zip(self.ids, good, strict=True) if ok)

    def standing(self, at: IntArray) -> BoolArray:
        """Which of some points have stood long enough to be trusted.

        Parameters
        ----------
        at : (M,) array of int
            Rows.

        Returns
        -------
        trusted : (M,) array of bool
            Those.
        """
        seen, fits, misfits, _ = self._score[at].T
        return np.asarray((seen >= LONG * self.patience) & (fits >= SHARE * seen) & (misfits < 2))

    def find(self, ids: Sequence[Hashable]) -> tuple[IntArray, IntArray]:
        """Which of the points in a frame are in the map.

        Parameters
        ----------
        ids : sequence of names
            Points of the frame.

        Returns
        -------
        rows : (M,) array of int
            Their places in `ids`.
        at : (M,) array of int
            Their rows here.
        """
        pairs = [(k, self._row[name]) for k, name in enumerate(ids) if name in self._row]
        both = np.array(pairs, dtype=np.intp).reshape(-1, 2)
        return both[:, 0], both[:, 1]

    def blocks(self, at: IntArray) -> FloatArray:
        """Covariances of single points.

        Parameters
        ----------
        at : (M,) array of int
            Rows.

        Returns
        -------
        covariance : (M, 2, 2) array [px2]
            Without what they share.
        """
        index = 2 * at[:, None] + np.arange(2)
        return np.asarray(self.P[index[:, :, None], index[:, None, :]])

    def wander(self, variance: float) -> None:
        """Let every point be a little elsewhere than it was.

        Parameters
        ----------
        variance : float [px2]
            Added to each coordinate.
        """
        self.P[np.diag_indices(len(self.P))] += variance

    def correct(self, gain: FloatArray, step: FloatArray, loss: FloatArray) -> None:
        """Correct the map by a frame.

        Parameters
        ----------
        gain : (2N, 2M) array
            P of all points against those seen.
        step : (2M,) array [px]
            S^-1 times the residual.
        loss : (2M, 2M) array
            What the frame tells of those seen, with its homography unknown.
        """
        self.x = self.x + (gain @ step).reshape(-1, 2)
        P = self.P - gain @ loss @ gain.T
        self.P = 0.5 * (P + P.T)

    def trust(self, rows: IntArray) -> None:
        """Begin to judge: some have shown that they stand, the others have shown nothing.

        Parameters
        ----------
        rows : (M,) array of int
            Those that stand.
        """
        self._score[:, :3] = [1.0, 1.0, 0.0]
        self._score[rows, :2] = LONG * self.patience

    def judge(self, at: IntArray, fits: BoolArray) -> None:
        """Count who fitted, and take out those that move.

        Parameters
        ----------
        at : (M,) array of int
            Rows seen in this frame.
        fits : (M,) array of bool
            Whether they fitted.
        """
        self._clock += 1
        score = self._score[at]
        fade = 1.0 - 1.0 / MEMORY
        score[:, 0] = fade * score[:, 0] + 1.0
        score[:, 1] = fade * score[:, 1] + fits
        score[:, 2] = np.where(fits, 0.0, score[:, 2] + 1)
        score[:, 3] = self._clock
        self._score[at] = score
        tired = (self._score[:, 2] >= self.patience) | (
            (self._score[:, 0] >= LONG * self.patience)
            & (self._score[:, 1] < 0.5 * self._score[:, 0])
        )
        for k in np.flatnonzero(tired):
            self._moving[self.ids[k]] = (self.x[k].copy(), 0)
        if tired.any():
            self._keep(~tired)

    def add(
        self, ids: Sequence[Hashable], x: FloatArray, own: FloatArray, shared: FloatArray
    ) -> None:
        """Take in points.

        Parameters
        ----------
        ids : sequence of M names
            Points that are not in the map.
        x : (M, 2) array [px]
            Their places.
        own : (2M, 2M) array [px2]
            Their joint covariance.
        shared : (2M, 2N) array [px2]
            Their covariance with the N points that are here.
        """
        count = len(self)
        self.ids.extend(ids)
        self.x = np.concatenate([self.x, x])
        P = np.empty((2 * len(self), 2 * len(self)))
        P[: 2 * count, : 2 * count] = self.P
        P[2 * count :, : 2 * count], P[: 2 * count, 2 * count :] = shared, shared.T
        P[2 * count :, 2 * count :] = own
        self.P = P
        fresh = np.tile([1.0, 1.0, 0.0, self._clock], (len(ids), 1))
        self._score = np.concatenate([self._score, fresh])
        self._row = {name: k for k, name in enumerate(self.ids)}
        surplus = len(self) - self.largest
        if surplus > 0:
            keep = np.ones(len(self), dtype=bool)
            keep[np.argsort(self._score[:, 3], kind="stable")[:surplus]] = False
            self._keep(keep)

    def may_enter(self, ids: Sequence[Hashable], x: FloatArray, radius: float) -> BoolArray:
        """Which of the points that are not in the map may come in: new ones, and those that stand again.

        Parameters
        ----------
        ids : sequence of M names
            Points that are not in the map.
        x : (M, 2) array [px]
            Where they are in the stable frame.
        radius : float [px]
            Within it a point counts as standing.

        Returns
        -------
        enter : (M,) array of bool
            Those.
        """
        enter = np.ones(len(ids), dtype=bool)
        for k, name in enumerate(ids):
            if name not in self._moving:
                continue
            place, count = self._moving[name]
            near = bool(np.hypot(*(x[k] - place)) < radius)
            self._moving[name] = (place, count + 1) if near else (x[k].copy(), 0)
            enter[k] = near and count + 1 >= AGAIN * self.patience
            if enter[k]:
                del self._moving[name]
        return enter

    def _keep(self, keep: BoolArray) -> None:
        both = np.repeat(keep, 2)
        self.ids = [name for name, ok in zip(self.ids, keep, strict=True) if ok]
        self.x, self.P, self._score = self.x[keep], self.P[np.ix_(both, both)], self._score[keep]
        self._row = {name: k for k, name in enumerate(self.ids)}
