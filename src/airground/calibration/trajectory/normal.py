"""Normal equations of one chain: block-tridiagonal in the local unknowns, with a border for the global ones.

::

    [ A  B ] [ local  ]   [ a ]
    [ B' C ] [ global ] = [ c ]

A is banded; its Cholesky factor L eliminates the local unknowns at a cost linear in the sightings, and leaves the
Schur complement ``C - (L^-1 B)'(L^-1 B)``, whose inverse, summed over the chains, is the covariance of the globals.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import UnobservableMotionError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.trajectory.rows import OdometryRows, SightingRows

__all__ = ["Eliminated", "Normal", "eliminate", "of_odometry", "of_sightings"]

EASE = 1e-13  # of the largest diagonal entry: keeps a position that nothing ties to anything from being singular


@dataclass(frozen=True, slots=True, eq=False)
class Normal:
    """Normal equations of some rows."""

    bands: FloatArray
    """(2 W, N W). Lower bands of A: ``bands[i - j, j] = A[i, j]``."""

    border: FloatArray
    """(N W, B)."""

    right: FloatArray
    """(N W,)."""

    corner: FloatArray
    """(B, B)."""

    corner_right: FloatArray
    """(B,)."""

    cost: float
    """Sum of the rows' squares."""

    def __add__(self, other: Normal) -> Normal:
        return Normal(
            self.bands + other.bands,
            self.border + other.border,
            self.right + other.right,
            self.corner + other.corner,
            self.corner_right + other.corner_right,
            self.cost + other.cost,
        )

    def scaled(self, factor: float) -> Normal:
        """Weight all rows alike.

        Parameters
        ----------
        factor : float
            Inverse variance.

        Returns
        -------
        normal : Normal
            Of the weighted rows.
        """
        return Normal(
            self.bands * factor,
            self.border * factor,
            self.right * factor,
            self.corner * factor,
            self.corner_right * factor,
            self.cost * factor,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Eliminated:
    """A chain with its local unknowns eliminated."""

    schur: FloatArray
    """(B, B). Information on the globals."""

    right: FloatArray
    """(B,). Its right side."""

    factor: FloatArray
    """(2 W, N W). L of the local unknowns, in bands."""

    border: FloatArray
    """(N W, B). L^-1 B."""

    local: FloatArray
    """(N W,). L^-1 a."""

    log_det: float
    """Logarithm of the determinant of A."""

    def back(self, change: FloatArray) -> FloatArray:
        """Change of the local unknowns, given that of the global ones.

        Parameters
        ----------
        change : (B,) array
            Of the globals.

        Returns
        -------
        local : (N W,) array
            Of the local unknowns.
        """
        from scipy.linalg.lapack import dtbtrs  # type: ignore[import-untyped,unused-ignore]

        x, _ = dtbtrs(
            self.factor, (self.local - self.border @ change)[:, None], uplo="L", trans="T"
        )
        return np.asarray(x[:, 0])


def of_sightings(rows: SightingRows, weight: FloatArray) -> Normal:
    """Normal equations of sightings.

    Parameters
    ----------
    rows : SightingRows
        Linearised.
    weight : (N,) array
        Weight of each.

    Returns
    -------
    normal : Normal
        Block-diagonal in the local unknowns.
    """
    count, width = len(weight), rows.local.shape[2]
    size = rows.border.shape[2]
    sides = _columns(rows.local, rows.border, rows.residual[:, :, None])
    weighted = sides * weight
    products = np.einsum("ikn,jkn->ijn", weighted[:width], sides)
    gram = _gram(weighted[width:], sides[width:])
    bands = np.zeros((2 * width, count * width))
    _diagonal(bands, products[:, :width])
    return Normal(
        bands,
        np.ascontiguousarray(np.moveaxis(products[:, width:-1], -1, 0)).reshape(-1, size),
        np.ascontiguousarray(products[:, -1].T).reshape(-1),
        gram[:-1, :-1],
        gram[:-1, -1],
        float(gram[-1, -1]),
    )


def of_odometry(rows: OdometryRows, weight: FloatArray, count: int) -> Normal:
    """Normal equations of increments.

    Parameters
    ----------
    rows : OdometryRows
        Linearised.
    weight : (L, 2) array
        Weight of each, along and across.
    count : int
        Sightings of the chain.

    Returns
    -------
    normal : Normal
        Block-tridiagonal in the local unknowns.
    """
    width, size = rows.start.shape[2], rows.border.shape[2]
    whole = len(rows.first) == count - 1  # slices are much quicker than lists of places
    first = slice(0, count - 1) if whole else rows.first
    last = slice(1, count) if whole else rows.first + 1
    active = list(range(size)) if rows.active is None else list(rows.active)
    # Derivatives by everything that a link depends on, and the residual: one product gives all.
    sides = _columns(rows.start, rows.end, rows.border[:, :, active], rows.residual[:, :, None])
    weighted = sides * weight.T
    products = np.einsum("ikn,jkn->ijn", weighted[: width + 2], sides)
    start, end = slice(0, width), slice(width, width + 2)
    other, residual = slice(width + 2, -1), -1
    diagonal = np.zeros((width, width, count))
    diagonal[:, :, first] += products[start, start]
    diagonal[:2, :2, last] += products[end, end]
    below = np.zeros((width, width, count))  # block (k + 1, k)
    below[:2, :, first] = products[end, start]
    border = np.zeros((count, width, size))
    right = np.zeros((count, width))
    for i in range(width):
        right[first, i] -= products[i, residual]
        for place, column in zip(active, products[i, other], strict=True):
            border[first, i, place] += column
    for i in range(2):
        right[last, i] -= products[width + i, residual]
        for place, column in zip(active, products[width + i, other], strict=True):
            border[last, i, place] += column
    bands = np.zeros((2 * width, count * width))
    _diagonal(bands, diagonal)
    _below(bands, below)
    gram = _gram(weighted[width + 2 :], sides[width + 2 :])
    corner, corner_right = np.zeros((size, size)), np.zeros(size)
    corner[np.ix_(active, active)] = gram[:-1, :-1]
    corner_right[active] = -gram[:-1, -1]
    return Normal(
        bands,
        border.reshape(-1, size),
        right.reshape(-1),
        corner,
        corner_right,
        float(gram[-1, -1]),
    )


def _columns(*parts: FloatArray) -> FloatArray:
    """(C, 2, N). Columns of (N, 2, ...) rows, each in one piece of memory: sums over them are quick then."""
    sides = np.empty((sum(part.shape[2] for part in parts), 2, len(parts[0])))
    place = 0
    for part in parts:
        sides[place : place + part.shape[2]] = np.moveaxis(part, 0, -1).swapaxes(0, 1)
        place += part.shape[2]
    return sides


def _gram(weighted: FloatArray, sides: FloatArray) -> FloatArray:
    """(C, C). Products of whole columns."""
    return np.asarray(weighted.reshape(len(weighted), -1) @ sides.reshape(len(sides), -1).T)


def eliminate(normal: Normal) -> Eliminated:
    """Eliminate the local unknowns.

    Parameters
    ----------
    normal : Normal
        All rows of a chain.

    Returns
    -------
    eliminated : Eliminated
        What is left for the globals.

    Raises
    ------
    UnobservableMotionError
        If the equations are not finite or not positive: the iteration has left what a camera can see.
    """
    from scipy.linalg import (  # type: ignore[import-untyped,unused-ignore]
        LinAlgError,
        cholesky_banded,
    )
    from scipy.linalg.lapack import dtbtrs  # type: ignore[import-untyped,unused-ignore]

    bands = normal.bands.copy()
    bands[0] *= 1 + EASE
    bands[0] += EASE * float(bands[0].max(initial=0.0))
    size = len(normal.corner_right)
    try:
        factor = cholesky_banded(bands, overwrite_ab=True, lower=True, check_finite=False)
        if not np.isfinite(factor[0]).all():  # LAPACK lets NaN pass
            raise ValueError("not finite")
    except (LinAlgError, ValueError) as error:
        raise UnobservableMotionError(
            "the motion does not determine the robot's positions",
            rank=0,
            headings_deg=(),
            advice="look for wrong sightings or readings",
        ) from error
    sides = np.empty((len(normal.right), size + 1), order="F")
    sides[:, :size] = normal.border
    sides[:, size] = normal.right
    solved, _ = dtbtrs(factor, sides, uplo="L", overwrite_b=1)
    border, local = solved[:, :size], solved[:, size]
    return Eliminated(
        normal.corner - border.T @ border,
        normal.corner_right - border.T @ local,
        factor,
        border,
        local,
        2 * float(np.sum(np.log(factor[0]))),
    )


def _diagonal(bands: FloatArray, blocks: FloatArray) -> None:
    """Add (W, W, N) blocks on the diagonal."""
    width = len(blocks)
    for i in range(width):
        for j in range(i + 1):
            bands[i - j, j::width] += blocks[i, j]


def _below(bands: FloatArray, blocks: FloatArray) -> None:
    """Add (W, W, N) blocks below the diagonal; the last one is not in the matrix and zero."""
    width = len(blocks)
    for i in range(width):
        for j in range(width):
            bands[width + i - j, j::width] += blocks[i, j]
