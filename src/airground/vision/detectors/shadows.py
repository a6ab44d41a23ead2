"""What differs from the background and is no thing: shadows, and holes in the background."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.vision.frame import ImageArray

__all__ = ["is_ghost", "without_shadow"]

DIMMED = (0.4, 0.93)  # brightness in a shadow over that in light
SAME_COLOUR = 0.045  # change of a channel's share of the whole
LEAST_SHADOW = 0.08  # of the inside of a patch
LEAST_CORE = 0.25  # of a patch: a grey thing on grey ground looks all shadow


def without_shadow(
    image: ImageArray, background: ImageArray, patch: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Take the shadow off a patch: ground that is dimmer but has kept its colour.

    Parameters
    ----------
    image : (h, w) or (h, w, 3) array
        What is seen.
    background : array of the same shape
        What is behind it.
    patch : (h, w) array of bool
        Where they differ.

    Returns
    -------
    thing : (h, w) array of bool
        The patch itself where the image is grey, or where hardly anything would be left: then the thing may have the
        colour of its shadow.
    """
    if image.ndim == 2:
        return patch
    now, before = image.astype(np.float32), background.astype(np.float32)
    channels = range(3)  # one by one: sums along a short last axis are slow
    total_now = now[..., 0] + now[..., 1] + now[..., 2] + 1.0
    total_before = before[..., 0] + before[..., 1] + before[..., 2] + 1.0
    ratio = total_now / total_before
    shares = [np.abs(now[..., c] / total_now - before[..., c] / total_before) for c in channels]
    colour = np.maximum(np.maximum(shares[0], shares[1]), shares[2])
    # In the dark a grey level of noise is a large share.
    shadow = (ratio > DIMMED[0]) & (ratio < DIMMED[1])
    shadow &= colour < SAME_COLOUR + 6.0 / total_now
    # The rim of a dark thing is a mixture that looks like shadow; a shadow has an inside.
    inner = cv2.erode(patch.astype(np.uint8), np.ones((5, 5), dtype=np.uint8)) > 0
    if shadow[inner].sum() < LEAST_SHADOW * max(int(inner.sum()), 1):
        return patch
    core = (patch & ~shadow).astype(np.uint8)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    core = np.asarray(cv2.morphologyEx(core, cv2.MORPH_OPEN, kernel), dtype=np.uint8)
    if core.sum() < LEAST_CORE * patch.sum():
        return patch
    wide = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (7, 7))
    core = np.asarray(cv2.morphologyEx(core, cv2.MORPH_CLOSE, wide), dtype=np.uint8)
    count, parts, stats, _ = cv2.connectedComponentsWithStats(core, connectivity=8)
    if count > 2:  # the thing itself, without flecks in its shadow
        core = (parts == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))).astype(np.uint8)
    return (core > 0) & patch


def is_ghost(image: ImageArray, background: ImageArray, patch: NDArray[np.bool_]) -> bool:
    """Whether a patch is ground laid bare by a thing that had been learned as background.

    A thing has its outline in the image; a ghost has it in the background only.

    Parameters
    ----------
    image : (h, w) or (h, w, 3) array
        What is seen.
    background : array of the same shape
        What was learned.
    patch : (h, w) array of bool
        Where they differ.

    Returns
    -------
    ghost : bool
        Whether the outline is much stronger in the background.
    """
    mask = patch.astype(np.uint8)
    kernel = np.ones((5, 5), dtype=np.uint8)
    rim = (cv2.dilate(mask, kernel) > 0) & ~(cv2.erode(mask, kernel) > 0)
    now, before = _steepness(image)[rim], _steepness(background)[rim]
    if not len(now):
        return False
    return float(before.mean()) > 2.0 * float(now.mean()) and float(before.mean()) > 12.0


def _steepness(image: ImageArray) -> NDArray[np.float32]:
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    u = cv2.Sobel(grey, cv2.CV_32F, 1, 0, ksize=3)
    v = cv2.Sobel(grey, cv2.CV_32F, 0, 1, ksize=3)
    return np.asarray(cv2.magnitude(u, v))
