"""Coloured patches: things of one colour that nothing else in view has.

A position is the centre of the patch's area. A heading is that of its long axis, known up to half a turn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.errors import InputError
from airground.vision.detectors.images import colour_of
from airground.vision.detectors.regions import Region, components, region_of
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.vision.frame import Frame, ImageArray

__all__ = ["COLOURS", "BlobDetector"]

COLOURS: dict[str, tuple[float, float]] = {
    "red": (340.0, 15.0),
    "orange": (15.0, 42.0),
    "yellow": (42.0, 70.0),
    "green": (75.0, 165.0),
    "cyan": (165.0, 200.0),
    "blue": (200.0, 262.0),
    "magenta": (285.0, 340.0),
}
"""Hues by name: from and to [deg], red is 0, green 120, blue 240."""

MARGIN_PX = 3  # where shares fall to nothing


class BlobDetector:
    """Finds patches of one colour.

    Parameters
    ----------
    color : str
        A name in `COLOURS`, or two hues such as ``200-260`` [deg], which may pass through 360.
    least_size_px : float
        Smallest diameter [px].
    most_size_px : float
        Largest diameter [px].
    single : bool
        There is one such thing: only the largest patch is given, and the colour is its label.
    least_saturation : float
        Between 0 (grey) and 1.
    least_brightness : float
        Between 0 (black) and 1.
    """

    def __init__(
        self,
        color: str = "red",
        *,
        least_size_px: float = 5.0,
        most_size_px: float = 400.0,
        single: bool = False,
        least_saturation: float = 0.35,
        least_brightness: float = 0.15,
    ) -> None:
        self.color = color.strip().lower()
        self._hues = _hues(self.color)
        self._single = single
        if not 1 <= least_size_px <= most_size_px:
            raise InputError(
                f"sizes must be 1 or more and in order, not {least_size_px} and {most_size_px}"
            )
        for name, value in (("saturation", least_saturation), ("brightness", least_brightness)):
            if not 0 <= value <= 1:
                raise InputError(f"least_{name} must lie between 0 and 1, not {value}")
        self._least_px2 = np.pi / 4 * least_size_px**2
        self._most_px2 = np.pi / 4 * most_size_px**2
        self._floor = (round(255 * least_saturation), round(255 * least_brightness))

    def detect(self, frame: Frame) -> Sightings:
        """Find the patches in a frame.

        Parameters
        ----------
        frame : Frame
            The next frame, in colour; a grey one has no colours, and nothing is found.

        Returns
        -------
        sightings : Sightings
            From the top down. Without headings where a patch is about round.
        """
        if frame.image.ndim == 2:
            return Sightings.none(frame.t)
        image = colour_of(frame)
        mask = self._mask(image)
        found = [
            region
            for rows, columns, patch in components(mask, self._least_px2, self._most_px2)
            if (region := _refined(image, mask, rows, columns, patch)) is not None
        ]
        if not found:
            return Sightings.none(frame.t)
        if self._single:
            found = [max(found, key=lambda region: region.area_px2)]
        return Sightings(
            frame.t,
            np.array([region.uv for region in found]),
            np.array([region.covariance for region in found]),
            (self.color if self._single else "",) * len(found),
            np.array([region.angle for region in found]),
            np.array([region.angle_sigma for region in found]),
            np.ones(len(found)),
            np.array([region.outline for region in found]),
        )

    def _mask(self, image: ImageArray) -> NDArray[np.uint8]:
        hsv = cv2.cvtColor(cv2.GaussianBlur(image, (3, 3), 0), cv2.COLOR_BGR2HSV)  # hue / 2
        low, high = self._hues[0] / 2, self._hues[1] / 2
        saturation, brightness = self._floor
        ranges = [(low, high)] if low <= high else [(low, 180.0), (0.0, high)]
        mask = np.zeros(image.shape[:2], dtype=np.uint8)
        for a, b in ranges:
            part = cv2.inRange(
                hsv, np.array([a, saturation, brightness]), np.array([b, 255.0, 255.0])
            )
            mask = np.asarray(cv2.bitwise_or(mask, part), dtype=np.uint8)
        kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
        mask = np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, kernel), dtype=np.uint8)
        return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, kernel), dtype=np.uint8)


def _hues(color: str) -> tuple[float, float]:
    if color in COLOURS:
        return COLOURS[color]
    low, dash, high = color.partition("-")
    try:
        hues = float(low), float(high)
    except ValueError:
        hues = (-1.0, -1.0)
    if not dash or not all(0 <= hue <= 360 for hue in hues):
        raise InputError(
            f"color must be one of {', '.join(COLOURS)}, or two hues such as 200-260, not {color!r}"
        )
    return hues


def _refined(
    image: ImageArray,
    mask: NDArray[np.uint8],
    rows: slice,
    columns: slice,
    patch: NDArray[np.bool_],
) -> Region | None:
    """A patch with soft borders: between the colour inside and that around it."""
    top, left = max(rows.start - MARGIN_PX, 0), max(columns.start - MARGIN_PX, 0)
    bottom, right = rows.stop + MARGIN_PX, columns.stop + MARGIN_PX
    part = image[top:bottom, left:right].astype(np.float64)
    inside = np.zeros(part.shape[:2], dtype=np.uint8)
    inside[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left] = patch
    others = mask[top:bottom, left:right].astype(bool) & (inside == 0)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    core = cv2.erode(inside, kernel).astype(bool)
    core = core if core.sum() >= 4 else inside.astype(bool)
    near = cv2.dilate(inside, kernel, iterations=2).astype(bool) & ~others
    ring = cv2.dilate(inside, kernel, iterations=MARGIN_PX).astype(bool) & ~near & ~others
    if ring.sum() < 4:
        return region_of(inside.astype(np.float64), left, top, 0.0)
    colour, ground = np.median(part[core], axis=0), np.median(part[ring], axis=0)
    step = colour - ground
    length = float(step @ step)
    if length < 100.0:
        return region_of(inside.astype(np.float64), left, top, 0.0)
    share = np.clip((part - ground) @ step / length, 0.0, 1.0)
    share[core] = 1.0
    share[~near] = 0.0
    noise = float(np.std((part[ring] - ground) @ step / length))
    return region_of(share, left, top, min(noise, 0.5), edge=0.03 + 0.2 * min(noise, 0.5))
