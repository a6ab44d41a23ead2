"""An image in parts of about one size, so that searching one in each frame takes about the same time in each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

__all__ = ["Part", "parts_of"]

OVERLAP_PX = 96  # at a part's own scale: a tag of 60 px lies within one whatever its turn
LEAST_PART_PX = 160  # side of a part without its overlap, likewise
SCALES = (1, 2, 4)  # each for the tags that are too large for the parts of the one before
MOST_HALVES = 4  # parts of the image at half the size


@dataclass(frozen=True, slots=True)
class Part:
    """A window of an image, and how much smaller it is to be looked at."""

    window: tuple[int, int, int, int]
    """Left, top, right, bottom [px] in the image, the last two excluded."""

    scale: int
    """1 or more: pixels of the image along one of the part."""

    @property
    def pixels(self) -> int:
        """How many there are to be searched."""
        left, top, right, bottom = self.window
        return (right - left) * (bottom - top) // self.scale**2


@lru_cache(maxsize=8)  # asked for in every frame
def parts_of(
    shape: tuple[int, ...], most: int, *, before: bool = False
) -> tuple[tuple[Part, ...], ...]:
    """Divide an image for a search: small tags are in windows of it, large ones in windows of it made smaller.

    Of all divisions the one is taken whose largest set has the fewest pixels.

    Parameters
    ----------
    shape : tuple of int
        Of the image: height and width [px].
    most : int
        No more sets than so many.
    before : bool
        Whether windows overlap to the left and upwards, not to the right and downwards: taken in turn, no place is at a
        window's edge twice running.

    Returns
    -------
    sets : tuple of tuple of Part
        What is to be searched together; empty where the image is too small to be worth a division.
    """
    height, width = shape[:2]
    if most < 2 or max(_grid(width, height, most, before=before, scale=1)[1]) < 2:
        return ()
    best: tuple[tuple[Part, ...], ...] = ()
    for halves in range(1, min(MOST_HALVES, most - 1) + 1):
        whole = _grid(width, height, most - halves, before=before, scale=SCALES[0])[0]
        half = _grid(width, height, halves, before=before, scale=SCALES[1])[0]
        quarter = Part((0, 0, width, height), SCALES[2])
        sets = (*((part,) for part in (*whole, *half[:-1])), (half[-1], quarter))
        if not best or _largest(sets) < _largest(best):
            best = sets
    return best


def _largest(sets: tuple[tuple[Part, ...], ...]) -> int:
    return max(sum(part.pixels for part in parts) for parts in sets)


def _grid(
    width: int, height: int, most: int, *, before: bool, scale: int
) -> tuple[tuple[Part, ...], tuple[int, int]]:
    """Windows that cover an image; of all grids of so many the one with the smallest windows."""
    overlap, least = OVERLAP_PX * scale, LEAST_PART_PX * scale
    grids = [
        (columns, rows)
        for columns in range(1, max(min(most, width // least), 1) + 1)
        for rows in range(1, max(min(most // columns, height // least), 1) + 1)
    ]
    columns, rows = min(
        grids,
        key=lambda grid: (
            min(width / grid[0] + overlap, width) * min(height / grid[1] + overlap, height)
        ),
    )
    u = np.linspace(0, width, columns + 1).astype(int).tolist()
    v = np.linspace(0, height, rows + 1).astype(int).tolist()
    less, more = (overlap, 0) if before else (0, overlap)
    parts = tuple(
        Part(
            (
                max(left - less, 0),
                max(top - less, 0),
                min(right + more, width),
                min(bottom + more, height),
            ),
            scale,
        )
        for top, bottom in pairwise(v)
        for left, right in pairwise(u)
    )
    return parts, (columns, rows)
