"""Where tags are, to a few hundredths of a pixel: their printed patterns fitted to the pixels that show them.

A decoded tag is known down to its cells, so every edge in it tells of its place, not only the four outer ones. Least
squares (Gauss-Newton, Huber's weights) over all pixels at once; the covariance is the sandwich estimate, which needs no
noise level and stays honest where the model fits edges less well than flats (White, Econometrica 1980).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray, homogeneous
from airground.vision.detectors.tag_model import design_of, homographies, pixels_of, sheet_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from airground.vision.frame import ImageArray

    FloatArray32 = NDArray[np.float32]

__all__ = ["TagFit", "fit_tags"]

MOST_PIXELS = 400  # enough for 0.02 px at any noise; more costs time
PARAMETERS = 14  # 8 of the homography, 2 of the blur, 4 of the brightness
START_BLUR_PX = 0.9
BLUR_RANGE = np.log(0.25), np.log(6.0)  # px; a pixel alone blurs by 12 ** -0.5
HUBER = 2.0
SMALL_STEP = 1e-3  # of half a side; the next step would be smaller by another such factor
LARGEST_STEP = 2e-2
ITERATIONS = 8


@dataclass(frozen=True, slots=True, eq=False)
class TagFit:
    """A tag's place in the image."""

    image_from_tag: FloatArray
    """(3, 3). Homography from the tag's plane, where its black square is [-1, 1] squared, y down."""

    covariance: FloatArray
    """(8, 8). Of a small change D of it, ``image_from_tag @ (I + D)``, row by row without the last entry."""

    correlation: float
    """Between the image and the pattern, at most 1; pixels that something covers count less."""

    code_correlation: float
    """The same within the border, where the tag's number is written; every pixel counts."""

    contrast: float
    """White less black [grey levels]."""

    blur_px: tuple[float, float]
    """Standard deviation of the blur [px] along the tag's rows and columns."""

    def points(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Images of points of the tag, and how they hang on the parameters.

        Parameters
        ----------
        xy : (N, 2) array
            On the tag.

        Returns
        -------
        uv : (N, 2) array [px]
            In the image.
        jacobian : (N, 2, 8) array [px]
            By the eight parameters of `covariance`.
        """
        H, p = self.image_from_tag, homogeneous(np.asarray(xy, dtype=np.float64))
        q = p @ H.T
        uv = q[:, :2] / q[:, 2:]
        by_q = (H[None, :2] - uv[:, :, None] * H[None, 2:]) / q[:, 2, None, None]
        jacobian = (by_q[:, :, :, None] * p[:, None, None, :]).reshape(len(p), 2, 9)
        return uv, jacobian[:, :, :8]


def fit_tags(
    grey: ImageArray,
    corners: Sequence[FloatArray],
    patterns: Sequence[FloatArray],
    blurs_px: Sequence[tuple[float, float] | None] = (),
) -> list[TagFit | None]:
    """Fit the patterns of tags to an image.

    Parameters
    ----------
    grey : (H, W) array
        The image.
    corners : sequence of (4, 2) array [px]
        Of the black squares, good to half a cell: top left, top right, bottom right, bottom left as printed.
    patterns : sequence of (C, C) array
        The tags' cells, border included; 0 is black. All of one size.
    blurs_px : sequence of tuple of float or None
        Blurs as fitted in the frame before; saves steps.

    Returns
    -------
    fits : list of TagFit or None
        None where the pixels do not determine a tag's place.
    """
    fits: list[TagFit | None] = [None] * len(corners)
    if not len(corners):
        return fits
    H = homographies(np.array(corners, dtype=np.float64))
    cells = len(patterns[0])
    pixels = [pixels_of(grey.shape, h, cells, MOST_PIXELS) for h in H]
    rows = [i for i, found in enumerate(pixels) if len(found) > 3 * PARAMETERS]
    if not rows:
        return fits
    longest = max(len(pixels[i]) for i in rows)
    uv = np.zeros((2, len(rows), longest), dtype=np.intp)
    there = np.zeros((len(rows), longest), dtype=np.float32)
    for row, i in enumerate(rows):
        found = pixels[i]
        uv[:, row, : len(found)] = found.T
        uv[:, row, len(found) :] = found[0][:, None]
        there[row, : len(found)] = 1.0
    known = [blurs_px[i] if i < len(blurs_px) else None for i in rows]
    blur = np.log([b or (START_BLUR_PX, START_BLUR_PX) for b in known])
    sheets = np.array([sheet_of(patterns[i]) for i in rows])
    fitted = _fit(grey, uv, there=there, H=H[rows], blur=blur, sheets=sheets)
    for i, fit in zip(rows, fitted, strict=True):
        fits[i] = fit
    return fits


def _fit(
    grey: ImageArray,
    uv: NDArray[np.intp],
    *,
    there: NDArray[np.float32],
    H: FloatArray,
    blur: FloatArray,
    sheets: NDArray[np.float32],
) -> list[TagFit | None]:
    count = len(H)
    seen = grey[uv[1], uv[0]].astype(np.float32)
    weight = there
    alive = np.ones(count, dtype=bool)
    diagonal = np.arange(PARAMETERS)
    for _ in range(ITERATIONS):
        design = design_of(uv, H, np.exp(blur), sheets)
        residual, weight, contrast = _brightness(design[:, 10:], seen, weight, there)
        design[:, :10] *= contrast[:, None, None]
        weighted = design * weight[:, None]
        A = (weighted @ design.swapaxes(1, 2)).astype(np.float64)
        prior = (weight * residual**2).sum(axis=1) / weight.sum(axis=1)
        A[:, [8, 9], [8, 9]] += 4.0 * prior[:, None]  # weak: a blur of one direction may be unseen
        A[:, diagonal, diagonal] *= 1.0 + 1e-6
        A[:, diagonal, diagonal] += 1e-9
        alive &= np.isfinite(A).all(axis=(1, 2))
        A[~alive] = np.eye(PARAMETERS)
        inverse = np.linalg.inv(A)
        change = (inverse @ (weighted @ residual[..., None]))[..., 0]
        alive &= np.isfinite(change).all(axis=1)
        change[~alive] = 0.0
        D = np.zeros((count, 9))
        D[:, :8] = np.clip(change[:, :8], -0.3, 0.3)
        moved = H @ (np.eye(3) + D.reshape(count, 3, 3))
        alive &= np.abs(moved[:, 2, 2]) > 1e-6
        moved[~alive] = H[~alive]
        H = moved / moved[:, 2:, 2:]
        blur = np.clip(blur + np.clip(change[:, 8:], -0.5, 0.5)[:, :2], *BLUR_RANGE)
        size = np.abs(change[:, :8]).max(axis=1)
        if (size < SMALL_STEP).all():
            break
    alive &= size < LARGEST_STEP
    scaled = design * (weight * residual)[:, None]
    pixels = there.sum(axis=1)
    covariance = inverse @ (scaled @ scaled.swapaxes(1, 2)) @ inverse
    covariance *= (pixels / (pixels - PARAMETERS))[:, None, None]
    correlation = _correlation(seen, residual, weight)
    border = 1.0 - 2.0 / (sheets.shape[1] - 4)
    code = there * (np.abs(design[:, 12:]).max(axis=1) < border)
    code_correlation = _correlation(seen, residual, code)
    return [
        TagFit(
            H[k],
            covariance[k, :8, :8],
            float(correlation[k]),
            float(code_correlation[k]),
            float(contrast[k]),
            (float(np.exp(blur[k, 0])), float(np.exp(blur[k, 1]))),
        )
        if alive[k]
        else None
        for k in range(count)
    ]


def _correlation(seen: FloatArray32, residual: FloatArray32, weight: FloatArray32) -> FloatArray32:
    share = weight / np.maximum(weight.sum(axis=1), 1e-9)[:, None]
    mean = (share * seen).sum(axis=1)
    total = (share * (seen - mean[:, None]) ** 2).sum(axis=1)
    left = (share * residual**2).sum(axis=1)
    value: FloatArray32 = np.sqrt(np.clip(1.0 - left / np.maximum(total, 1e-9), 0.0, 1.0))
    return value


def _brightness(
    ramp: FloatArray32, seen: FloatArray32, weight: FloatArray32, there: FloatArray32
) -> tuple[FloatArray32, FloatArray32, FloatArray32]:
    """What is left once dark level, contrast and ramp fit best; Huber's weights by it; the contrasts."""
    weighted = ramp * weight[:, None]
    A = (weighted @ ramp.swapaxes(1, 2)).astype(np.float64)
    A[:, range(4), range(4)] += 1e-9
    A[~np.isfinite(A).all(axis=(1, 2))] = np.eye(4)
    level = np.linalg.solve(A, (weighted @ seen[..., None]).astype(np.float64))
    residual = seen - (level.swapaxes(1, 2).astype(np.float32) @ ramp)[:, 0]
    size = np.abs(residual)
    middle = size.shape[1] // 2
    spread = 1.4826 * np.partition(size, middle, axis=1)[:, middle] + 0.3
    weight = there * np.minimum(1.0, HUBER * spread[:, None] / np.maximum(size, 1e-6))
    return residual, weight.astype(np.float32), level[:, 1, 0].astype(np.float32)
