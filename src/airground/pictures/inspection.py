"""A calibration as a picture: the image with its horizon, a metric grid on the ground, and the scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.metric_grid import grid_spacing, metric_grid
from airground.pictures.style import SOFT, dress, new_figure, save_png

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from airground.calibration import Tracks
    from airground.calibration.calibration import Calibration
    from airground.calibration.inspection import Inspection

__all__ = ["FLOOR", "draw_grid", "draw_inspection", "draw_tracks", "legend"]

FLOOR = "#20262d"
HORIZON = "#d55e00"
SKY = "#eef3f7"
SCALE = "#b8e0c8"
TRACKS = ("#56b4e9", "#ffa94d", "#e58fc0", "#f0e442")  # stand out on dark and on slate
LEVELS = 3.5  # for about four of them, by `grid_spacing`
REACH = 1.1  # frame heights; a horizon further than this from the middle is not shown


def draw_inspection(
    path: Path, calibration: Calibration, inspection: Inspection, *, tracks: Tracks | None = None
) -> None:
    """Draw the image with horizon, metric grid and scale.

    Parameters
    ----------
    path : Path
        PNG to write, whole or not at all.
    calibration : Calibration
        What was inspected.
    inspection : Inspection
        What was found.
    tracks : Tracks, optional
        Sightings to draw on top.
    """
    from matplotlib.patches import Rectangle

    u0, v0, u1, v1 = frame = inspection.frame_px
    wide = _with_horizon(inspection)
    view = wide or frame
    aspect = (view[3] - view[1]) / (view[2] - view[0])
    figure = new_figure(9.5, 8.0 * min(max(aspect, 0.4), 1.2) + 0.7)
    ax = figure.add_subplot()
    ax.set_facecolor(SKY)
    _draw_scale(ax, calibration, frame)
    spacing = draw_grid(ax, calibration, frame)
    if wide is not None:
        ax.plot(*inspection.horizon_uv.T, color=HORIZON, linewidth=2.5, label="horizon")
        ax.add_patch(Rectangle((u0, v0), u1 - u0, v1 - v0, fill=False, edgecolor=SOFT))
    if tracks is not None:
        draw_tracks(ax, tracks)
    elif calibration.fit.region_px is not None:
        r = calibration.fit.region_px
        ax.add_patch(
            Rectangle(
                r[:2],
                r[2] - r[0],
                r[3] - r[1],
                fill=False,
                edgecolor="white",
                linestyle="--",
                label="driven region",
            )
        )
    ax.plot(
        *calibration.distort(calibration.origin_px),
        "+",
        color="white",
        markersize=12,
        markeredgewidth=2,
    )
    ax.set(xlim=(view[0], view[2]), ylim=(view[3], view[1]))
    where = "" if wide is not None else "; horizon far outside the image"
    dress(
        ax,
        title=f"grid {spacing:g} m; velocities good to {calibration.observability.relative_sigma:.1%}{where}",
        xlabel="u [px]",
        ylabel="v [px]",
        grid=False,
    )
    legend(ax)
    save_png(figure, path)


def _with_horizon(inspection: Inspection) -> tuple[float, float, float, float] | None:
    """The frame, grown to show the horizon; None where that would leave more sky than ground."""
    u0, v0, u1, v1 = inspection.frame_px
    low, high, middle = np.array([u0, v0]), np.array([u1, v1]), np.array([u0 + u1, v0 + v1]) / 2
    reach, margin = REACH * (v1 - v0), 0.06 * (v1 - v0)
    a, b, _ = inspection.horizon
    # As far as it goes within the frame's columns (or rows, if it runs along them), but not without end.
    across = 0 if abs(b) > abs(a) else 1
    curve = inspection.horizon_uv
    near = np.linalg.norm(curve - middle, axis=1) <= reach
    curve = curve[(curve[:, across] >= low[across]) & (curve[:, across] <= high[across])]
    if len(curve) == 0 or not near.any():
        return None
    curve = np.clip(curve, middle - reach, middle + reach)
    least, most = curve.min(axis=0), curve.max(axis=0)
    low = np.minimum(low, least - margin * (least < low))
    high = np.maximum(high, most + margin * (most > high))
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _draw_scale(
    ax: Axes, calibration: Calibration, frame: tuple[float, float, float, float]
) -> None:
    """Shade the ground by its scale, with labelled lines."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    u0, v0, u1, v1 = frame
    grid = np.stack(np.meshgrid(np.linspace(u0, u1, 240), np.linspace(v0, v1, 180)), axis=-1)
    ground = calibration.is_ground(grid)
    scale = np.zeros(ground.shape)
    # Geometric mean of the smallest and the largest.
    scale[ground] = np.sqrt(np.abs(np.linalg.det(calibration.jacobian(grid[ground]))))
    scale = np.ma.masked_where(~ground, scale)
    largest = float(scale.max())
    smallest = max(float(scale.min()), largest / 300)  # towards the horizon it falls to nothing
    slate = LinearSegmentedColormap.from_list("slate", [FLOOR, "#76899b"])
    ax.imshow(
        np.ma.clip(scale, smallest, largest),
        extent=(u0, u1, v1, v0),
        norm=LogNorm(smallest, largest),
        cmap=slate,
        interpolation="bilinear",
        aspect="equal",
    )
    levels = _round_levels(smallest, largest)
    if levels:
        lines = ax.contour(
            grid[..., 0], grid[..., 1], scale, levels=levels, colors=SCALE, linewidths=1.0
        )
        ax.clabel(lines, fmt=lambda x: f"{x:g} px/m", fontsize=9)
    else:
        ax.text(
            0.02,
            0.97,
            f"{largest:.4g} px/m everywhere",
            transform=ax.transAxes,
            va="top",
            color=SCALE,
        )


