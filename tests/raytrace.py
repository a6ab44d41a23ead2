"""An independent picture of a tag: one ray for each of many points of a pixel; for tests of the renderer."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
WHITE, BLACK = 232.0, 18.0


def cells_36h11(number: int) -> Floats:
    """(10, 10). 1 for white, with a white margin of one cell."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    upright = cv2.aruco.generateImageMarker(dictionary, number, 8, borderBits=1)
    return np.pad(np.asarray(upright, dtype=np.float64) / 255, 1, constant_values=1.0)


def tag_picture(
    *,
    focal_px: float,
    size_px: tuple[int, int],
    rotation: Floats,
    eye: Floats,
    k1_per_px2: float,
    height_m: float,
    pose: tuple[float, float, float],
    number: int,
    tag_m: float,
    window: tuple[int, int, int, int],
    samples: int = 12,
) -> Floats:
    """Mean over samples x samples rays a pixel; NaN for pixels that see anything but the tag and its margin.

    `window` is left, top, width, height.
    """
    left, top, width, height = window
    inner = (np.arange(samples) + 0.5) / samples - 0.5
    u = (left + np.arange(width)[:, None] + inner).ravel()
    v = (top + np.arange(height)[:, None] + inner).ravel()
    U, V = np.meshgrid(u - (size_px[0] - 1) / 2, v - (size_px[1] - 1) / 2)
    straight = 1 / (1 + k1_per_px2 * (U**2 + V**2))
    ray = np.stack([U * straight / focal_px, V * straight / focal_px, np.ones_like(U)], axis=-1)
    ray = ray @ rotation  # to the world
    far = (height_m - eye[2]) / ray[..., 2]
    x, y = eye[0] + far * ray[..., 0] - pose[0], eye[1] + far * ray[..., 1] - pose[1]
    ahead = np.cos(pose[2]) * x + np.sin(pose[2]) * y
    to_left = -np.sin(pose[2]) * x + np.cos(pose[2]) * y
    cell = tag_m / 8
    row = np.floor((tag_m / 2 - ahead) / cell).astype(int) + 1
    column = np.floor((tag_m / 2 - to_left) / cell).astype(int) + 1
    on = (row >= 0) & (row < 10) & (column >= 0) & (column < 10)
    ink = cells_36h11(number)[np.clip(row, 0, 9), np.clip(column, 0, 9)]
    grey = np.where(on, BLACK + (WHITE - BLACK) * ink, np.nan)
    return np.asarray(grey.reshape(height, samples, width, samples).mean(axis=(1, 3)))


def shift_px(seen: Floats, wanted: Floats) -> tuple[Floats, float]:
    """How far `seen` is moved against `wanted` (u, v), by least squares, and the rms of their difference."""
    by_row, by_column = np.gradient(wanted, axis=0), np.gradient(wanted, axis=1)
    good = np.isfinite(by_row) & np.isfinite(by_column) & np.isfinite(wanted)
    A = np.column_stack([by_column[good], by_row[good], wanted[good], np.ones(good.sum())])
    solution: Floats = np.linalg.lstsq(A, (seen - wanted)[good], rcond=None)[0]
    return np.asarray(-solution[:2], dtype=np.float64), float(
        np.sqrt(np.mean((seen - wanted)[good] ** 2))
    )
