"""Where the next frame roughly is: the last frame's points followed through small images, whatever the camera does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray
from airground.vision.moving.features import find_corners, follow
from airground.vision.moving.search import search_homography

if TYPE_CHECKING:
    from airground.vision.frame import ImageArray
    from airground.vision.moving.key_frames import Registration

__all__ = ["Coarse"]

WIDTH_PX = 320
LEVELS = 3  # with a window of 15 px: some 50 px of the small image, 15 % of its width
MOST = 120
THRESHOLD_PX = 1.0
LEAST = 10
ENOUGH = 40
CELL_PX = 24
PATIENCE = 30  # frames for which the last good one is still a guess


class Coarse:
    """The last good frame, small."""

    def __init__(self) -> None:
        self._small: ImageArray | None = None
        self._uv: FloatArray = np.empty((0, 2))
        self._H: FloatArray = np.eye(3)
        self._lost = 0
        self._newest: tuple[ImageArray, ImageArray, float] | None = None

    def begin(self, grey: ImageArray, uv: FloatArray) -> None:
        """Start with a frame.

        Parameters
        ----------
        grey : (H, W) array
            Its image; it is the stable frame.
        uv : (N, 2) array [px]
            Points of it.
        """
        self._keep(grey, uv)
        self._H = np.eye(3)

    def found(self, grey: ImageArray, H: FloatArray, registration: Registration) -> None:
        """Remember a frame whose homography is known.

        Parameters
        ----------
        grey : (H, W) array
            Its image.
        H : (3, 3) array
            Stable from image.
        registration : Registration
            With the points that were seen.
        """
        self._keep(grey, registration.uv[registration.fit.inliers])
        self._H, self._lost = H, 0

    def _keep(self, grey: ImageArray, uv: FloatArray) -> None:
        self._small, share = self._shrunk(grey)
        if len(uv) < ENOUGH:  # where the user gave the points, they may be few
            mask = np.full_like(self._small, 255)
            small = find_corners(self._small, mask, cell_px=CELL_PX, per_cell=1)
            uv = (small + 0.5) / share - 0.5
        self._uv = _thin(uv)

    def _shrunk(self, grey: ImageArray) -> tuple[ImageArray, float]:
        """A frame is asked for twice: for the guess, and when it is found."""
        if self._newest is None or self._newest[0] is not grey:
            self._newest = (grey, *_shrink(grey))
        return self._newest[1:]

    def lose(self) -> None:
        """Count a frame whose homography is not known."""
        self._lost += 1

    def guess(self, grey: ImageArray) -> FloatArray | None:
        """Stable from image, roughly, from the last good frame to this one.

        Parameters
        ----------
        grey : (H, W) array
            This one.

        Returns
        -------
        stable_from_image : (3, 3) array or None
            Good to a pixel or two, or None where nothing fits or the last good frame is long ago.
        """
        if self._small is None or self._lost > PATIENCE:
            return None
        small, share = self._shrunk(grey)
        before = (self._uv + 0.5) * share - 0.5
        after, good = follow(self._small, small, before, levels=LEVELS, there_and_back=True)
        if good.sum() < LEAST:
            return None
        found = search_homography(after[good], before[good], THRESHOLD_PX, iterations=1000)
        if found is None or found[1] < max(LEAST, 0.3 * good.sum()):
            return None
        work = np.array(
            [[share, 0.0, 0.5 * share - 0.5], [0.0, share, 0.5 * share - 0.5], [0, 0, 1]]
        )
        return np.asarray(self._H @ np.linalg.solve(work, found[0] @ work))


def _shrink(grey: ImageArray) -> tuple[ImageArray, float]:
    share = min(1.0, WIDTH_PX / grey.shape[1])
    size = (round(grey.shape[1] * share), max(1, round(grey.shape[0] * share)))
    small = grey if share == 1.0 else cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8), share


def _thin(uv: FloatArray) -> FloatArray:
    """Not more than MOST of them, evenly."""
    return uv if len(uv) <= MOST else uv[np.linspace(0, len(uv) - 1, MOST).astype(np.intp)]
