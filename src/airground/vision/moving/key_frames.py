"""Frames that are kept, to compare later ones with: how much they share with a frame, and the comparison."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray
from airground.vision.frame import ImageArray
from airground.vision.moving.features import WINDOW, Descriptors, follow
from airground.vision.moving.fit_types import HomographyFit, NoiseScale, may_be_chance
from airground.vision.moving.homography import fit_homography
from airground.vision.moving.small_motion import apply_homography, homography_jacobian, relative

__all__ = ["Demands", "KeyFrame", "Registration", "register", "shared_view"]

FOLLOW_SIGMA_PX = 0.1
FLOOR_PX = 0.01  # what following makes wrong in all points alike, by interpolation: no number of points averages it
STRAIGHT_PX = 0.15  # a window whose edge is turned or stretched less is compared as it is
NEAR_PX = 2.0  # further off the guess than this, points are followed again from a better one
LEAST_SCALE, MOST_SCALE = 0.5, 2.0


@dataclass(frozen=True, slots=True, eq=False)
class KeyFrame:
    """A frame that is kept."""

    index: int
    """Of the frame it was."""

    image: ImageArray
    """(H, W). Grey."""

    uv: FloatArray
    """(N, 2) [px]. Its features."""

    descriptors: Descriptors
    """To know it again."""


@dataclass(frozen=True, slots=True)
class Demands:
    """What it takes to believe a comparison."""

    least: int = 12
    """Points that must agree."""

    least_share: float = 0.3
    """Share of the followed points that must."""

    scale: float = 1.0
    """Usual deviation of a followed point, in terms of what is expected."""


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """How a frame lies to a key frame."""

    fit: HomographyFit
    """Key from image, or why not; its rows are the points that could be followed."""

    uv: FloatArray
    """(M, 2) [px]. Those points in the frame."""

    covariance: FloatArray
    """(8, 8). Of the homography, with what all points have in common; empty where there is none."""

    asked: int
    """How many of the key frame's features should be in view."""


def shared_view(key_from_image: FloatArray, size_px: tuple[int, int]) -> float:
    """Share of a frame that a key frame shows at a like scale.

    Parameters
    ----------
    key_from_image : (3, 3) array
        Frame to key frame.
    size_px : (int, int) [px]
        Width and height of both.

    Returns
    -------
    share : float
        0 to 1.
    """
    width, height = size_px
    u, v = np.meshgrid((np.arange(8) + 0.5) / 8 * width, (np.arange(6) + 0.5) / 6 * height)
    uv = np.column_stack([u.ravel(), v.ravel()])
    depth = uv @ key_from_image[2, :2] + key_from_image[2, 2]
    depth = depth * np.sign(depth[len(depth) // 2])
    seen = apply_homography(key_from_image, uv)
    with np.errstate(invalid="ignore", over="ignore"):
        scale = np.sqrt(np.abs(np.linalg.det(homography_jacobian(key_from_image, uv))))
        inside = (seen > 0).all(axis=1) & (seen[:, 0] < width) & (seen[:, 1] < height)
        alike = (scale > LEAST_SCALE) & (scale < MOST_SCALE)
    return float(np.mean(inside & alike & (depth > 0)))


def register(
    key: KeyFrame,
    image: ImageArray,
    mask: ImageArray,
    key_from_image: FloatArray,
    *,
    levels: int = 1,
    demands: Demands | None = None,
) -> Registration:
    """Compare a frame with a key frame, point by point. What it was before does not matter: nothing adds up.

    Parameters
    ----------
    key : KeyFrame
        The key frame.
    image : (H, W) array
        The frame, grey.
    mask : (H, W) array
        Zero where it shows no ground.
    key_from_image : (3, 3) array
        A guess, good to about 5 px times two for each level.
    levels : int
        Of the pyramid.
    demands : Demands, optional
        What it takes to be believed.

    Returns
    -------
    registration : Registration
        With its covariance.
    """
    demands = demands or Demands()
    result = _follow_all(key, image, mask, key_from_image, levels=levels, demands=demands)
    H = result.fit.matrix
    if H is not None:
        gap = apply_homography(H, result.uv) - apply_homography(key_from_image, result.uv)
        if float(np.median(np.hypot(*gap.T))) > NEAR_PX:
            result = _follow_all(key, image, mask, H, levels=0, demands=demands)
    return result


def _follow_all(
    key: KeyFrame,
    image: ImageArray,
    mask: ImageArray,
    guess: FloatArray,
    *,
    levels: int,
    demands: Demands,
) -> Registration:
    height, width = image.shape
    image_from_key = relative(guess, np.eye(3))
    q = apply_homography(image_from_key, key.uv)
    edge = WINDOW / 2
    with np.errstate(invalid="ignore"):
        inside = (q > edge).all(axis=1) & (q[:, 0] < width - edge) & (q[:, 1] < height - edge)
    inside[inside] = mask[tuple(np.rint(q[inside]).astype(np.intp).T[::-1])] > 0
    p, q = key.uv[inside], q[inside]
    if _straight(image_from_key, p):
        found, good = follow(key.image, image, p, guess=q, levels=levels)
    else:  # turned or stretched: compared as the key frame would see it
        seen = cv2.warpPerspective(image, guess, (width, height), flags=cv2.INTER_LINEAR)
        found, good = follow(key.image, np.asarray(seen, dtype=np.uint8), p, levels=levels)
        found = apply_homography(image_from_key, found)
    good &= np.isfinite(found).all(axis=1)
    p, found = p[good], found[good]
    variance = FOLLOW_SIGMA_PX**2
    fit = fit_homography(
        found,
        p,
        source_covariance=variance,
        target_covariance=0.0,
        prior=NoiseScale(demands.scale, 20.0),
        starts=(guess,),
        least=demands.least,
        least_share=demands.least_share,
        parallax=True,
    )
    agreed = int(fit.inliers.sum())
    if fit.matrix is not None and may_be_chance(agreed, len(found)):
        fit = replace(fit, status="no agreement", matrix=None, covariance=None)
    covariance = np.empty((0, 0))
    if fit.covariance is not None:
        covariance = fit.covariance.copy()
        covariance[[2, 5], [2, 5]] += (FLOOR_PX / 1000) ** 2
    return Registration(fit, found, covariance, len(q))


def _straight(image_from_key: FloatArray, p: FloatArray) -> bool:
    """Whether windows look alike in both images without warping one of them."""
    if len(p) == 0:
        return True
    off = homography_jacobian(image_from_key, p) - np.eye(2)
    return bool(np.max(np.linalg.norm(off, axis=(1, 2))) * WINDOW / 2 < STRAIGHT_PX)
