"""What a page needs to draw the ground: horizon, metric grid, and how to look at it from above."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration.inspection import inspect_calibration
from airground.calibration.metric_grid import metric_grid
from airground.errors import AirgroundError

if TYPE_CHECKING:
    from airground.calibration import Calibration
    from airground.geometry.arrays import FloatArray

__all__ = ["NO_GROUND", "ground_bounds", "ground_document", "simplified"]

TOLERANCE_PX = 0.3  # of a polyline from the curve it stands for
LEAST_SCALE = 0.1  # of the best; ground that is smaller in the image is too far to look at
COARSE = 48  # points along each side of the image that tell what ground is seen

NO_GROUND: dict[str, Any] = {"horizon": None, "step_m": None, "grid": [], "rectify": None}
"""Where nothing is known of the camera."""


def _digits(values: FloatArray) -> list[float]:
    return [float(f"{value:.10g}") for value in np.ravel(values)]


def simplified(line: FloatArray, tolerance: float = TOLERANCE_PX) -> FloatArray:
    """Leave out points of a line that lie between their neighbours anyway.

    Parameters
    ----------
    line : (N, 2) array [px]
        Two points or more.
    tolerance : float [px]
        Farthest that a point left out may lie from what is left.

    Returns
    -------
    simple : (M, 2) array [px]
        First and last point are kept.
    """
    keep = np.zeros(len(line), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(line) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        along = line[last] - line[first]
        inner = line[first + 1 : last] - line[first]
        length = float(np.hypot(*along))
        if length > 0:
            off = np.abs(inner[:, 0] * along[1] - inner[:, 1] * along[0]) / length
        else:
            off = np.hypot(inner[:, 0], inner[:, 1])
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = first + 1 + worst
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return np.asarray(line[keep])


def _pieces(line: FloatArray, size: tuple[int, int]) -> list[FloatArray]:
    """Parts of a line that are in view, each with the point before and the point after."""
    width, height = size
    margin = 0.1 * max(size)
    seen = np.isfinite(line).all(axis=1)
    near = np.zeros(len(line), dtype=bool)
    u, v = line[seen].T
    near[seen] = (u > -margin) & (u < width + margin) & (v > -margin) & (v < height + margin)
    wide = near.copy()
    wide[1:] |= near[:-1]
    wide[:-1] |= near[1:]
    wide &= seen
    edges = np.flatnonzero(np.diff(np.concatenate([[0], wide.astype(int), [0]])))
    parts = zip(edges[::2], edges[1::2], strict=True)
    return [line[a:b] for a, b in parts if b - a > 1]


def ground_bounds(
    calibration: Calibration, size: tuple[int, int]
) -> tuple[float, float, float, float] | None:
    """Give the rectangle that holds the ground that is seen well.

    Parameters
    ----------
    calibration : Calibration
        In force.
    size : (int, int) [px]
        Width and height of the image.

    Returns
    -------
    bounds : (float, float, float, float) or None [m]
        Smallest x and y, largest x and y, of ground whose scale, where it is smallest, is at least a tenth of the
        best; None where no ground is seen.
    """
    u, v = np.meshgrid(
        np.linspace(-0.5, size[0] - 0.5, COARSE), np.linspace(-0.5, size[1] - 0.5, COARSE)
    )
    uv = np.stack([u.ravel(), v.ravel()], axis=-1)
    uv = uv[calibration.is_ground(uv)]
    if len(uv) == 0:
        return None
    scale = np.linalg.svd(calibration.jacobian(uv), compute_uv=False)[:, 1]
    uv = uv[scale >= LEAST_SCALE * scale.max()]
    xy = calibration.model.ground_position(calibration.undistort(uv), calibration.origin_px)
    (x0, y0), (x1, y1) = xy.min(axis=0), xy.max(axis=0)
    return float(x0), float(y0), float(x1), float(y1)


def _horizon(calibration: Calibration, size: tuple[int, int]) -> list[float] | None:
    try:
        line = inspect_calibration(calibration, image_size_px=size).horizon
    except AirgroundError:
        return None
    return _digits(line) if np.any(line[:2]) else None


def ground_document(calibration: Calibration, size: tuple[int, int]) -> dict[str, Any]:
    """Give the part of the message ``calibration`` that changes with the calibration in force only.

    Parameters
    ----------
    calibration : Calibration
        In force.
    size : (int, int) [px]
        Width and height of the image.

    Returns
    -------
    document : dict
        ``horizon``, ``step_m``, ``grid`` and ``rectify``; the last three empty where no ground is seen. Takes some
        milliseconds.
    """
    bounds = ground_bounds(calibration, size)
    if bounds is None:
        return NO_GROUND | {"horizon": _horizon(calibration, size)}
    found = metric_grid(calibration, (-0.5, -0.5, size[0] - 0.5, size[1] - 0.5))
    grid = [
        {"points": np.round(simplified(piece), 1).tolist(), "axis": axis}
        for line, axis in zip(found.lines, found.axes, strict=True)
        for piece in _pieces(line, size)
    ]
    lens = calibration.lens
    return {
        "horizon": _horizon(calibration, size),
        "step_m": float(found.spacing_m),
        "grid": grid,
        "rectify": {
            "ground_from_image": _digits(
                calibration.model.ground_from_image(calibration.origin_px)
            ),
            "lens": None
            if lens is None
            else {"k1": _digits(np.array([lens.k1]))[0], "center_px": _digits(lens.center)},
            "bounds_m": [round(bound, 3) for bound in bounds],
        },
    }
