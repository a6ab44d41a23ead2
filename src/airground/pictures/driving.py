"""Pictures of robots that go where the image says: figures 8 to 11, and the demo's drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.pictures.style import INK, PALETTE, SOFT, dress, new_figure, save_png

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from airground.geometry.arrays import FloatArray

__all__ = ["draw_goals", "draw_ground_path", "draw_image_path", "draw_velocities"]

WANTED, DRIVEN, CALIBRATION = PALETTE[1], PALETTE[0], SOFT


def draw_image_path(
    path: Path,
    *,
    size_px: tuple[int, int],
    wanted: FloatArray,
    driven: FloatArray,
    heading: FloatArray,
    title: str = "",
) -> None:
    """Draw a wanted path and the driven one as the camera sees them (figure 8).

    Parameters
    ----------
    path : Path
        PNG to write.
    size_px : (int, int) [px]
        Width and height of the image.
    wanted : (N, 2) array [px]
        What was asked for.
    driven : (M, 2) array [px]
        What was driven.
    heading : (2,) array [px]
        Image of a point ahead of the robot at its start.
    title : str
        Above it.
    """
    figure = new_figure(7.2, 4.6)
    ax = figure.add_subplot()
    ax.plot(*wanted.T, "--", color=WANTED, linewidth=1.8, label="wanted")
    ax.plot(*driven.T, color=DRIVEN, linewidth=1.6, label="driven")
    _start(ax, driven[0], heading)
    _image_axes(ax, size_px, title)
    ax.legend(loc="best", fontsize=9, frameon=False)
    save_png(figure, path)


def draw_ground_path(
    path: Path, *, wanted: FloatArray, driven: FloatArray, heading: FloatArray, title: str = ""
) -> None:
    """Draw a wanted path and the driven one on the ground (figure 9).

    Parameters
    ----------
    path : Path
        PNG to write.
    wanted : (N, 2) array [m]
        What was asked for.
    driven : (M, 2) array [m]
        What was driven.
    heading : (2,) array [m]
        Point ahead of the robot at its start.
    title : str
        Above it.
    """
    figure = new_figure(6.4, 5.2)
    ax = figure.add_subplot()
    ax.plot(*wanted.T, color=WANTED, linewidth=1.8, label="wanted")
    ax.plot(*driven.T, "-.", color=DRIVEN, linewidth=1.6, label="driven")
    _start(ax, driven[0], heading)
    ax.set_aspect("equal")
    dress(ax, title=title, xlabel="x [m]", ylabel="y [m]")
    ax.legend(loc="best", fontsize=9, frameon=False)
    save_png(figure, path)


def draw_velocities(
    path: Path, *, t: FloatArray, v: FloatArray, omega: FloatArray, title: str = ""
) -> None:
    """Draw forward and angular velocity over time (figure 10).

    Parameters
    ----------
    path : Path
        PNG to write.
    t : (N,) array [s]
        Times.
    v : (N,) array [m/s]
        Forward velocity.
    omega : (N,) array [rad/s]
        Angular velocity.
    title : str
        Above it.
    """
    figure = new_figure(7.2, 4.8)
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(t, v, color=PALETTE[0], linewidth=1.4)
    below.plot(t, omega, color=PALETTE[1], linewidth=1.4)
    for ax in (above, below):
        ax.axhline(0.0, color=SOFT, linewidth=0.8)
    dress(above, title=title, ylabel="v [m/s]")
    dress(below, xlabel="t [s]", ylabel="ω [rad/s]")
    save_png(figure, path)


def draw_goals(
    path: Path,
    *,
    size_px: tuple[int, int],
    calibration: FloatArray,
    driven: FloatArray,
    goals: FloatArray,
    title: str = "",
) -> None:
    """Draw a calibration drive, and the way through clicked goals after it, in the image (figure 11).

    Parameters
    ----------
    path : Path
        PNG to write.
    size_px : (int, int) [px]
        Width and height of the image.
    calibration : (N, 2) array [px]
        Where the robot was during calibration.
    driven : (M, 2) array [px]
        Where it was on its way through the goals.
    goals : (K, 2) array [px]
        What was clicked, in order.
    title : str
        Above it.
    """
    figure = new_figure(7.2, 4.6)
    ax = figure.add_subplot()
    ax.plot(*calibration.T, ":", color=CALIBRATION, linewidth=1.8, label="calibration drive")
    ax.plot(*driven.T, color=DRIVEN, linewidth=1.6, label="from goal to goal")
    ax.plot(
        *goals.T,
        "o",
        markerfacecolor="none",
        markeredgecolor=WANTED,
        markersize=11,
        markeredgewidth=1.6,
        label="clicked goals",
    )
    for k, (u, v) in enumerate(goals.tolist()):
        ax.annotate(
            str(k + 1), (u, v), xytext=(9, 7), textcoords="offset points", fontsize=9, color=INK
        )
    ax.plot(*driven[0], "+", color=INK, markersize=14, markeredgewidth=1.6)
    _image_axes(ax, size_px, title)
    ax.legend(loc="best", fontsize=9, frameon=False)
    save_png(figure, path)


def _start(ax: Axes, at: FloatArray, ahead: FloatArray) -> None:
    """Cross-hair and line: where the robot starts, and where it heads."""
    ax.plot(*np.stack([at, ahead]).T, color=INK, linewidth=1.6)
    ax.plot(*at, "+", color=INK, markersize=14, markeredgewidth=1.6, label="start")


def _image_axes(ax: Axes, size_px: tuple[int, int], title: str) -> None:
    width, height = size_px
    ax.set_xlim(-0.5, width - 0.5)
    ax.set_ylim(height - 0.5, -0.5)  # v points down
    ax.set_aspect("equal")
    dress(ax, title=title, xlabel="u [px]", ylabel="v [px]")
