"""The demo's pictures: the drive on the floor, and everybody's speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.pictures.inspection import FLOOR, draw_grid, draw_tracks, legend
from airground.pictures.style import PALETTE, dress, new_figure, save_png

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from matplotlib.axes import Axes

    from airground.calibration import Calibration, Speeds, Tracks
    from airground.calibration.inspection import Inspection
    from airground.geometry.arrays import FloatArray

__all__ = ["draw_ground", "draw_overview", "draw_speeds"]

BAND = 1.96  # standard deviations that hold 95 per cent


def draw_ground(
    path: Path, calibration: Calibration, tracks: Tracks, target: str, truth: FloatArray
) -> None:
    """Draw a target's sightings, taken to metres, over its true path.

    Parameters
    ----------
    path : Path
        PNG to write.
    calibration : Calibration
        Relation between image and ground.
    tracks : Tracks
        Sightings.
    target : str
        Whose.
    truth : (N, 2) array [m]
        True positions at its sightings.
    """
    seen = calibration.undistort(tracks.uv[tracks.rows(target)])
    xy = calibration.model.ground_position(seen, calibration.origin_px)
    xy = xy - np.nanmean(xy - truth, axis=0)  # the origin is free
    figure = new_figure(9.0, 5.4)
    ax = figure.add_subplot()
    ax.plot(
        xy[:, 0],
        xy[:, 1],
        ".",
        color=PALETTE[0],
        markersize=2.5,
        alpha=0.55,
        label="sightings, rectified",
    )
    ax.plot(truth[:, 0], truth[:, 1], color=PALETTE[1], linewidth=1.6, label="true path")
    ax.set_aspect("equal")
    rms = float(np.sqrt(np.nanmean(np.sum((xy - truth) ** 2, axis=1))))
    dress(
        ax,
        title=f"distance between the two: {1e3 * rms:.0f} mm rms",
        xlabel="x [m]",
        ylabel="y [m]",
    )
    ax.legend(loc="upper center", markerscale=3)
    save_png(figure, path)


def draw_speeds(path: Path, speeds: Speeds, truth: Mapping[str, float]) -> None:
    """Draw measured speeds over time, with bands that hold 95 per cent, and the truth.

    Parameters
    ----------
    path : Path
        PNG to write.
    speeds : Speeds
        Measured.
    truth : mapping of str to float [m/s]
        True speed of each target, which does not change.
    """
    figure = new_figure(9.0, 4.2)
    _speeds(figure.add_subplot(), speeds, truth)
    save_png(figure, path)


def draw_overview(
    path: Path,
    calibration: Calibration,
    inspection: Inspection,
    tracks: Tracks,
    speeds: Speeds,
    *,
    truth: Mapping[str, float],
) -> None:
    """Draw view and speeds side by side: one picture that tells the story.

    Parameters
    ----------
    path : Path
        PNG to write.
    calibration : Calibration
        Relation between image and ground.
    inspection : Inspection
        What it says.
    tracks : Tracks
        Sightings.
    speeds : Speeds
        Measured.
    truth : mapping of str to float [m/s]
        True speed of each target.
    """
    figure = new_figure(13.0, 4.4)
    view, plot = figure.subplots(1, 2, width_ratios=(1.25, 1))
    u0, v0, u1, v1 = inspection.frame_px
    view.set_facecolor(FLOOR)
    view.set(xlim=(u0, u1), ylim=(v1, v0), aspect="equal")
    spacing = draw_grid(view, calibration, inspection.frame_px)
    draw_tracks(view, tracks)
    legend(view)
    title = f"seen: pixels, with the floor's metric grid ({spacing:g} m)"
    dress(view, title=title, xlabel="u [px]", ylabel="v [px]", grid=False)
    _speeds(plot, speeds, truth, title="measured: ground speed, with 95 % bands")
    save_png(figure, path)


def _speeds(ax: Axes, speeds: Speeds, truth: Mapping[str, float], *, title: str = "") -> None:
    for k, name in enumerate(speeds.targets):
        mine = speeds.target_index == k
        t, v, band = speeds.t[mine], speeds.speed[mine], BAND * speeds.speed_sigma[mine]
        ax.fill_between(t, v - band, v + band, color=PALETTE[k], alpha=0.22, linewidth=0)
        ax.plot(t, v, color=PALETTE[k], linewidth=0.9, label=f"{name}, measured")
        if name in truth:
            ax.hlines(
                truth[name], t[0], t[-1], color="black", linestyle="--", linewidth=1.2, zorder=3
            )
    ax.plot([], [], "--", color="black", linewidth=1.2, label="truth")
    ax.set_ylim(0, 1.45 * float(np.quantile(speeds.speed, 0.999)))
    dress(ax, title=title, xlabel="time [s]", ylabel="ground speed [m/s]")
    ax.legend(loc="upper right", ncols=3, fontsize=9)
