"""Lights: small bright points, whatever lies behind them.

A light is brighter than all that is within a few of its diameters; large bright areas are no lights. Any colour counts,
as the brightest channel is looked at. Lights carry no labels: `constellation` groups them into vehicles.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.errors import InputError
from airground.vision.detectors.spot_fit import fit_spots
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.vision.frame import Frame, ImageArray

__all__ = ["LedDetector"]

FLOOR_PX = 0.01
LEAST_CORRELATION = 0.85  # with a Gaussian
HIGHER = 1.5  # steps of the threshold
ROUND = 3.0  # longest over shortest extent; a reflection along an edge is longer
WIDTH = 3.5  # of a light as it is seen, over the deviation of its Gaussian
NOISE = 7.0  # standard deviations that a light stands out


class LedDetector:
    """Finds lights.

    Parameters
    ----------
    least_contrast : float
        How much brighter than its surroundings a light is [grey levels].
    most_size_px : float
        The largest diameter [px].
    most : int
        How many to give at most; the strongest.
    """

    def __init__(
        self, *, least_contrast: float = 40.0, most_size_px: float = 25.0, most: int = 64
    ) -> None:
        if not 0 < least_contrast < 255:
            raise InputError(f"least_contrast must lie between 0 and 255, not {least_contrast}")
        if not 2 <= most_size_px <= 500:
            raise InputError(f"most_size_px must lie between 2 and 500, not {most_size_px}")
        if most < 1:
            raise InputError(f"most must be 1 or more, not {most}")
        self._least_contrast = least_contrast
        self._most_size_px = most_size_px
        self._most = most
        side = 2 * int(np.ceil(0.75 * most_size_px)) + 1
        self._kernel = cv2.getStructuringElement(cv2.MORPH_RECT, (side, side))

    def detect(self, frame: Frame) -> Sightings:
        """Find the lights in a frame.

        Parameters
        ----------
        frame : Frame
            The next frame.

        Returns
        -------
        sightings : Sightings
            Without labels, the strongest first; the outline is a square of four standard deviations.
        """
        grey = _brightest(frame.image)
        top = cv2.morphologyEx(grey, cv2.MORPH_TOPHAT, self._kernel)
        raised = np.asarray(top, dtype=np.uint8)
        level = max(self._least_contrast, NOISE * _noise(grey))
        uv, radius, contrast = self._candidates(raised, level)
        if not len(uv):
            return Sightings.none(frame.t)
        fits = fit_spots(grey, uv, radius)
        keep = fits.good & (WIDTH * fits.sigma_px < self._most_size_px)
        keep &= (fits.peak >= 0.7 * self._least_contrast) & (fits.correlation >= LEAST_CORRELATION)
        for k in np.flatnonzero(
            keep
        ):  # fragments of one light end at one place; the strongest is first
            apart = np.hypot(*(fits.uv[:k] - fits.uv[k]).T)
            keep[k] = not (keep[:k] & (apart < np.maximum(fits.sigma_px[:k], 1.5))).any()
        uv, sigma = fits.uv[keep], fits.sigma_px[keep]
        square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        return Sightings(
            frame.t,
            uv,
            fits.covariance[keep] + FLOOR_PX**2 * np.eye(2),
            score=np.clip(contrast[keep] / (2.0 * level), 0.0, 1.0),
            outline=uv[:, None, :] + 2.0 * sigma[:, None, None] * square,
        )

    def _candidates(
        self, raised: ImageArray, level: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rough places, radii and contrasts of what is small, round and bright; the strongest first."""
        found: list[tuple[float, float, float, float, float]] = []
        todo = [(0, 0, raised, level)]
        while todo:
            left, top, part, threshold = todo.pop()
            mask = (part >= threshold).astype(np.uint8)
            _, _, stats, centres = cv2.connectedComponentsWithStats(mask, connectivity=8)
            for box, centre in zip(stats[1:].tolist(), centres[1:].tolist(), strict=True):
                u, v, width, height, area = box
                patch = part[v : v + height, u : u + width]
                peak = float(patch.max()) if area > 1 else 0.0
                if area > 1 and self._is_light(width, height, area):
                    strength = peak * np.sqrt(area)
                    place = left + centre[0], top + centre[1]
                    found.append((-strength, *place, np.sqrt(area / np.pi), peak))
                elif min(width, height) > 2 and threshold < 250 and peak > HIGHER * threshold:
                    # A light on something bright: it stands out from that, too.
                    todo.append((left + u, top + v, patch, HIGHER * threshold))
        rows = np.array(sorted(found)[: self._most]).reshape(-1, 5)
        return rows[:, 1:3], rows[:, 3], rows[:, 4]

    def _is_light(self, width: int, height: int, area: int) -> bool:
        return (
            max(width, height) <= self._most_size_px
            and max(width, height) <= ROUND * max(min(width, height), 1.5)
            and area >= 0.4 * width * height
        )


def _brightest(image: ImageArray) -> ImageArray:
    """The brightest channel: a red light is bright too."""
    if image.ndim == 2:
        return image
    blue, green, red = cv2.split(image)
    return np.asarray(cv2.max(cv2.max(blue, green), red), dtype=np.uint8)


def _noise(grey: ImageArray) -> float:
    """Of the camera [grey levels], by neighbouring pixels."""
    part = grey[::4].astype(np.int16)
    steps = np.abs(part[:, 1::4] - part[:, :-1:4][:, : part[:, 1::4].shape[1]])
    return 1.4826 * float(np.median(steps)) / np.sqrt(2.0) if steps.size else 0.0
