"""Ground features: corners spread over the image, how they are followed, and descriptors to know a view again."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray
from airground.vision.frame import ImageArray
from airground.vision.moving.fit_types import BoolArray

__all__ = [
    "Descriptors",
    "describe",
    "find_corners",
    "follow",
    "ground_mask",
    "match",
    "noise_level",
    "sharpness",
]

WINDOW = 15  # [px]
STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.005)
FLATTEST = 1e-4  # smallest eigenvalue of the gradients' matrix that Lucas and Kanade may divide by
RETURN_PX = 0.25  # a point followed there and back must come home within this
WEAKEST = 0.001  # of the usual strength of the strongest corners
BLOCK, KERNEL = 5, 3  # of OpenCV's corner strength, which divides by 255 for images of 8 bits
BY_NOISE = (
    12 * BLOCK**2 / (2 ** (KERNEL - 1) * BLOCK * 255) ** 2
)  # strength that noise of variance 1 has
ABOVE_NOISE = 6.0  # on a line or on nothing, only noise makes corners
LEAST_NOISE = 0.3  # grey values are whole numbers
SAME_PX = 5  # corners are further apart
RATIO = 0.8  # best over second best distance between descriptors (Lowe)


def ground_mask(size_px: tuple[int, int], outlines: FloatArray) -> ImageArray:
    """Where there is ground: 255, and 0 within the outlines.

    Parameters
    ----------
    size_px : (int, int) [px]
        Width and height.
    outlines : (K, 4, 2) array [px]
        What to leave out, NaN where unknown.

    Returns
    -------
    mask : (H, W) array
        Of 8 bits.
    """
    mask = np.full((size_px[1], size_px[0]), 255, dtype=np.uint8)
    for outline in outlines[np.isfinite(outlines).all(axis=(1, 2))]:
        middle = outline.mean(axis=0)
        away = outline - middle
        size = np.maximum(np.hypot(*away.T), 1e-9)[:, None]
        grown = outline + away / size * (WINDOW / 2)  # no window that is compared may touch it
        far = 10.0 * max(size_px)
        corners = np.rint(np.clip(grown, -far, far)).astype(np.int32)
        cv2.fillConvexPoly(mask, corners, 0.0)
    return mask


def find_corners(
    grey: ImageArray, mask: ImageArray, *, cell_px: int, per_cell: int, border_px: int = WINDOW
) -> FloatArray:
    """Corners (Shi and Tomasi), the strongest of each cell of a grid, so that they spread over the image.

    Parameters
    ----------
    grey : (H, W) array
        Image.
    mask : (H, W) array
        Zero where no corner may be.
    cell_px : int [px]
        Size of a cell.
    per_cell : int
        Most corners in a cell.
    border_px : int [px]
        Corners keep this distance from the image's border.

    Returns
    -------
    uv : (N, 2) array [px]
        In whole pixels, in a fixed order.
    """
    strength = cv2.cornerMinEigenVal(grey, BLOCK, ksize=KERNEL)
    peaks = cv2.dilate(strength, np.ones((2 * SAME_PX + 1, 2 * SAME_PX + 1), np.uint8))
    good = (strength == peaks) & (mask > 0) & (strength > 0)
    b = border_px
    good[:b], good[-b:], good[:, :b], good[:, -b:] = False, False, False, False
    v, u = np.nonzero(good)
    value = strength[v, u]
    if len(value) == 0:
        return np.empty((0, 2))
    strong = value > WEAKEST * np.sort(value)[-max(1, len(value) // 50)]
    strong &= value > ABOVE_NOISE * BY_NOISE * noise_level(grey) ** 2
    u, v, value = u[strong], v[strong], value[strong]
    cell = (v // cell_px) * (grey.shape[1] // cell_px + 1) + u // cell_px
    order = np.lexsort((u, v, -value, cell))
    cell = cell[order]
    first = np.r_[True, cell[1:] != cell[:-1]]
    rank = np.arange(len(cell)) - np.flatnonzero(first)[np.cumsum(first) - 1]
    order = order[rank < per_cell]
    return np.column_stack([u[order], v[order]]).astype(np.float64)


def follow(
    before: ImageArray,
    after: ImageArray,
    uv: FloatArray,
    *,
    guess: FloatArray | None = None,
    levels: int = 1,
    there_and_back: bool = False,
) -> tuple[FloatArray, BoolArray]:
    """Follow points from one image to another (Lucas and Kanade, in a pyramid).

    Parameters
    ----------
    before : (H, W) array
        First image.
    after : (H, W) array
        Second image.
    uv : (N, 2) array [px]
        Points in the first.
    guess : (N, 2) array [px], optional
        Where they may be in the second; the same places otherwise.
    levels : int
        How often the image is halved: a point may be about 5 px off its guess, and twice that with each level.
    there_and_back : bool
        Whether points must also come home.

    Returns
    -------
    uv : (N, 2) array [px]
        In the second image.
    good : (N,) array of bool
        Whether a point was found.
    """
    if len(uv) == 0:
        return np.empty((0, 2)), np.zeros(0, dtype=bool)
    p = _column(uv)
    q = p.copy() if guess is None else _column(guess)
    q, good = _lucas_kanade(before, after, p, q, levels)
    if there_and_back:
        home, back = _lucas_kanade(after, before, q, p.copy(), levels)
        good = good & back & (np.hypot(*(home - p)[:, 0].T) < RETURN_PX)
    return q[:, 0].astype(np.float64), good


@dataclass(frozen=True, slots=True, eq=False)
class Descriptors:
    """What is needed to know a view again."""

    uv: FloatArray
    """(N, 2) [px]. Points."""

    code: NDArray[np.uint8]
    """(N, 32). What they look like, whatever way they are turned (ORB)."""


def describe(grey: ImageArray, mask: ImageArray, *, count: int = 600) -> Descriptors:
    """Describe a view, on half its resolution.

    Parameters
    ----------
    grey : (H, W) array
        Image.
    mask : (H, W) array
        Zero where there is no ground.
    count : int
        Most points.

    Returns
    -------
    descriptors : Descriptors
        Spread over the image.
    """
    small = np.asarray(cv2.pyrDown(grey), dtype=np.uint8)
    thin = np.ascontiguousarray(mask[::2, ::2])[: small.shape[0], : small.shape[1]]
    points, code = cv2.ORB.create(nfeatures=count, fastThreshold=8).detectAndCompute(small, thin)
    if len(points) == 0:
        return Descriptors(np.empty((0, 2)), np.empty((0, 32), np.uint8))
    # A pixel of `small` is centred on every other one of the image.
    uv = 2.0 * np.array([point.pt for point in points], dtype=np.float64)
    return Descriptors(uv, np.asarray(code, dtype=np.uint8))


def match(here: Descriptors, there: Descriptors) -> tuple[FloatArray, FloatArray]:
    """Points of two views that look alike, and unlike all others.

    Parameters
    ----------
    here : Descriptors
        Of one view.
    there : Descriptors
        Of another.

    Returns
    -------
    uv_here : (M, 2) array [px]
        Matched points.
    uv_there : (M, 2) array [px]
        The same in the other view.
    """
    if len(here.uv) < 2 or len(there.uv) < 2:
        return np.empty((0, 2)), np.empty((0, 2))
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(here.code, there.code, k=2)
    good = [a for a, b in (p for p in pairs if len(p) == 2) if a.distance < RATIO * b.distance]
    rows = np.array([(m.queryIdx, m.trainIdx) for m in good], dtype=np.intp).reshape(-1, 2)
    return here.uv[rows[:, 0]], there.uv[rows[:, 1]]


def noise_level(grey: ImageArray) -> float:
    """Deviation of the noise of single pixels, from where the image is smoothest (Immerkaer, CVIU 1996).

    Parameters
    ----------
    grey : (H, W) array
        Image.

    Returns
    -------
    sigma : float
        In grey values; too large where the image is nowhere smooth.
    """
    mask = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float32)
    rough = np.abs(cv2.filter2D(grey, cv2.CV_32F, mask))
    blocks = cv2.resize(
        rough,
        (max(1, grey.shape[1] // 16), max(1, grey.shape[0] // 16)),
        interpolation=cv2.INTER_AREA,
    )
    smooth = float(np.quantile(blocks, 0.1))
    return max(LEAST_NOISE, float(np.sqrt(np.pi / 2)) / 6 * smooth)


def sharpness(grey: ImageArray) -> float:
    """How sharp an image is: mean size of the second derivative.

    Parameters
    ----------
    grey : (H, W) array
        Image.

    Returns
    -------
    sharpness : float
        To be compared with that of other images of the same scene.
    """
    small = cv2.pyrDown(grey)  # noise would hide a blur
    return float(cv2.norm(cv2.Laplacian(small, cv2.CV_16S), cv2.NORM_L1)) / small.size


def _column(uv: FloatArray) -> NDArray[np.float32]:
    """As OpenCV wants points: in rows that lie one after the other."""
    return np.array(uv, dtype=np.float32, order="C").reshape(-1, 1, 2)


def _lucas_kanade(
    before: ImageArray,
    after: ImageArray,
    p: NDArray[np.float32],
    q: NDArray[np.float32],
    levels: int,
) -> tuple[NDArray[np.float32], BoolArray]:
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        before,
        after,
        p,
        q,
        winSize=(WINDOW, WINDOW),
        maxLevel=levels,
        criteria=STEPS,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        minEigThreshold=FLATTEST,
    )
    result = np.asarray(found, dtype=np.float32)
    return result, (status.ravel() > 0) & np.isfinite(result).all(axis=(1, 2))
