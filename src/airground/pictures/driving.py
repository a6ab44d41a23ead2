"""Pictures of robots that go where the image says: figures 8 to 11, and the demo's drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.pictures.style import INK, PALETTE, SOFT, dress, new_figure, save_png

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from airground.geometry.arrays import FloatArray

__all__ = [
    "draw_demo_drive",
    "draw_goals",
    "draw_ground_path",
    "draw_image_path",
    "draw_velocities",
]

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


def draw_demo_drive(
    path: Path,
    *,
    size_px: tuple[int, int],
    sketch: FloatArray,
    path_uv: FloatArray,
    along: FloatArray,
    before: FloatArray,
    goals: FloatArray,
    to_goals: FloatArray,
    planned: tuple[FloatArray, FloatArray],
    speed: tuple[FloatArray, FloatArray],
) -> None:
    """Draw the demo's drive in the image, and the speed along the path over time.

    Parameters
    ----------
    path : Path
        PNG to write.
    size_px : (int, int) [px]
        Width and height of the image.
    sketch : (N, 2) array [px]
        As drawn by hand.
    path_uv : (P, 2) array [px]
        What became of it.
    along : (M, 2) array [px]
        Where the robot was while following it.
    before : (L, 2) array [px]
        Where it was on its way there.
    goals : (K, 2) array [px]
        What was clicked, in order.
    to_goals : (J, 2) array [px]
        Where it was on its way to those.
    planned : ((P,) array, (P,) array) [s, m/s]
        When each point of the path is to be passed, and how fast.
    speed : ((M,) array, (M,) array) [s, m/s]
        Times since the path's start, and true speeds.
    """
    figure = new_figure(11.0, 4.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    left.plot(*sketch.T, ".", color=PALETTE[4], markersize=4, label="sketch")
    left.plot(*path_uv.T, "--", color=WANTED, linewidth=1.4, label="path")
    left.plot(*along.T, color=DRIVEN, linewidth=1.6, label="driven")
    for way in (before, to_goals):
        left.plot(*way.T, ":", color=SOFT, linewidth=1.2)
    left.plot(
        *goals.T, "o", markerfacecolor="none", markeredgecolor=WANTED, markersize=10, label="goals"
    )
    _image_axes(left, size_px, "in the image")
    left.legend(loc="lower left", fontsize=9, frameon=False)
    right.plot(*planned, "--", color=WANTED, linewidth=1.4, label="planned")
    right.plot(*speed, color=DRIVEN, linewidth=1.4, label="true")
    dress(right, title="ground speed along the path", xlabel="t [s]", ylabel="v [m/s]")
    right.set_ylim(bottom=0.0)
    right.legend(loc="lower center", fontsize=9, frameon=False)
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
