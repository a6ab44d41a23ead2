"""What a user would otherwise pick, on the same input: tracks, motion, the clocks' offset and the image's size.

`linear` is the paper's method, which finds the clock itself. `homography` integrates the odometry over the whole drive
and gives OpenCV's findHomography all points. `solved` is a generic solver on the cost of the whole drive, in its plain
form, and needs a start: all of them get the same one, in simulation the truth with each entry off by 5 %, which is
better than a user has. All but the linear method are given the clocks' offset.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from benchmarks.path_cost import Levels, path_cost
from benchmarks.solvers import SOLVERS

from airground.calibration import calibrate
from airground.calibration.ground_path import ground_path
from airground.geometry import LimitedHomography

if TYPE_CHECKING:
    from airground.calibration import Motion, Tracks
    from airground.geometry import FloatArray

__all__ = [
    "HOMOGRAPHIES",
    "START_ERROR",
    "homography",
    "homography_clock",
    "linear",
    "near",
    "solved",
]

START_ERROR = 0.05  # of each entry of g, relative, where the generic solvers begin
THRESHOLDS_PX = (3.0, 10.0, 30.0)

HOMOGRAPHIES: dict[str, tuple[int, float]] = {
    "LS": (0, 0.0),
    **{f"RANSAC {px:.0f} px": (cv2.RANSAC, px) for px in THRESHOLDS_PX},
    **{f"MAGSAC {px:.0f} px": (cv2.USAC_MAGSAC, px) for px in THRESHOLDS_PX},
}
"""Method and threshold [px] of findHomography."""

MIRRORS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])
"""OpenCV's USAC drops every sample whose orientation the homography reverses, and that is all of them where the ground
is seen from above and v points down: as it stands USAC_MAGSAC finds nothing, or nonsense. So it is also run on ground
points with y reversed, and the answer with more inliers counts."""

MOST_POINTS = 2000  # for the search of the clock


def near(g: FloatArray, seed: int = 0) -> FloatArray:
    """Start of the generic solvers: the truth, each entry off by `START_ERROR`."""
    rng = np.random.default_rng(seed)
    return np.asarray(g * (1 + START_ERROR * rng.normal(size=g.shape)))


def linear(tracks: Tracks, motion: Motion, image_size_px: tuple[int, int]) -> FloatArray:
    """Calibrate by the paper's method, eqs. 16 and 17; raises where the motion leaves it open."""
    return calibrate(tracks, motion, method="linear", image_size_px=image_size_px).model.g


def _points(tracks: Tracks, motion: Motion, offset_s: float) -> tuple[FloatArray, FloatArray]:
    """Integrated positions of the first target, and its sightings; of one target only, as origins differ."""
    name = tracks.targets[0]
    rows = tracks.rows(name)
    path = ground_path(motion, name)
    if path is None:
        return np.empty((0, 2)), np.empty((0, 2))
    xy, stretch = path.at(tracks.t[rows] + offset_s)
    keep = stretch >= 0
    return xy[keep], tracks.uv[rows][keep]


def homography(tracks: Tracks, motion: Motion, offset_s: float, variant: str) -> FloatArray | None:
    """Integrate the odometry over the whole drive and call findHomography; None where it finds nothing."""
    method, threshold = HOMOGRAPHIES[variant]
    xy, uv = _points(tracks, motion, offset_s)
    if len(xy) < 4:
        return None
    best, most = None, -1
    for mirror in MIRRORS if method == cv2.USAC_MAGSAC else MIRRORS[:1]:
        cv2.setRNGSeed(0)
        found, inliers = cv2.findHomography(xy * mirror[:2], uv, method, threshold)
        matrix = np.asarray(found, dtype=np.float64)
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all():  # None: it found nothing
            continue
        if int(inliers.sum()) > most and abs(np.linalg.det(matrix)) > 1e-12:
            best, most = matrix * mirror, int(inliers.sum())
    return None if best is None else LimitedHomography.from_homography(best).g


def homography_clock(tracks: Tracks, motion: Motion, reach_s: float = 0.5) -> float:
    """Offset of the clocks at which a homography fits best, to 10 ms: the peers' own, from nothing of ours."""

    def misfit(offset_s: float) -> float:
        xy, uv = _points(tracks, motion, offset_s)
        every = max(1, len(xy) // MOST_POINTS)
        xy, uv = xy[::every], uv[::every]
        if len(xy) < 4:
            return np.inf
        matrix = np.asarray(cv2.findHomography(xy, uv, 0)[0], dtype=np.float64)
        if matrix.shape != (3, 3):
            return np.inf
        w = np.column_stack([xy, np.ones(len(xy))]) @ matrix.T
        return float(np.mean(np.sum((w[:, :2] / w[:, 2:] - uv) ** 2, axis=1)))

    best = 0.0
    for step in (reach_s / 10, reach_s / 50):
        grid = best + step * np.arange(-10, 11)
        best = float(grid[np.argmin([misfit(offset) for offset in grid])])
    return best


def solved(
    tracks: Tracks,
    motion: Motion,
    offset_s: float,
    image_size_px: tuple[int, int],
    *,
    solver: str,
    g_start: FloatArray,
    levels: Levels,
) -> FloatArray:
    """Minimise the cost of the whole drive by a generic solver."""
    cost = path_cost(tracks, motion, offset_s, image_size_px, g_start=g_start, levels=levels)
    return cost.g(SOLVERS[solver](cost))
