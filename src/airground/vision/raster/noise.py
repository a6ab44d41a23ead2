"""Noise of a camera's sensor: drawn once, laid over each frame from another place."""

from __future__ import annotations

import cv2
import numpy as np

from airground.vision.frame import ImageArray

__all__ = ["SensorNoise"]

PLAY_PX = 128  # how far a bank can be moved in u and in v: 16,384 places
ROWS = 120  # noise is laid on so many at a time: what is in between stays in the processor's cache


class SensorNoise:
    """Gaussian noise in grey levels, and noise of photons whose variance grows with the light.

    Parameters
    ----------
    image_size_px : (int, int) [px]
        Width and height of the frames.
    dark : float
        Standard deviation everywhere: reading [grey levels].
    bright : float
        Standard deviation of what photons add in white [grey levels]. A pixel at half of white gets it in half of
        all frames, which is half of the variance.
    seed : int
        Of the banks and of their places.
    """

    def __init__(
        self, image_size_px: tuple[int, int], dark: float, bright: float, seed: int
    ) -> None:
        self._size = image_size_px
        self._seed = seed
        rng = np.random.default_rng([seed, 0x5E])
        shape = (image_size_px[1] + PLAY_PX, image_size_px[0] + PLAY_PX, 3)
        self._everywhere = _bank(rng, shape, dark)
        self._of_photons = _bank(rng, shape, bright)
        self._lot = (
            rng.integers(0, 255, shape, dtype=np.uint8) if self._of_photons is not None else None
        )

    def apply(self, image: ImageArray, index: int) -> None:
        """Lay the noise of one frame over it, in place.

        Parameters
        ----------
        image : (H, W, 3) array
            The frame.
        index : int
            Its number; the same number, the same noise.
        """
        rng = np.random.default_rng([self._seed, 0xF2, index])
        places = rng.integers(0, PLAY_PX, (3, 2)).tolist()
        if self._of_photons is not None:
            lot = self._cut(self._lot, places[0])
            plus, minus = (self._cut(half, places[1]) for half in self._of_photons)
            scratch = np.empty((2, min(ROWS, len(image)), *image.shape[1:]), dtype=np.uint8)
            for top in range(0, len(image), ROWS):
                rows = slice(top, top + ROWS)
                part = image[rows]
                hit, noise = scratch[0, : len(part)], scratch[1, : len(part)]
                cv2.compare(part, lot[rows], cv2.CMP_GT, dst=hit)
                cv2.bitwise_and(plus[rows], hit, dst=noise)
                cv2.add(part, noise, dst=part)
                cv2.bitwise_and(minus[rows], hit, dst=noise)
                cv2.subtract(part, noise, dst=part)
        if self._everywhere is not None:
            plus, minus = (self._cut(half, places[2]) for half in self._everywhere)
            cv2.add(image, plus, dst=image)
            cv2.subtract(image, minus, dst=image)

    def _cut(self, bank: ImageArray | None, place: list[int]) -> ImageArray:
        assert bank is not None
        top, left = place
        width, height = self._size
        return bank[top : top + height, left : left + width]


def _bank(
    rng: np.random.Generator, shape: tuple[int, int, int], sigma: float
) -> tuple[ImageArray, ImageArray] | None:
    """Brightening and darkening halves, as images of 8 bits have no sign; None for no noise."""
    if sigma <= 0:
        return None
    drawn = np.rint(rng.standard_normal(shape, dtype=np.float32) * sigma)
    return np.clip(drawn, 0, 255).astype(np.uint8), np.clip(-drawn, 0, 255).astype(np.uint8)
