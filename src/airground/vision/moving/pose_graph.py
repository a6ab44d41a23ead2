"""Where the key frames lie in the stable frame: adjusted over all their links, the first one held.

A link (i, j) is a homography M from key frame j to key frame i with a covariance. With H the key frames' own, to the
stable frame, it wants ``M (I + e) = H_i^-1 H_j`` with e small, in the terms of `small_motion`. A camera that goes
out and comes home by another way closes a loop, and the drift that it had gathered is shared out over the links.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.geometry.homography import unit_determinant
from airground.vision.moving.small_motion import (
    UNIT_PX,
    change_of_basis,
    compose_covariance,
    difference,
    invert_covariance,
    move,
    relative,
)

__all__ = ["Link", "PoseGraph", "chain"]

ROUNDS = 10
SETTLED = 1e-10
UNIT = np.diag([1 / UNIT_PX, 1 / UNIT_PX, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """How two key frames lie to each other."""

    to: int
    """Key frame i."""

    of: int
    """Key frame j."""

    matrix: FloatArray
    """(3, 3). From j's image to i's."""

    covariance: FloatArray
    """(8, 8). Of the small motion before it."""


class PoseGraph:
    """Homographies of key frames to the stable frame. Key frame 0 is the stable frame."""

    def __init__(self) -> None:
        self.matrix: dict[int, FloatArray] = {0: np.eye(3)}
        self.covariance: dict[int, FloatArray] = {0: np.zeros((8, 8))}
        self.links: list[Link] = []

    def linked(self, one: int, other: int) -> bool:
        """Whether there is a link between two key frames.

        Parameters
        ----------
        one : int
            A key frame.
        other : int
            Another.

        Returns
        -------
        linked : bool
            Directly.
        """
        return any({link.to, link.of} == {one, other} for link in self.links)

    def add(self, key: int, link: Link) -> None:
        """Take in a key frame by its first link.

        Parameters
        ----------
        key : int
            Its number.
        link : Link
            From it to one that is here.
        """
        self.matrix[key] = unit_determinant(self.matrix[link.to] @ link.matrix)
        self.covariance[key] = compose_covariance(
            self.covariance[link.to], link.covariance, link.matrix
        )
        self.links.append(link)

    def close(self, link: Link) -> None:
        """Take in a link between two that are here, and adjust all.

        Parameters
        ----------
        link : Link
            The new one.
        """
        self.links.append(link)
        keys = sorted(set(self.matrix) - {0})
        row = {key: 8 * k for k, key in enumerate(keys)}
        information = np.zeros((8 * len(keys), 8 * len(keys)))
        for _ in range(ROUNDS):
            information, gradient = self._normal(row)
            step = np.asarray(np.linalg.solve(information, gradient), dtype=np.float64)
            for key, k in row.items():
                self.matrix[key] = unit_determinant(move(self.matrix[key], step[k : k + 8]))
            if np.abs(step).max() < SETTLED:
                break
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        for key, k in row.items():
            self.covariance[key] = covariance[k : k + 8, k : k + 8]

    def drop(self, key: int) -> None:
        """Forget a key frame; its neighbours are tied to the surest of them instead.

        Parameters
        ----------
        key : int
            Which; not 0.
        """
        near = [_towards(link, key) for link in self.links if key in (link.to, link.of)]
        near.sort(key=lambda link: (float(np.trace(self.covariance[link.to])), link.to))
        self.links = [link for link in self.links if key not in (link.to, link.of)]
        best = near[0]
        for other in near[1:]:
            if not self.linked(best.to, other.to):
                self.links.append(chain(best, _reverse(other)))
        del self.matrix[key], self.covariance[key]

    def _normal(self, row: dict[int, int]) -> tuple[FloatArray, FloatArray]:
        size = 8 * len(row)
        information, gradient = np.zeros((size, size)), np.zeros(size)
        for link in self.links:
            X = relative(self.matrix[link.to], self.matrix[link.of])
            e = difference(link.matrix, X)
            W = np.linalg.inv(link.covariance)
            A = {link.of: np.eye(8)}
            A[link.to] = -change_of_basis(UNIT @ np.linalg.inv(X) @ np.linalg.inv(UNIT))
            for a in A.keys() & row.keys():
                i = row[a]
                gradient[i : i + 8] -= A[a].T @ W @ e
                for b in A.keys() & row.keys():
                    j = row[b]
                    information[i : i + 8, j : j + 8] += A[a].T @ W @ A[b]
        return information, gradient


def chain(outer: Link, inner: Link) -> Link:
    """Two links in a row as one.

    Parameters
    ----------
    outer : Link
        From b to a.
    inner : Link
        From c to b.

    Returns
    -------
    link : Link
        From c to a.
    """
    covariance = compose_covariance(outer.covariance, inner.covariance, inner.matrix)
    return Link(outer.to, inner.of, unit_determinant(outer.matrix @ inner.matrix), covariance)


def _reverse(link: Link) -> Link:
    back = unit_determinant(np.linalg.inv(link.matrix))
    return Link(link.of, link.to, back, invert_covariance(link.matrix, link.covariance))


def _towards(link: Link, key: int) -> Link:
    """The link written as from `key` to the other."""
    return link if link.of == key else _reverse(link)
