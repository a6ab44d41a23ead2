"""What a robot has been asked to do, drawn into the camera's image: sketch, path with speeds, goals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.vision.frame import ImageArray

__all__ = ["draw_goal", "draw_path"]

SHIFT = 4  # cv2 takes coordinates in sixteenths of a pixel
FAR = 2**14  # beyond, cv2's fixed point overflows
WHITE = (255, 255, 255)
SLOW, FAST = np.array([60.0, 120, 250]), np.array([120.0, 220, 60])  # blue, green, red


def draw_path(
    image: ImageArray, uv: FloatArray, share: FloatArray | None = None, *, width: int = 2
) -> None:
    """Draw a path into an image, from orange where it is slow to green where it is fast.

    Parameters
    ----------
    image : (H, W, 3) array of uint8
        Drawn into.
    uv : (N, 2) array [px]
        Points of the path; NaN where there is none.
    share : (N,) array, optional
        Speed at each point over the fastest, 0 to 1; white where not given.
    width : int [px]
        Of the line.
    """
    good = np.asarray((np.abs(uv) < FAR).all(axis=1))  # NaN compares as False
    points = np.rint(np.where(good[:, None], uv, 0.0) * 2**SHIFT).astype(np.int32)
    for k in range(len(uv) - 1):
        if not (good[k] and good[k + 1]):
            continue
        colour = WHITE
        if share is not None:
            mixed = SLOW + float(np.clip(share[k], 0, 1)) * (FAST - SLOW)
            colour = (int(mixed[0]), int(mixed[1]), int(mixed[2]))
        cv2.line(
            image, points[k].tolist(), points[k + 1].tolist(), colour, width, cv2.LINE_AA, SHIFT
        )


def draw_goal(image: ImageArray, uv: FloatArray, *, reached: bool = False) -> None:
    """Draw a clicked goal into an image: a ring with a cross, filled once it is reached.

    Parameters
    ----------
    image : (H, W, 3) array of uint8
        Drawn into.
    uv : (2,) array [px]
        Where it is; nothing is drawn far outside.
    reached : bool
        Whether the robot has been there.
    """
    if not bool((np.abs(uv) < FAR).all()):
        return
    u, v = (int(x) for x in np.rint(uv * 2**SHIFT))
    colour = (120, 220, 60) if reached else WHITE
    cv2.circle(image, (u, v), 9 << SHIFT, colour, 2, cv2.LINE_AA, SHIFT)
    for du, dv in ((14, 0), (0, 14)):
        a, b = (u - (du << SHIFT), v - (dv << SHIFT)), (u + (du << SHIFT), v + (dv << SHIFT))
        cv2.line(image, a, b, colour, 1, cv2.LINE_AA, SHIFT)
