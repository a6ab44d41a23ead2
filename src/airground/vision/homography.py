"""A homography of points by OpenCV: what others would do, for comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from airground.geometry.arrays import FloatArray, points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["find_homography"]

LEAST = 4  # points


def find_homography(xy: ArrayLike, uv: ArrayLike) -> FloatArray | None:
    """Fit a homography to pairs of points, by OpenCV's findHomography and least squares.

    Parameters
    ----------
    xy : (N, 2) array_like [m]
        Points on the ground.
    uv : (N, 2) array_like [px]
        Where each is seen.

    Returns
    -------
    image_from_ground : (3, 3) array or None
        None where OpenCV gives none, or there are fewer than four points.
    """
    import cv2

    ground, image = points(xy, "xy"), points(uv, "uv")
    if len(ground) < LEAST:
        return None
    try:
        matrix: Any = cv2.findHomography(ground, image, 0)[0]  # None too, whatever its types say
    except cv2.error:
        return None
    return None if matrix is None else np.asarray(matrix, dtype=np.float64)