def _round_levels(low: float, high: float) -> list[float]:
    """Round numbers between two, about six at most."""
    if high - low < 1e-6 * high:  # straight down: one scale for all
        return []
    if high < 3 * low:  # nearly so: equal steps
        step = grid_spacing((high - low) * LEVELS)
        first = int(np.ceil(low / step * (1 + 1e-9)))
        return [float(f"{k * step:.12g}") for k in range(first, int(np.ceil(high / step)))]
    for digits in ((1, 1.5, 2, 3, 5, 7), (1, 2, 3, 5), (1, 2, 5), (1, 3), (1,)):
        powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        levels = [float(d * p) for p in powers for d in digits if low < d * p < high]
        if len(levels) <= 6:
            break
    return levels


def legend(ax: Axes) -> None:
    """Put a legend on a dark view.

    Parameters
    ----------
    ax : Axes
        With labelled artists, or without: then there is nothing to explain.
    """
    if not ax.get_legend_handles_labels()[0]:
        return
    ax.legend(
        loc="lower right",
        framealpha=0.85,
        facecolor=FLOOR,
        edgecolor=SOFT,
        labelcolor="white",
        fontsize=9,
        markerscale=2.5,
    )


def draw_tracks(ax: Axes, tracks: Tracks) -> None:
    """Draw sightings, one colour for each target.

    Parameters
    ----------
    ax : Axes
        In pixels, v down.
    tracks : Tracks
        Sightings.
    """
    for k, name in enumerate(tracks.targets):
        uv = tracks.uv[tracks.rows(name)]
        ax.plot(uv[:, 0], uv[:, 1], ".", color=TRACKS[k % len(TRACKS)], markersize=2.5, label=name)


def draw_grid(
    ax: Axes,
    calibration: Calibration,
    frame: tuple[float, float, float, float],
    *,
    color: str = "white",
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
    from matplotlib.patches import Rectangle

    u0, v0, u1, v1 = frame
    found = metric_grid(calibration, frame)
    inside = Rectangle(
        (u0, v0), u1 - u0, v1 - v0, transform=ax.transData
    )  # not over the sky above the image
    for uv, through_origin in zip(found.lines, found.axes, strict=True):
        width, alpha = (1.4, 0.9) if through_origin else (0.6, 0.55)
        (drawn,) = ax.plot(uv[:, 0], uv[:, 1], color=color, linewidth=width, alpha=alpha)
        drawn.set_clip_path(inside)
    return found.spacing_m
