"""Noise of a camera's sensor: drawn once, laid over each frame from another place."""

from __future__ import annotations

import cv2
import numpy as np

from airground.vision.frame import ImageArray

__all__ = ["SensorNoise"]

PLAY_PX = 128  # how far the bank can be moved in u and in v: 16,384 places for each bank
BANKS = 1  # more would not stay in the processor's cache


class SensorNoise:
    """Gaussian noise in grey levels, of one strength in the dark and stronger by steps in the light.

    Parameters
    ----------
    image_size_px : (int, int) [px]
        Width and height of the frames.
    dark : float
        Standard deviation everywhere: reading [grey levels].
    bright : float
        What photons add in white [grey levels]; half of the variance from a third of the scale on, all from two thirds.
    seed : int
        Of the banks and of their places.
    """

    def __init__(
        self, image_size_px: tuple[int, int], dark: float, bright: float, seed: int
    ) -> None:
        self._size = image_size_px
        self._seed = seed
        rng = np.random.default_rng([seed, 0x5E])
        self._everywhere = _bank(rng, image_size_px, dark)
        self._in_light = _bank(rng, image_size_px, bright / np.sqrt(2))

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
        plan = [(self._in_light, 85), (self._in_light, 170), (self._everywhere, None)]
        lights = [
            None if level is None or not bank else cv2.threshold(image, level, 255, 0)[1]
            for bank, level in plan
        ]
        for (bank, _), light in zip(plan, lights, strict=True):
            if not bank:
                continue
            plus, minus = self._cut(bank, rng)
            if light is not None:
                plus = np.asarray(cv2.bitwise_and(plus, light), dtype=np.uint8)
                minus = np.asarray(cv2.bitwise_and(minus, light), dtype=np.uint8)
            cv2.add(image, plus, dst=image)
            cv2.subtract(image, minus, dst=image)

    def _cut(
        self, bank: list[tuple[ImageArray, ImageArray]], rng: np.random.Generator
    ) -> tuple[ImageArray, ImageArray]:
        which, top, left = rng.integers(0, [len(bank), PLAY_PX, PLAY_PX])
        width, height = self._size
        window = np.s_[top : top + height, left : left + width]
        return bank[which][0][window], bank[which][1][window]


def _bank(
    rng: np.random.Generator, size: tuple[int, int], sigma: float
) -> list[tuple[ImageArray, ImageArray]]:
    """Brightening and darkening halves, as images of 8 bits have no sign."""
    if sigma <= 0:
        return []
    made = []
    for _ in range(BANKS):
        shape = (size[1] + PLAY_PX, size[0] + PLAY_PX, 3)
        drawn = np.rint(rng.standard_normal(shape, dtype=np.float32) * sigma)
        made.append(
            (np.clip(drawn, 0, 255).astype(np.uint8), np.clip(-drawn, 0, 255).astype(np.uint8))
        )
    return made
