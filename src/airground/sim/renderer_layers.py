"""Small parts of an image, and small pictures with transparency that go there."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, isfinite

from airground.geometry.arrays import FloatArray
from airground.vision.frame import ImageArray

__all__ = ["Layer", "Window"]

MARGIN_PX = 2.0


@dataclass(frozen=True, slots=True)
class Window:
    """Part of an image."""

    left: int
    """First column [px]."""

    top: int
    """First row [px]."""

    width: int
    """Columns [px]."""

    height: int
    """Rows [px]."""

    @classmethod
    def around(
        cls, uv: FloatArray, image_size_px: tuple[int, int], margin_px: float = MARGIN_PX
    ) -> Window | None:
        """Give the smallest window that holds points.

        Parameters
        ----------
        uv : (N, 2) array [px]
            The points.
        image_size_px : (int, int) [px]
            Of the image that it is cut from.
        margin_px : float [px]
            To keep around them.

        Returns
        -------
        window : Window or None
            None where nothing of it is in the image, or a point is behind the camera.
        """
        left, top = uv.min(axis=0).tolist()
        right, bottom = uv.max(axis=0).tolist()
        return cls.of_box((left, top, right, bottom), image_size_px, margin_px)

    @classmethod
    def of_box(
        cls,
        box: tuple[float, float, float, float],
        image_size_px: tuple[int, int],
        margin_px: float = MARGIN_PX,
    ) -> Window | None:
        """Give the smallest window that holds a box.

        Parameters
        ----------
        box : (float, float, float, float) [px]
            Left, top, right, bottom.
        image_size_px : (int, int) [px]
            Of the image that it is cut from.
        margin_px : float [px]
            To keep around it.

        Returns
        -------
        window : Window or None
            None where nothing of it is in the image, or a number is not finite.
        """
        if not all(map(isfinite, box)):
            return None
        left, top = max(floor(box[0] - margin_px), 0), max(floor(box[1] - margin_px), 0)
        right = min(ceil(box[2] + margin_px) + 1, image_size_px[0])
        bottom = min(ceil(box[3] + margin_px) + 1, image_size_px[1])
        if right <= left or bottom <= top:
            return None
        return cls(left, top, right - left, bottom - top)

    def of(self, image: ImageArray) -> ImageArray:
        """Cut it out.

        Parameters
        ----------
        image : (H, W[, C]) array
            The image.

        Returns
        -------
        part : (height, width[, C]) array
            A view.
        """
        return image[self.top : self.top + self.height, self.left : self.left + self.width]

    def meets(self, other: Window) -> bool:
        """Tell whether two windows share pixels.

        Parameters
        ----------
        other : Window
            The other one.

        Returns
        -------
        meets : bool
            Do they?
        """
        return (
            self.left < other.left + other.width
            and other.left < self.left + self.width
            and self.top < other.top + other.height
            and other.top < self.top + self.height
        )


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """A picture with transparency, and where it goes."""

    window: Window
    """Where."""

    picture: ImageArray
    """(height, width, 4). Colours times the opacity, then the opacity."""
