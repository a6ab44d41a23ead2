"""The image that is worked on: grey, undistorted where the lens is known, and not larger than it need be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.geometry.lens import DivisionLens
from airground.vision.frame import Frame, ImageArray
from airground.vision.moving.small_motion import UNIT_PX, change_of_basis

__all__ = ["WorkingImage"]

Map = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class WorkingImage:
    """From frames to images to work on, and homographies back."""

    frame_size_px: tuple[int, int]
    """Width and height of frames [px]."""

    size_px: tuple[int, int]
    """Width and height of what is worked on [px]."""

    lens: DivisionLens | None
    """The camera's."""

    maps: tuple[Map, Map] | None
    """Where in the frame each pixel of the working image comes from, with a lens."""

    @classmethod
    def of(cls, size_px: tuple[int, int], largest_px: int, lens: DivisionLens | None) -> Self:
        """Make one for frames of a size.

        Parameters
        ----------
        size_px : (int, int) [px]
            Width and height of the frames.
        largest_px : int [px]
            Largest width of the working image.
        lens : DivisionLens or None
            The camera's.

        Returns
        -------
        working_image : WorkingImage
            For those.
        """
        share = min(1.0, largest_px / size_px[0])
        small = (round(size_px[0] * share), max(1, round(size_px[1] * share)))
        maps = None
        if lens is not None:
            plain = cls(size_px, small, None, None)
            v, u = np.mgrid[: small[1], : small[0]].astype(np.float64)
            flat = (np.stack([u, v], axis=-1) - plain.shift) / plain.factors
            raw = lens.distort(flat)
            raw[~np.isfinite(raw)] = -1e6
            maps = (raw[..., 0].astype(np.float32), raw[..., 1].astype(np.float32))
        return cls(size_px, small, lens, maps)

    @property
    def factors(self) -> FloatArray:
        """(2,). Working pixels to a pixel of the frame."""
        return np.asarray(np.array(self.size_px) / np.array(self.frame_size_px))

    @property
    def scale(self) -> float:
        """Working pixels to a pixel of the frame, in the mean."""
        return float(self.factors.mean())

    @property
    def shift(self) -> FloatArray:
        """(2,) [px]. Where the frame's pixel (0, 0) lies: its corner stays the corner, not its centre."""
        return np.asarray(0.5 * self.factors - 0.5)

    def image(self, frame: Frame) -> ImageArray:
        """The image to work on.

        Parameters
        ----------
        frame : Frame
            Of the size that was told.

        Returns
        -------
        grey : (H, W) array
            Of the working size.

        Raises
        ------
        InputError
            If the frame has another size.
        """
        if frame.size_px != self.frame_size_px:
            raise InputError(
                f"frame {frame.index} is {frame.size_px[0]}x{frame.size_px[1]} px, the ones before were "
                f"{self.frame_size_px[0]}x{self.frame_size_px[1]}; begin anew where the size changes"
            )
        image = frame.image
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        if self.maps is not None:
            if self.scale < 0.75:  # else single pixels of a larger image would be picked
                grey = cv2.blur(grey, (round(1 / self.scale),) * 2)
            grey = cv2.remap(grey, *self.maps, cv2.INTER_LINEAR)
        elif self.size_px != self.frame_size_px:
            grey = cv2.resize(grey, self.size_px, interpolation=cv2.INTER_AREA)
        return np.asarray(grey, dtype=np.uint8)

    def points(self, uv: FloatArray) -> FloatArray:
        """Points of the frame in the working image.

        Parameters
        ----------
        uv : (..., 2) array [px]
            Raw points.

        Returns
        -------
        uv : (..., 2) array [px]
            NaN where the lens's model ends.
        """
        flat = uv if self.lens is None else self.lens.undistort(uv)
        return np.asarray(flat * self.factors + self.shift)

    def outwards(self, matrix: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A homography between working images as one between (undistorted) frames.

        Parameters
        ----------
        matrix : (3, 3) array
            Between working images.
        covariance : (8, 8) array
            Its covariance.

        Returns
        -------
        matrix : (3, 3) array
            Between frames.
        covariance : (8, 8) array
            Its covariance.
        """
        work_from_frame = np.diag([*self.factors, 1.0])
        work_from_frame[:2, 2] = self.shift
        unit = np.diag([1 / UNIT_PX, 1 / UNIT_PX, 1.0])
        T = change_of_basis(unit @ np.linalg.inv(work_from_frame) @ np.linalg.inv(unit))
        outer = np.linalg.inv(work_from_frame) @ matrix @ work_from_frame
        return np.asarray(outer), np.asarray(T @ covariance @ T.T)
