"""A metric grid on the ground, as lines in the image: what a calibration looks like."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError

if TYPE_CHECKING:
    from airground.calibration.calibration import Calibration
    from airground.geometry.arrays import FloatArray

__all__ = ["MetricGrid", "grid_spacing", "metric_grid"]

LINES = 14  # about so many lines across the ground that is seen
SAMPLES = 200  # points along a line
COARSE = 60  # points along each side of the image that tell what ground is seen
FAR = 0.15  # of the usual nearness; beyond it the ground runs to infinity


@dataclass(frozen=True, slots=True, eq=False)
class MetricGrid:
    """Lines of constant ground x and y, at a round spacing, through the origin."""

    spacing_m: float
    """Between the lines [m]."""

    lines: tuple[FloatArray, ...]
    """Each (N, 2) [px]. Points along a line, in raw pixels; NaN where it is not ground, or not in the lens."""

    axes: tuple[bool, ...]
    """Does the line go through the ground's origin?"""


def grid_spacing(extent: float) -> float:
    """Round spacing, 1, 2 or 5 times a power of ten, for about `LINES` lines.

    Parameters
    ----------
    extent : float [m]
        What the grid spans.

    Returns
    -------
    spacing : float [m]
        Between its lines.
    """
    raw = extent / LINES
    power = 10.0 ** np.floor(np.log10(raw))
    return float(power * min((1, 2, 5, 10), key=lambda k: abs(np.log(k * power / raw))))


def metric_grid(
    calibration: Calibration, frame_px: tuple[float, float, float, float]
) -> MetricGrid:
    """Lines of constant ground x and y over an image.

    Parameters
    ----------
    calibration : Calibration
        Relation between image and ground.
    frame_px : tuple of float [px]
        Smallest u and v, largest u and v.

    Returns
    -------
    grid : MetricGrid
        Lines may leave the frame, and are to be clipped by who draws them.

    Raises
    ------
    InputError
        If no ground is seen in the frame.
    """
    u0, v0, u1, v1 = frame_px
    u, v = np.meshgrid(np.linspace(u0, u1, COARSE), np.linspace(v0, v1, COARSE))
    uv = calibration.undistort(np.stack([u.ravel(), v.ravel()], axis=-1))
    uv = uv[np.isfinite(uv).all(axis=1)]
    nearness = calibration.model.nearness(uv)
    # Leave out the strip below the horizon where the ground runs to infinity.
    relative = nearness / calibration.model.nearness(calibration.origin_px)
    uv = uv[relative > FAR * np.quantile(relative, 0.95)] if len(uv) else uv
    if len(uv) == 0:
        raise InputError("no ground is seen in the frame")
    xy = calibration.model.ground_position(uv, calibration.origin_px)
    low, high = xy.min(axis=0), xy.max(axis=0)
    spacing = grid_spacing(float(np.max(high - low)))
    lines: list[FloatArray] = []
    axes: list[bool] = []
    for axis in (0, 1):
        first, last = (int(np.floor(low[axis] / spacing)), int(np.ceil(high[axis] / spacing)))
        for k in range(first, last + 1):
            line = np.empty((SAMPLES, 2))
            line[:, axis] = k * spacing
            line[:, 1 - axis] = np.linspace(low[1 - axis], high[1 - axis], SAMPLES)
            lines.append(
                calibration.distort(calibration.model.image_position(line, calibration.origin_px))
            )
            axes.append(k == 0)
    return MetricGrid(spacing, tuple(lines), tuple(axes))
