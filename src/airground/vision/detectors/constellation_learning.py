"""Three points that keep their shape while they go about: the seed of a pattern that nobody described."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import UndeterminedError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["learned_pattern"]

FRAMES = 400
TRIANGLES = 2000
NEIGHBOURS = 6
ALIKE = np.array([0.08, 0.08, 0.35])
"""Differences of two sides over the longest, and of the logarithm of size, within which triangles are alike."""

FLAT = 0.05
"""Area over the square of the longest side below which three points do not place anything."""

PLACES = 4
"""Different places, apart by its size, at which a shape must be seen."""

AS_OFTEN = 0.8
"""Share of the frames of the shape that is seen most often, in which a pattern must be seen."""

ROUNDS = 3


def learned_pattern(frames: Sequence[FloatArray]) -> FloatArray:
    """Find the triangle that is seen in the most places.

    Parameters
    ----------
    frames : sequence of (P, 2) array [px]
        Points of frames.

    Returns
    -------
    points : (3, 2) array [px]
        Its corners, v turned up: the image as seen from above.

    Raises
    ------
    UndeterminedError
        If no shape is seen in several places.
    """
    found = [_triangles(uv) for uv in frames[:: 1 + len(frames) // FRAMES] if len(uv) >= 3]
    found = found[:: 1 + sum(map(len, found)) // TRIANGLES]
    corners = np.concatenate(found) if found else np.empty((0, 3, 2))
    frame = np.repeat(np.arange(len(found)), [len(each) for each in found])
    shape, flat = _shapes(corners)
    corners, shape, frame = corners[~flat], shape[~flat], frame[~flat]
    advice = "record while a vehicle drives, or describe its pattern"
    if not len(corners):
        raise UndeterminedError(f"no three points to learn a pattern from; {advice}")
    alike = np.asarray((np.abs(shape[:, None] - shape[None]) < ALIKE).all(axis=2))
    size, middle = np.exp(shape[:, 2]), corners.mean(axis=1)
    votes = np.array(
        [
            len(np.unique(np.floor(middle[same] / (2 * own)), axis=0))
            for same, own in zip(alike, size, strict=True)
        ],
        dtype=np.float64,
    )
    # Points that blink, and others that come by, are seen together in fewer frames; triangles of several vehicles are
    # larger than theirs, and come to fewer places apart by their size.
    often = np.array([len(np.unique(frame[same])) for same in alike])
    best = int(np.argmax(np.where(often >= AS_OFTEN * often.max(), votes, 0.0)))
    if votes[best] < PLACES:
        raise UndeterminedError(f"no three points move rigidly together; {advice}")
    return _averaged(corners[best], corners[alike[best]])


def _triangles(uv: FloatArray) -> FloatArray:
    """(M, 3, 2). Of points that are near each other, each once."""
    P = len(uv)
    d = np.linalg.norm(uv[:, None] - uv[None], axis=2)
    near = np.argsort(d, axis=1, kind="stable")[:, 1 : 1 + min(NEIGHBOURS, P - 1)]
    j, k = np.triu_indices(near.shape[1], 1)
    i = np.repeat(np.arange(P), len(j))
    three = np.sort(np.column_stack([i, near[:, j].ravel(), near[:, k].ravel()]), axis=1)
    return np.asarray(uv[np.unique(three, axis=0)])


def _shapes(
    corners: FloatArray,
) -> tuple[FloatArray, np.ndarray[tuple[int, ...], np.dtype[np.bool_]]]:
    """Middle and short side over the long one, logarithm of the long one; and which are flat."""
    side = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    side = np.sort(side, axis=1)
    edge = corners[:, 1:] - corners[:, :1]
    area = np.abs(edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0])
    long = np.maximum(side[:, 2], 1e-9)
    shape = np.column_stack([side[:, 1] / long, side[:, 0] / long, np.log(long)])
    return shape, area < FLAT * long**2


def _averaged(first: FloatArray, all_of_them: FloatArray) -> FloatArray:
    """Mean shape, up to place, turn and size, of triangles whose corners come in any order."""
    # As complex numbers with v up; corners counter-clockwise, so that only three orders are left.
    z = all_of_them @ np.array([1, -1j])
    z = z - z.mean(axis=1, keepdims=True)
    order = np.argsort(np.angle(z), axis=1)
    z = np.take_along_axis(z, order, axis=1)
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    mean = first @ np.array([1, -1j])
    mean = mean - mean.mean()
    mean = mean[np.argsort(np.angle(mean))]
    mean = mean / np.linalg.norm(mean)
    for _ in range(ROUNDS):
        rolled = np.stack([np.roll(z, k, axis=1) for k in range(3)], axis=1)  # (M, 3 orders, 3)
        fit = rolled @ np.conj(mean)
        best = np.argmax(np.abs(fit), axis=1)
        rows = np.arange(len(z))
        aligned = rolled[rows, best] * np.exp(-1j * np.angle(fit[rows, best]))[:, None]
        mean = np.median(aligned.real, axis=0) + 1j * np.median(aligned.imag, axis=0)
        mean = mean / np.linalg.norm(mean)
    size = float(
        np.median(
            np.linalg.norm(all_of_them - all_of_them.mean(axis=1, keepdims=True), axis=(1, 2))
        )
    )
    return np.column_stack([mean.real, mean.imag]) * size
