"""The stable frame as an image, for detectors that compare a frame with the frames before it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.vision.detectors.moving import MovingDetector
from airground.vision.frame import Frame
from airground.vision.sightings import Sightings

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.vision.detectors.protocol import Detector
    from airground.vision.moving import Stabilization

__all__ = ["StillView"]

MARGIN = 0.25  # of the first image, on each side: so far around it the stable frame is looked at


class StillView:
    """Lets a detector of moving things look at the stable frame: the first image and a margin around it.

    Parameters
    ----------
    detector : Detector
        Any; one that does not compare frames does not need this.
    """

    def __init__(self, detector: Detector) -> None:
        self._detector = detector
        self._size: tuple[int, int] | None = None
        self._canvas_from_stable: FloatArray = np.eye(3)

    @property
    def needed(self) -> bool:
        """Whether the detector compares frames."""
        return isinstance(self._detector, MovingDetector)

    def detect(self, frame: Frame, stabilization: Stabilization) -> Sightings:
        """Find what moves over the ground.

        Parameters
        ----------
        frame : Frame
            What the moving camera saw.
        stabilization : Stabilization
            Its place.

        Returns
        -------
        sightings : Sightings
            In the stable frame, with the homography's covariance; none where the place is not known.
        """
        assert isinstance(self._detector, MovingDetector)
        if stabilization.stable_from_image is None:
            return Sightings.none(frame.t)
        if self._size is None:
            self._start(frame)
        assert self._size is not None
        H = self._canvas_from_stable @ stabilization.stable_from_image
        warped = cv2.warpPerspective(frame.image, H, self._size, flags=cv2.INTER_LINEAR)
        width, height = frame.size_px
        inner = np.full((height, width), 255, dtype=np.uint8)
        inner[[0, 1, -2, -1]] = inner[:, [0, 1, -2, -1]] = (
            0  # the border is half interpolated with nothing
        )
        valid = cv2.warpPerspective(inner, H, self._size, flags=cv2.INTER_NEAREST) > 0
        canvas = replace(frame, image=np.asarray(warped, dtype=np.uint8))
        found = self._detector.detect(canvas, valid)
        if len(found) == 0:
            return found
        shift = -self._canvas_from_stable[:2, 2]
        uv = found.uv + shift
        image = self._back(stabilization.stable_from_image, uv)
        return replace(
            found,
            uv=uv,
            outline=found.outline + shift,
            covariance=found.covariance + stabilization.point_covariance(image),
        )

    def outlines(self, sightings: Sightings, stabilization: Stabilization) -> FloatArray:
        """Where things of the stable frame cover the image.

        Parameters
        ----------
        sightings : Sightings
            In the stable frame.
        stabilization : Stabilization
            Place of the image.

        Returns
        -------
        outlines : (K, 4, 2) array [px]
            In the image; things without an outline are left out.
        """
        known = sightings.outline[np.isfinite(sightings.outline).all(axis=(1, 2))]
        if stabilization.stable_from_image is None or len(known) == 0:
            return np.empty((0, 4, 2))
        return self._back(stabilization.stable_from_image, known.reshape(-1, 2)).reshape(-1, 4, 2)

    def _start(self, frame: Frame) -> None:
        width, height = frame.size_px
        left, top = round(MARGIN * width), round(MARGIN * height)
        self._size = (width + 2 * left, height + 2 * top)
        self._canvas_from_stable = np.array([[1.0, 0.0, left], [0.0, 1.0, top], [0.0, 0.0, 1.0]])

    @staticmethod
    def _back(stable_from_image: FloatArray, uv: FloatArray) -> FloatArray:
        H = np.linalg.inv(stable_from_image)
        w = uv @ H[:, :2].T + H[:, 2]
        return np.asarray(w[:, :2] / w[:, 2:])
