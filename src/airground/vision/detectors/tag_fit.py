"""Where tags are, to a few hundredths of a pixel: their printed patterns fitted to the pixels that show them.

A decoded tag is known down to its cells, so every edge in it tells of its place, not only the four outer ones. Least
squares (Gauss-Newton, Huber's weights) over all pixels at once; the covariance is the sandwich estimate, which needs no
noise level and stays honest where the model fits edges less well than flats (White, Econometrica 1980).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Self

import cv2
import numpy as np

from airground.geometry.arrays import FloatArray, homogeneous
from airground.vision.detectors.tag_model import design_of, pixels_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.vision.frame import ImageArray

    FloatArray32 = NDArray[np.float32]

__all__ = ["TagFits", "fit_tags"]

MOST_PIXELS = 400  # enough for 0.02 px at any noise; more costs time
PARAMETERS = 14  # 8 of the homography, 2 of the blur, 4 of the brightness
START_BLUR_PX = 0.9
BLUR_RANGE = np.log(0.25), np.log(6.0)  # px; a pixel alone blurs by 12 ** -0.5
HUBER = 2.0
SMALL_STEP = 2e-4  # of half a side
LARGEST_STEP = 2e-2
BENT = 0.2  # what a step is wrong by is this times its square over the blur, as found by trying
ENOUGH = 1.0  # of the standard deviation; by trying, what is left is then below a fifth of it
MOST_CHANGE = np.array([0.3] * 8 + [0.5] * 2)  # in a step
LONGEST = np.array([LARGEST_STEP] * 8 + [0.3] * 2)  # of the last one
ITERATIONS = 8
DIAGONAL = np.arange(PARAMETERS)
BLUR_PRIOR = np.where(
    (DIAGONAL == 8) | (DIAGONAL == 9), 4.0, 0.0
)  # weak: one of both may be unseen


@dataclass(frozen=True, slots=True, eq=False)
class TagFits:
    """Places of K tags in the image."""

    ok: NDArray[np.bool_]
    """(K,). Whether the pixels determine its place; where they do not, the rest is void."""

    image_from_tag: FloatArray
    """(K, 3, 3). Homography from the tag's plane, where its black square is [-1, 1] squared, y down."""

    covariance: FloatArray
    """(K, 8, 8). Of a small change D of it, ``image_from_tag @ (I + D)``, row by row without the last entry."""

    correlation: FloatArray
    """(K,). Between the image and the pattern, at most 1; pixels that something covers count less."""

    code_correlation: FloatArray
    """(K,). The same within the border, where the tag's number is written; every pixel counts."""

    contrast: FloatArray
    """(K,). White less black [grey levels]."""

    blur_px: FloatArray
    """(K, 2). Standard deviation of the blur [px] along the tag's rows and columns."""

    @classmethod
    def none(cls, count: int) -> Self:
        """Of tags that are not to be seen.

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        fits : TagFits
            None is ok.
        """
        zero, one = np.zeros(count), np.ones((count, 2))
        H, covariance = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 8, 8))
        return cls(np.zeros(count, dtype=bool), H, covariance, zero, zero, zero, one)

    def points(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Images of points of the tags, and how they hang on the parameters.

        Parameters
        ----------
        xy : (N, 2) array
            On each tag.

        Returns
        -------
        uv : (K, N, 2) array [px]
            In the image.
        jacobian : (K, N, 2, 8) array [px]
            By the eight parameters of `covariance`.
        """
        H, p = self.image_from_tag, homogeneous(xy)
        q = p @ H.swapaxes(1, 2)
        uv = q[..., :2] / q[..., 2:]
        by_q = (H[:, None, :2] - uv[..., None] * H[:, None, 2:]) / q[..., 2, None, None]
        jacobian = (by_q[..., None] * p[:, None, None, :]).reshape(*uv.shape, 9)
        return uv, jacobian[..., :8]


def fit_tags(
    image: ImageArray, H: FloatArray, steps: FloatArray32, cells: int, blur_px: FloatArray
) -> TagFits:
    """Fit the patterns of tags to an image.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        Grey, or blue, green, red; only the pixels that are needed are turned to grey.
    H : (K, 3, 3) array
        Homographies from the tags, good to half a cell; NaN for those that have none.
    steps : (9, K, (C + 2) ** 2) array
        Of their patterns, from `tag_model.steps_of`.
    cells : int
        C, cells along a side, border included.
    blur_px : (K, 2) array [px]
        Blurs as fitted in the frame before, which saves steps; NaN where there are none.

    Returns
    -------
    fits : TagFits
        Of each.
    """
    pixels, there = pixels_of(image.shape, H, cells, MOST_PIXELS)
    alive = there.sum(axis=1) > 3 * PARAMETERS
    blur_px = np.where(np.isnan(blur_px), START_BLUR_PX, blur_px)
    if alive.all():
        return _fit(image, pixels, there, H=H, blur=np.log(blur_px), steps=steps, cells=cells)
    fits = TagFits.none(len(H))
    rows = np.flatnonzero(alive)
    if len(rows):
        fitted = fit_tags(image, H[rows], steps[:, rows], cells, blur_px[rows])
        for name in TagFits.__slots__:
            getattr(fits, name)[rows] = getattr(fitted, name)
    return fits


def _fit(
    image: ImageArray,
    pixels: NDArray[np.intp],
    there: NDArray[np.bool_],
    *,
    H: FloatArray,
    blur: FloatArray,
    steps: FloatArray32,
    cells: int,
) -> TagFits:
    at = image[pixels[1], pixels[0]]
    grey = at if image.ndim == 2 else np.asarray(cv2.cvtColor(at, cv2.COLOR_BGR2GRAY))
    seen, use = grey.astype(np.float32), there.astype(np.float32)
    count = len(H)
    alive = np.ones(count, dtype=bool)
    D = np.zeros((count, 9))
    for _ in range(ITERATIONS):
        design = design_of(pixels, H, np.exp(blur), steps, cells)
        residual, contrast = _brightness(design[:, 10:], seen, use)
        design[:, :10] *= contrast[:, None, None]
        weight = _weight(residual, use)
        step = _step(design, residual, weight, alive)
        done = _is_short(H, blur, step) | ~alive
        if done.all():  # weights by what is left, as if the pattern had been drawn anew
            weight = _weight(_left(design, residual, step), use)
            step = _step(design, residual, weight, alive)
        step.change[~alive] = 0.0
        bounded = np.clip(step.change[:, :10], -MOST_CHANGE, MOST_CHANGE)
        D[:, :8] = bounded[:, :8]
        moved = H + H @ D.reshape(count, 3, 3)
        alive &= np.abs(moved[:, 2, 2]) > 1e-6
        moved[~alive] = H[~alive]
        H = moved / moved[:, 2:, 2:]
        blur = np.clip(blur + bounded[:, 8:], *BLUR_RANGE)
        if done.all():
            break
    alive &= np.abs(step.change[:, :8]).max(axis=1) < LARGEST_STEP
    left, inverse = _left(design, residual, step), step.inverse
    weight = _weight(left, use)
    scaled = design * (weight * left)[:, None]
    pixel_count = use.sum(axis=1)
    covariance = inverse @ (scaled @ scaled.swapaxes(1, 2)) @ inverse
    covariance *= (pixel_count / (pixel_count - PARAMETERS))[:, None, None]
    code = use * (np.abs(design[:, 12:]).max(axis=1) < 1.0 - 2.0 / cells)
    correlation = _correlation(seen, left, np.stack([weight, code])).astype(np.float64)
    return TagFits(
        alive,
        H,
        covariance[:, :8, :8],
        correlation[0],
        correlation[1],
        contrast.astype(np.float64),
        np.exp(blur),
    )


class _Step(NamedTuple):
    """A step of Gauss and Newton."""

    inverse: FloatArray
    """(K, 14, 14). Of the normal equations."""

    change: FloatArray
    """(K, 14). Of the parameters."""

    gradient: FloatArray
    """(K, 14). Right side of the normal equations."""

    square: FloatArray
    """(K,). Mean square of the residuals."""


def _step(
    design: FloatArray32, residual: FloatArray32, weight: FloatArray32, alive: NDArray[np.bool_]
) -> _Step:
    weighted = design * weight[:, None]
    A = (weighted @ design.swapaxes(1, 2)).astype(np.float64)
    total: FloatArray = (weight * residual * residual).sum(axis=1, dtype=np.float64)
    square = total / weight.sum(axis=1)
    A[:, DIAGONAL, DIAGONAL] *= 1.0 + 1e-6
    A[:, DIAGONAL, DIAGONAL] += 1e-9 + square[:, None] * BLUR_PRIOR
    _leave_out(A, alive)
    inverse: FloatArray = np.asarray(np.linalg.inv(A), dtype=np.float64)
    gradient = (weighted @ residual[..., None]).astype(np.float64)
    change = (inverse @ gradient)[..., 0]
    _leave_out(change, alive)
    return _Step(inverse, change, gradient[..., 0], square)


def _left(design: FloatArray32, residual: FloatArray32, step: _Step) -> FloatArray32:
    left: FloatArray32 = residual - (step.change[:, None].astype(np.float32) @ design)[:, 0]
    return left


def _is_short(H: FloatArray, blur: FloatArray, step: _Step) -> NDArray[np.bool_]:
    """Whether the pattern may be taken as linear along a step, so that it need not be drawn anew."""
    # Twice the mean square of the step over the pixels, and the variance of the place: [half a side, squared].
    place = step.inverse[:, 2, 2] + step.inverse[:, 5, 5]
    moved = np.maximum((step.change * step.gradient).sum(axis=1), 0.0) * place
    half_px = np.sqrt(np.abs(H[:, 0, 0] * H[:, 1, 1] - H[:, 0, 1] * H[:, 1, 0]))
    bent = BENT / 2 * moved * half_px / np.exp(blur.min(axis=1))
    size = np.abs(step.change[:, :10])
    short = (bent < ENOUGH * np.sqrt(step.square * place / 2)) | (size.max(axis=1) < SMALL_STEP)
    short &= (size <= LONGEST).all(axis=1)
    return np.asarray(short)


def _leave_out(A: FloatArray, alive: NDArray[np.bool_]) -> None:
    """Put the unit matrix for those of no use, so that the others can be inverted; zero for a column."""
    if np.isfinite(A.sum()) and alive.all():
        return
    alive &= np.isfinite(A).all(axis=tuple(range(1, A.ndim)))
    A[~alive] = np.eye(A.shape[1]) if A.ndim == 3 else 0.0


def _correlation(seen: FloatArray32, residual: FloatArray32, weight: FloatArray32) -> FloatArray32:
    share = weight / np.maximum(weight.sum(axis=-1), 1e-9)[..., None]
    mean = (share * seen).sum(axis=-1)
    total = (share * (seen - mean[..., None]) ** 2).sum(axis=-1)
    left = (share * residual**2).sum(axis=-1)
    value: FloatArray32 = np.sqrt(np.clip(1.0 - left / np.maximum(total, 1e-9), 0.0, 1.0))
    return value


def _brightness(
    ramp: FloatArray32, seen: FloatArray32, use: FloatArray32
) -> tuple[FloatArray32, FloatArray32]:
    """What is left once dark level, contrast and ramp fit best; the contrasts."""
    weighted = ramp * use[:, None]
    A = (weighted @ ramp.swapaxes(1, 2)).astype(np.float64)
    A[:, range(4), range(4)] += 1e-9
    _leave_out(A, np.ones(len(A), dtype=bool))
    level = np.linalg.solve(A, (weighted @ seen[..., None]).astype(np.float64)).astype(np.float32)
    return seen - (level.swapaxes(1, 2) @ ramp)[:, 0], level[:, 1, 0]


def _weight(residual: FloatArray32, use: FloatArray32) -> FloatArray32:
    """Huber's weights; those not to be used have none."""
    size = np.abs(residual)
    middle = size.shape[1] // 2
    spread = np.partition(size, middle, axis=1)[:, middle, None]
    spread *= np.float32(1.4826 * HUBER)
    spread += np.float32(0.3 * HUBER)
    size = np.maximum(size, spread)
    weight: FloatArray32 = use * spread / size
    return weight
