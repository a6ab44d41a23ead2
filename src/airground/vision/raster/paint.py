"""Painting into a small part of an image: polygons, layers with transparency, shadows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.vision.frame import ImageArray

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["average", "darken", "fill", "fixed_point", "hull", "lay_over", "soften"]

IntArray = NDArray[np.int32]

SHIFT = 4  # binary digits below the pixel that fillConvexPoly takes


def fixed_point(points: FloatArray) -> IntArray:
    """Round points for `fill`.

    Parameters
    ----------
    points : (..., 2) array
        In samples of a canvas.

    Returns
    -------
    fixed : (..., 2) array of int32
        In sixteenths of a sample.
    """
    return np.rint(np.clip(points, -1e5, 1e5) * (1 << SHIFT)).astype(np.int32)


def fill(canvas: ImageArray, polygon: IntArray, colour: tuple[int, ...]) -> None:
    """Fill a convex polygon, without smooth edges: draw on a finer grid and shrink it.

    Parameters
    ----------
    canvas : (H, W[, C]) array
        Painted on.
    polygon : (N, 2) array of int32
        Corners, by `fixed_point`.
    colour : tuple of int
        One entry a channel.
    """
    cv2.fillConvexPoly(canvas, polygon, colour, cv2.LINE_8, SHIFT)


def hull(points: IntArray) -> IntArray:
    """Convex hull.

    Parameters
    ----------
    points : (N, 2) array of int32
        At least one.

    Returns
    -------
    corners : (M, 2) array of int32
        In order around it.
    """
    return np.asarray(cv2.convexHull(points)[:, 0], dtype=np.int32)


def lay_over(below: ImageArray, layer: ImageArray) -> None:
    """Lay a layer with transparency over an image, in place.

    Parameters
    ----------
    below : (H, W, 3) or (H, W, 4) array
        Painted on.
    layer : (H, W, 4) array
        Blue, green and red times the opacity, then the opacity.
    """
    clear = cv2.bitwise_not(layer[..., 3])
    channels = below.shape[2]
    if channels == 4:
        shown = cv2.multiply(below, cv2.merge((clear, clear, clear, clear)), scale=1 / 255)
        cv2.add(shown, layer, dst=below)
    else:
        shown = cv2.multiply(below, cv2.merge((clear, clear, clear)), scale=1 / 255)
        cv2.add(shown, cv2.cvtColor(layer, cv2.COLOR_BGRA2BGR), dst=below)


def darken(image: ImageArray, mask: ImageArray, strength: float) -> None:
    """Take light away, in place.

    Parameters
    ----------
    image : (H, W, 3) array
        Painted on.
    mask : (H, W) array
        255 where it is darkest.
    strength : float
        Share of the light taken there, 0 to 1.
    """
    left = cv2.convertScaleAbs(mask, alpha=-strength, beta=255)
    cv2.multiply(image, cv2.merge((left, left, left)), dst=image, scale=1 / 255)


def soften(mask: ImageArray, radius_px: float) -> ImageArray:
    """Blur, as the sun's disc and the sky blur a shadow's edge.

    Parameters
    ----------
    mask : (H, W) array
        What to blur.
    radius_px : float [px]
        Standard deviation; 0 leaves it as it is.

    Returns
    -------
    mask : (H, W) array
        Blurred.
    """
    if radius_px <= 0:
        return mask
    side = 2 * round((np.sqrt(6 * radius_px**2 + 1) - 1) / 2) + 1  # two boxes have that variance
    return np.asarray(cv2.blur(cv2.blur(mask, (side, side)), (side, side)), dtype=np.uint8)


def average(layers: list[ImageArray]) -> ImageArray:
    """Mean of some images, rounded.

    Parameters
    ----------
    layers : list of (H, W[, C]) arrays
        At least one, of one shape.

    Returns
    -------
    image : (H, W[, C]) array
        Their mean.
    """
    if len(layers) == 1:
        return layers[0]
    total = np.zeros(layers[0].shape, dtype=np.float32)
    for layer in layers:
        cv2.accumulate(layer, total)
    return np.asarray(cv2.convertScaleAbs(total, alpha=1 / len(layers)), dtype=np.uint8)
