"""Patches of an image as sightings: where their centre of area is, how long they are, which way they point.

Every pixel belongs to the patch by a share between 0 and 1, so that a border between pixels counts. The covariance
follows from how uncertain those shares are: noise everywhere, and more along the border.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Region", "components", "region_of"]

EDGE_SHARE = 0.2  # standard deviation of the share of a pixel on the border
CORRELATION_PX = 2.0  # over which neighbouring borders err alike
FLOOR_PX = 0.01
ELONGATED = 1.15  # longest over shortest half axis, from which a heading is told


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """A patch of the image."""

    uv: FloatArray
    """(2,) [px]. Centre of its area."""

    covariance: FloatArray
    """(2, 2) [px2]. Of that."""

    angle: float
    """Of its long axis [rad], from u towards v, between -pi/2 and pi/2; NaN where it is about round."""

    angle_sigma: float
    """Standard deviation of that [rad]; NaN where it is about round."""

    half_axes_px: tuple[float, float]
    """Half axes of the ellipse with the same second moments [px], the longer first."""

    outline: FloatArray
    """(4, 2) [px]. Rectangle along its axes that has the same second moments."""

    area_px2: float
    """Sum of the shares [px2]."""


def components(
    mask: NDArray[np.uint8], least_px2: float, most_px2: float
) -> list[tuple[slice, slice, NDArray[np.bool_]]]:
    """Connected patches of a mask.

    Parameters
    ----------
    mask : (H, W) array
        Non-zero inside.
    least_px2 : float
        The smallest area [px2].
    most_px2 : float
        The largest [px2].

    Returns
    -------
    patches : list of (slice, slice, array)
        Rows and columns of the box around each, and which pixels in it are the patch's; from the top down.
    """
    count, parts, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    found = []
    for k in range(1, count):
        left, top, width, height, area = (int(n) for n in stats[k])
        if least_px2 <= area <= most_px2:
            rows, columns = slice(top, top + height), slice(left, left + width)
            found.append((rows, columns, np.asarray(parts[rows, columns] == k)))
    return found


def region_of(
    share: FloatArray, left: int, top: int, noise: float, edge: float = EDGE_SHARE
) -> Region | None:
    """Centre, axes and covariance of a patch.

    Parameters
    ----------
    share : (h, w) array
        How much of each pixel is the patch's, 0 to 1; zeros along its border.
    left, top : int [px]
        Where the first pixel is in the image.
    noise : float
        Standard deviation of a share from noise.
    edge : float
        And that of a pixel on the border, from all else.

    Returns
    -------
    region : Region or None
        None where nothing is left.
    """
    mass = float(share.sum())
    if not mass > 0.5:
        return None
    u = left + np.arange(share.shape[1], dtype=np.float64)
    v = top + np.arange(share.shape[0], dtype=np.float64)
    mean = np.array([share.sum(axis=0) @ u, share.sum(axis=1) @ v]) / mass
    u, v = u - mean[0], v - mean[1]
    second = (
        np.array(
            [
                [share.sum(axis=0) @ u**2, v @ share @ u],
                [v @ share @ u, share.sum(axis=1) @ v**2],
            ]
        )
        / mass
    )
    second[[0, 1], [0, 1]] = np.maximum(second[[0, 1], [0, 1]], 1.0 / 12.0)
    # Border pixels: those whose share rises or falls within the next pixel.
    steep_u = 0.5 * cv2.Sobel(share, cv2.CV_64F, 1, 0, ksize=1)
    steep_v = 0.5 * cv2.Sobel(share, cv2.CV_64F, 0, 1, ksize=1)
    border = np.clip(2.0 * cv2.magnitude(steep_u, steep_v), 0.0, 1.0)
    variance = noise**2 * (share > 0) + (edge**2 * CORRELATION_PX) * border
    along_u, along_v = variance.sum(axis=0) @ u**2, variance.sum(axis=1) @ v**2
    both = v @ variance @ u
    covariance = np.array([[along_u, both], [both, along_v]]) / mass**2 + FLOOR_PX**2 * np.eye(2)
    spread, axes = np.linalg.eigh(second)
    short, long = (float(2.0 * np.sqrt(max(s, 1e-3))) for s in spread)
    angle = float(np.arctan(axes[1, 1] / axes[0, 1])) if axes[0, 1] else np.pi / 2
    sigma = np.nan
    direction, normal = axes[:, 1], axes[:, 0]
    if long > ELONGATED * short:
        p = u * direction[0] + v[:, None] * direction[1]
        q = u * normal[0] + v[:, None] * normal[1]
        sigma = (
            float(np.sqrt((variance * (p * q) ** 2).sum())) / mass / float(spread[1] - spread[0])
        )
    else:
        angle = np.nan
    half = np.sqrt(3.0) / 2.0 * np.array([long, short])  # of a uniform rectangle
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    outline = mean + corners @ np.array([direction, normal])
    return Region(mean, covariance, angle, sigma, (long, short), outline, mass)
