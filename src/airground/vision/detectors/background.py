"""What a still camera sees when nothing moves, pixel by pixel, and how much that flickers.

It starts as the median of nine frames spread over the warm-up, so a thing that passes leaves no trace. Afterwards it
follows slow changes of light, but never under what is in front of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.vision.frame import ImageArray

__all__ = ["SAMPLES", "Background", "median_of_nine"]

SAMPLES = 9
"""Frames that the first background is made of."""

STANDS_OUT = 5.0  # deviations of its own flicker by which a pixel must differ
LEAST_STEP, MOST_STEP = 10, 90  # grey levels, whatever the flicker
FOLLOW = 0.03  # share of a difference that each update takes over
UPDATE_FRAMES = 3

# Comparators that bring the median of nine to place 4 (Smith, Graphics Gems 1990; 19 of them).
_NETWORK = (
    (1, 2), (4, 5), (7, 8), (0, 1), (3, 4), (6, 7), (1, 2), (4, 5), (7, 8), (0, 3),
    (5, 8), (4, 7), (3, 6), (1, 4), (2, 5), (4, 7), (4, 2), (6, 4), (4, 2),
)  # fmt: skip


def median_of_nine(images: list[ImageArray]) -> ImageArray:
    """Median, pixel by pixel.

    Parameters
    ----------
    images : list of array
        Nine, of one shape.

    Returns
    -------
    median : array
        Of the same shape.
    """
    p = list(images)
    for a, b in _NETWORK:
        low, high = cv2.min(p[a], p[b]), cv2.max(p[a], p[b])
        p[a], p[b] = np.asarray(low, dtype=np.uint8), np.asarray(high, dtype=np.uint8)
    return np.asarray(p[4], dtype=np.uint8)


class Background:
    """A learned background.

    Parameters
    ----------
    images : list of (H, W) or (H, W, 3) array
        Nine, smoothed as those to come.
    valid : (H, W) array
        255 where all of them show something.
    """

    def __init__(self, images: list[ImageArray], valid: NDArray[np.uint8]) -> None:
        median = median_of_nine(images)
        deviations = [
            _largest(np.asarray(cv2.absdiff(image, median), dtype=np.uint8)) for image in images
        ]
        self.image = median
        self.known = valid.copy()
        self._mean = median.astype(np.float32)
        self._flicker = 1.4826 * median_of_nine(deviations).astype(np.float32)
        # The median of few small whole numbers is coarse: neighbours help.
        self._flicker = np.asarray(cv2.blur(self._flicker, (5, 5)), dtype=np.float32)
        self.step = self._steps()
        self._age = np.zeros(valid.shape, dtype=np.float32)
        self._count = 0

    def difference(self, image: ImageArray) -> ImageArray:
        """By how much an image differs from the background.

        Parameters
        ----------
        image : (H, W) or (H, W, 3) array
            The image.

        Returns
        -------
        difference : (H, W) array
            Of the channel that differs most [grey levels].
        """
        return _largest(np.asarray(cv2.absdiff(image, self.image), dtype=np.uint8))

    def follow(
        self, image: ImageArray, covered: NDArray[np.uint8], valid: NDArray[np.uint8]
    ) -> None:
        """Follow slow changes of light where nothing is in front.

        Parameters
        ----------
        image : (H, W) or (H, W, 3) array
            The newest image.
        covered : (H, W) array
            Non-zero where something may be in front.
        valid : (H, W) array
            255 where the image shows something.
        """
        self._count += 1
        if self._count % UPDATE_FRAMES:
            return
        fresh = cv2.bitwise_and(valid, cv2.bitwise_not(self.known))
        if cv2.countNonZero(fresh):
            self.replace(image, np.asarray(fresh, dtype=np.uint8))
        free = cv2.bitwise_and(valid, cv2.bitwise_not(covered))
        difference = self.difference(image)
        cv2.accumulateWeighted(image, self._mean, FOLLOW, free)
        # A mean absolute deviation of 1 is a standard deviation of 1.25.
        deviation = np.asarray(1.25 * difference.astype(np.float32), dtype=np.float32)
        cv2.accumulateWeighted(deviation, self._flicker, FOLLOW, free)
        self.image = np.asarray(cv2.convertScaleAbs(self._mean), dtype=np.uint8)
        self.step = self._steps()

    def replace(self, image: ImageArray, where: NDArray[np.uint8]) -> None:
        """Take over an image.

        Parameters
        ----------
        image : (H, W) or (H, W, 3) array
            The image.
        where : (H, W) array
            Non-zero where to take it.
        """
        rows = where > 0
        self._mean[rows] = image[rows]
        self._flicker[rows] = LEAST_STEP / STANDS_OUT
        self.known[rows] = 255
        self.image = np.asarray(cv2.convertScaleAbs(self._mean), dtype=np.uint8)
        self.step = self._steps()

    def _steps(self) -> NDArray[np.uint8]:
        """Differences that count, pixel by pixel [grey levels]."""
        scaled = cv2.convertScaleAbs(self._flicker, alpha=STANDS_OUT)
        steps = np.clip(np.asarray(scaled), LEAST_STEP, MOST_STEP)
        return np.asarray(steps, dtype=np.uint8)


def _largest(image: ImageArray) -> ImageArray:
    """The largest channel."""
    if image.ndim == 2:
        return image
    blue, green, red = cv2.split(image)
    return np.asarray(cv2.max(cv2.max(blue, green), red), dtype=np.uint8)
