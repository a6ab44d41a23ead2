"""A calibration as a picture: the image with its horizon, a metric grid on the ground, and the scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.pictures.style import new_figure, save_png

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from airground.calibration.calibration import Calibration
    from airground.calibration.inspection import Inspection
    from airground.geometry.arrays import FloatArray

__all__ = ["draw_grid", "draw_inspection", "grid_spacing"]

LINES = 14  # about so many grid lines across the ground that is seen
SAMPLES = 200  # points along a grid line


def draw_inspection(path: Path, calibration: Calibration, inspection: Inspection) -> None:
    """Draw the image with horizon, metric grid and scale.

    Parameters
    ----------
    path : Path
        PNG to write, whole or not at all.
    calibration : Calibration
        What was inspected.
    inspection : Inspection
        What was found.
    """
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import FuncFormatter

    u0, v0, u1, v1 = inspection.frame_px
    aspect = (v1 - v0) / (u1 - u0)
    figure = new_figure(9.0, 9.0 * min(max(aspect, 0.4), 1.2) * 0.86 + 0.9)
    ax = figure.add_subplot()
    grid = np.stack(np.meshgrid(np.linspace(u0, u1, 240), np.linspace(v0, v1, 180)), axis=-1)
    scale = np.sqrt(np.prod(calibration.model.pixels_per_metre(grid), axis=-1))
    scale = np.ma.masked_where(~calibration.is_ground(grid), scale)
    largest = float(scale.max())
    smallest = max(float(scale.min()), largest / 1e3)
    flat = largest < 3 * smallest
    image = ax.imshow(
        np.ma.clip(scale, smallest, largest) if not flat else scale,
        extent=(u0, u1, v1, v0),
        norm=None if flat else LogNorm(smallest, largest),
        cmap="viridis",
        interpolation="bilinear",
        aspect="equal",
    )
    bar = figure.colorbar(image, ax=ax, shrink=0.85, pad=0.02)
    bar.set_label("scale [px/m], geometric mean over headings")
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    spacing = draw_grid(ax, calibration, inspection.frame_px)
    a, b, c = inspection.horizon
    if inspection.horizon_in_frame:
        ax.axline(*_two_points(a, b, c), color="#d62728", linewidth=2.5, label="horizon")
    ax.plot(*calibration.origin_px, "+", color="white", markersize=12, markeredgewidth=2, label="ground origin")
    if calibration.fit.region_px is not None:
        r = calibration.fit.region_px
        ax.plot(
            [r[0], r[2], r[2], r[0], r[0]], [r[1], r[1], r[3], r[3], r[1]], "--", color="white", label="driven region"
        )
    ax.set(xlim=(u0, u1), ylim=(v1, v0), xlabel="u [px]", ylabel="v [px]")
    ax.set_title(
        f"grid {spacing:g} m; ground velocities good to "
        f"{calibration.observability.relative_sigma:.1%} where the robot drove",
        fontsize=11,
    )
    ax.legend(loc="lower right", framealpha=0.85, facecolor="#4a4a4a", labelcolor="white", fontsize=9)
    save_png(figure, path)


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


def draw_grid(
    ax: Axes, calibration: Calibration, frame: tuple[float, float, float, float], *, color: str = "white"
) -> float:
    """Draw lines of constant ground x and y over the image.

    Parameters
    ----------
    ax : Axes
        In pixels, v down.
    calibration : Calibration
        Relation between image and ground.
    frame : tuple of float [px]
        Smallest u and v, largest u and v.
    color : str
        Of the lines.

    Returns
    -------
    spacing : float [m]
        Between the lines.
    """
    u0, v0, u1, v1 = frame
    u, v = np.meshgrid(np.linspace(u0, u1, 60), np.linspace(v0, v1, 60))
    uv = np.stack([u.ravel(), v.ravel()], axis=-1)
    nearness = calibration.model.nearness(uv)
    # Leave out the strip below the horizon where the ground runs to infinity.
    relative = nearness / calibration.model.nearness(calibration.origin_px)
    uv = uv[relative > 0.15 * np.quantile(relative, 0.95)]
    xy = calibration.model.ground_position(uv, calibration.origin_px)
    low, high = xy.min(axis=0), xy.max(axis=0)
    spacing = grid_spacing(float(np.max(high - low)))
    for axis in (0, 1):
        first, last = (int(np.floor(low[axis] / spacing)), int(np.ceil(high[axis] / spacing)))
        for k in range(first, last + 1):
            line = np.empty((SAMPLES, 2))
            line[:, axis] = k * spacing
            line[:, 1 - axis] = np.linspace(low[1 - axis], high[1 - axis], SAMPLES)
            _draw_line(ax, calibration.model.image_position(line, calibration.origin_px), color, bold=k == 0)
    return spacing


def _draw_line(ax: Axes, uv: FloatArray, color: str, *, bold: bool) -> None:
    ax.plot(uv[:, 0], uv[:, 1], color=color, linewidth=1.4 if bold else 0.6, alpha=0.9 if bold else 0.55)


def _two_points(a: float, b: float, c: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Two points of the line a u + b v + c = 0."""
    foot = (-c * a, -c * b)
    return foot, (foot[0] - 100 * b, foot[1] + 100 * a)
