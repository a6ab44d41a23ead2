"""Tags from one frame to the next: where they will be, how they move, and where to look for those that are gone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.vision.detectors.tag_places import PlacedTag
    from airground.vision.detectors.tag_search import Candidate
    from airground.vision.frame import Frame

    Window = tuple[int, int, int, int]

__all__ = [
    "LostTag",
    "PendingFrame",
    "all_ahead",
    "is_same",
    "pixels_in",
    "window_around",
    "with_motion",
]

MOST_WINDOW_PX = 320  # side of what is searched for a tag


@dataclass(frozen=True, slots=True, eq=False)
class LostTag:
    """A tag that was there a while ago."""

    tag: PlacedTag
    """As it was."""

    t: float
    """When it was seen last [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class PendingFrame:
    """A frame that was not searched for new tags yet."""

    frame: Frame
    """That."""

    dt: float
    """Time since the one before [s]."""

    missed: tuple[Window, ...]
    """Left, top, right, bottom [px] of where tags should be that were not found."""


def all_ahead(tags: list[PlacedTag], dt: float) -> FloatArray:
    """Where tags will be: `PlacedTag.ahead` of all.

    Parameters
    ----------
    tags : list of PlacedTag
        K of one frame; not none.
    dt : float [s]
        How much later.

    Returns
    -------
    image_from_tag : (K, 3, 3) array
        Then.
    """
    H = np.array([tag.image_from_tag for tag in tags])
    H += dt * (H @ np.array([tag.drift for tag in tags]))
    return np.asarray(H / H[:, 2:, 2:])


def with_motion(tags: list[PlacedTag], known: list[PlacedTag], dt: float) -> list[PlacedTag]:
    """Tags with their motion since the frame before, each from the nearest tag of the same number.

    Parameters
    ----------
    tags : list of PlacedTag
        Of a frame.
    known : list of PlacedTag
        Of the one before.
    dt : float [s]
        Time between them; nothing is known of their motion where it is zero.

    Returns
    -------
    tags : list of PlacedTag
        The same.
    """
    if dt <= 0 or not tags:
        return tags
    pairs = []
    for tag in tags:
        same = [old for old in known if (old.family, old.number) == (tag.family, tag.number)]
        if len(same) > 1:
            same.sort(key=lambda old: float(np.abs(tag.corners - old.corners).sum()))
        pairs.append((same or [tag])[0].image_from_tag)
    step = np.linalg.inv(np.array(pairs)) @ np.array([tag.image_from_tag for tag in tags])
    drift = (step / step[:, 2:, 2:] - np.eye(3)) / dt
    return [replace(tag, drift=each) for tag, each in zip(tags, drift, strict=True)]


def is_same(candidate: Candidate, tag: PlacedTag) -> bool:
    """Whether a candidate is a tag that is already known to be there.

    Parameters
    ----------
    candidate : Candidate
        Of the same frame.
    tag : PlacedTag
        That.

    Returns
    -------
    same : bool
        Whether its number and its corners are the same.
    """
    if (candidate.family, candidate.number) != (tag.family, tag.number):
        return False
    apart = float(np.hypot(*(candidate.corners - tag.corners).T).max())
    side = float(np.hypot(*(tag.corners[1] - tag.corners[0])))
    return apart < max(3.0, side / tag.family.cells)


def pixels_in(window: Window) -> int:
    """Area of a window.

    Parameters
    ----------
    window : tuple of int
        Left, top, right, bottom [px], the last two excluded.

    Returns
    -------
    pixels : int
        How many there are in it.
    """
    left, top, right, bottom = window
    return (right - left) * (bottom - top)


def window_around(corners: FloatArray, shape: tuple[int, ...], reach: float = 0.0) -> Window:
    """Where a tag may be.

    Parameters
    ----------
    corners : (4, 2) array [px]
        Where it should be.
    shape : tuple of int
        Height and width of the image [px].
    reach : float
        How far it may have gone from there [px]: counts as far as the window does not become too large by it.

    Returns
    -------
    window : tuple of int
        Left, top, right, bottom [px], the last two excluded.
    """
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float((high - low).max())
    pad = size + 12.0
    pad += min(reach, max(0.0, (MOST_WINDOW_PX - size) / 2 - pad))
    left, top = np.clip(low - pad, 0, [shape[1], shape[0]]).astype(int)
    right, bottom = np.clip(high + pad, 0, [shape[1], shape[0]]).astype(int)
    return int(left), int(top), int(right), int(bottom)
