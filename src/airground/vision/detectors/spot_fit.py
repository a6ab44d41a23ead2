"""Where small lights are: a Gaussian fitted to each, in which saturated pixels count as "this bright or brighter"."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from airground.vision.frame import ImageArray

__all__ = ["SATURATED", "SpotFits", "fit_spots"]

SATURATED = 250
"""Grey level from which a pixel tells only that the light is at least so strong."""

PARAMETERS = 5  # logarithm of the peak, u, v, logarithm of the width, background
ITERATIONS = 12
HUBER = 2.5
LEAST_SIGMA_PX = 0.35


class SpotFits(NamedTuple):
    """K fitted lights."""

    uv: FloatArray
    """(K, 2) [px]. Centres."""

    covariance: FloatArray
    """(K, 2, 2) [px2]. Of the centres, by the sandwich estimate."""

    sigma_px: FloatArray
    """(K,) [px]. Width of the Gaussian."""

    peak: FloatArray
    """(K,) [grey levels]. Above the background; beyond 255 where the core is saturated."""

    correlation: FloatArray
    """(K,). Between the image and the Gaussian, at most 1."""

    good: NDArray[np.bool_]
    """(K,). Whether the fit holds."""


def fit_spots(grey: ImageArray, uv: FloatArray, radius_px: FloatArray) -> SpotFits:
    """Fit lights.

    Parameters
    ----------
    grey : (H, W) array
        The image.
    uv : (K, 2) array [px]
        About where they are.
    radius_px : (K,) array [px]
        About how large.

    Returns
    -------
    fits : SpotFits
        In the order given.
    """
    count = len(uv)
    answers = SpotFits(
        uv.copy(),
        np.tile(np.eye(2), (count, 1, 1)),
        np.ones(count),
        np.ones(count),
        np.zeros(count),
        np.zeros(count, dtype=bool),
    )
    reach = np.ceil(1.3 * radius_px) + 2.0
    for low, high in ((0.0, 6.0), (6.0, 12.0), (12.0, np.inf)):  # alike in size, alike in work
        rows = np.flatnonzero((reach > low) & (reach <= high))
        if len(rows):
            some = _fit(grey, uv, rows, reach[rows], radius_px[rows])
            for whole, part in zip(answers, some, strict=True):
                whole[rows] = part
    return answers


def _fit(
    grey: ImageArray, uv: FloatArray, rows: NDArray[np.intp], reach: FloatArray, radius: FloatArray
) -> SpotFits:
    """Lights of like size; `uv` holds all lights, as a pixel belongs to the nearest."""
    own = uv[rows]
    R = int(reach.max())
    offset = np.arange(-R, R + 1)
    du, dv = (a.ravel() for a in np.meshgrid(offset, offset))
    middle = np.rint(own).astype(np.intp)
    u, v = middle[:, :1] + du, middle[:, 1:] + dv  # (K, N)
    height, width = grey.shape
    there = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    seen = grey[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)].astype(np.float64)
    distance = np.hypot(u - own[:, :1], v - own[:, 1:])
    there &= distance <= reach[:, None]
    for k in range(len(rows)):
        apart = np.hypot(*(uv - own[k]).T)
        for other in uv[(apart > 0) & (apart < 2 * R)]:
            there[k] &= distance[k] <= np.hypot(u[k] - other[0], v[k] - other[1])
    full = there & (seen >= SATURATED)
    top = np.where(there, seen, 0.0).max(axis=1)
    theta = np.empty((len(rows), PARAMETERS))
    for k in range(len(rows)):
        ground = seen[k, there[k] & (distance[k] > radius[k] + 1)]
        theta[k, 4] = np.median(ground) if len(ground) else top[k] / 4
    theta[:, 0] = np.log(np.maximum(top - theta[:, 4], 1.0) * np.where(full.any(axis=1), 1.5, 1.0))
    theta[:, 1:3] = own
    theta[:, 3] = np.log(np.maximum(radius / 1.6, LEAST_SIGMA_PX))
    return _solve(theta, (u, v), seen, there.astype(np.float64), full)


def _solve(
    theta: FloatArray,
    uv: tuple[NDArray[np.intp], NDArray[np.intp]],
    seen: FloatArray,
    there: FloatArray,
    full: NDArray[np.bool_],
) -> SpotFits:
    count = len(theta)
    u, v = uv
    start = theta[:, 1:3].copy()
    diagonal = np.arange(PARAMETERS)
    weight, change = there, np.full((count, PARAMETERS), np.inf)
    J = np.empty((count, PARAMETERS, u.shape[1]))
    damping = 1e-2
    for _ in range(ITERATIONS):
        sigma = np.exp(theta[:, 3:4])
        x, y = (u - theta[:, 1:2]) / sigma, (v - theta[:, 2:3]) / sigma
        square = x * x + y * y
        bell = np.exp(theta[:, :1] - 0.5 * square)
        residual = seen - bell - theta[:, 4:]
        residual[full & (residual < 0)] = 0.0  # brighter than the camera can tell
        size = np.abs(residual)
        ranked = np.sort(np.where(there > 0, size, np.inf), axis=1)
        spread = 1.4826 * ranked[np.arange(count), (there > 0).sum(axis=1) // 2]
        spread[~np.isfinite(spread)] = 1.0
        weight = there * np.minimum(1.0, HUBER * (spread[:, None] + 0.5) / np.maximum(size, 1e-9))
        weight[full & (residual == 0.0)] = 0.0
        J[:, 0], J[:, 1], J[:, 2] = bell, bell * x / sigma, bell * y / sigma
        J[:, 3], J[:, 4] = bell * square, 1.0
        weighted = J * weight[:, None]
        A = weighted @ J.swapaxes(1, 2)
        A[:, diagonal, diagonal] = A[:, diagonal, diagonal] * (1.0 + damping) + 1e-9
        damping = max(damping / 10, 1e-9)
        inverse = np.linalg.inv(A)
        change = (inverse @ (weighted @ residual[..., None]))[..., 0]
        limit = np.column_stack(
            [np.full(count, 0.7), sigma, sigma, np.full(count, 0.4), np.full(count, 50.0)]
        )
        theta = theta + np.clip(np.nan_to_num(change), -limit, limit)
        theta[:, 0] = np.clip(theta[:, 0], 0.0, 9.0)
        theta[:, 3] = np.clip(theta[:, 3], np.log(LEAST_SIGMA_PX), 4.0)
        if (np.abs(change[:, 1:3]) < 3e-3).all():
            break
    scaled = J * (weight * residual)[:, None]
    pixels = np.maximum((weight > 0).sum(axis=1), PARAMETERS + 1)
    covariance = inverse @ (scaled @ scaled.swapaxes(1, 2)) @ inverse
    covariance *= (pixels / (pixels - PARAMETERS))[:, None, None]
    centres, width = theta[:, 1:3], np.exp(theta[:, 3])
    drift = np.hypot(*(centres - start).T)
    used = weight > 0
    mean = (used * seen).sum(axis=1) / pixels
    total = (used * (seen - mean[:, None]) ** 2).sum(axis=1)
    left = (used * residual**2).sum(axis=1)
    correlation = np.sqrt(np.clip(1.0 - left / np.maximum(total, 1e-9), 0.0, 1.0))
    good = np.isfinite(change).all(axis=1) & (np.abs(change[:, 1:3]).max(axis=1) < 0.1)
    good &= (drift < 2.0 * width + 2.0) & np.isfinite(covariance).all(axis=(1, 2))
    good &= (weight > 0).sum(axis=1) > 2 * PARAMETERS
    return SpotFits(centres, covariance[:, 1:3, 1:3], width, np.exp(theta[:, 0]), correlation, good)
