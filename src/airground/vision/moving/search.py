"""The robust search for a homography by OpenCV, which may find none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["search_homography"]


def search_homography(
    source: FloatArray, target: FloatArray, threshold_px: float, *, iterations: int = 3000
) -> tuple[FloatArray, int] | None:
    """Find a homography that many matches follow; the same for the same matches.

    Parameters
    ----------
    source : (N, 2) array [px]
        Points in one image.
    target : (N, 2) array [px]
        The same in the other.
    threshold_px : float [px]
        Largest deviation in the target.
    iterations : int
        Most samples that are tried.

    Returns
    -------
    found : (H, count) or None
        Target from source, and how many follow it; None where there is nothing.
    """
    if len(source) < 4:
        return None
    answer: tuple[Any, Any] = cv2.findHomography(
        source,
        target,
        cv2.USAC_MAGSAC,  # not RHO, which depends on the moment
        threshold_px,
        maxIters=iterations,
        confidence=0.9999,
    )
    H, inliers = answer
    if H is None or inliers is None or np.shape(H) != (3, 3) or not np.isfinite(H).all():
        return None
    return np.asarray(H, dtype=np.float64), int(np.sum(inliers))
