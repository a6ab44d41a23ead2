"""Pictures of robots that go where the image says: figures 8 to 11, and the demo's drive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.pictures.style import INK, PALETTE, SOFT, dress, new_figure, save_png

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "DrivenPanel",
    "draw_demo_drive",
    "draw_goals",
    "draw_ground_paths",
    "draw_image_paths",
    "draw_velocities",
]

WANTED, DRIVEN, CALIBRATION = PALETTE[1], PALETTE[0], SOFT


@dataclass(frozen=True, slots=True, eq=False)
class DrivenPanel:
    """A drive beside what was wanted, in one world."""

    title: str
    """Above it."""

    wanted: FloatArray
    """(N, 2) [px or m]. A path, or goals in order."""

    driven: FloatArray
    """(M, 2). The same of what was driven."""

    size_px: tuple[int, int] = (0, 0)
    """Width and height of the image; not used on the ground."""

    heading: FloatArray | None = None
    """(2,). A point ahead of the robot at its start."""

    calibration: FloatArray | None = None
    """(L, 2). Where the robot was during calibration."""


def draw_image_paths(path: Path, panels: Sequence[DrivenPanel]) -> None:
    """Draw wanted paths and driven ones as the camera sees them (figure 8).

    Parameters
    ----------
    path : Path
        PNG to write.
    panels : sequence of DrivenPanel
        Of one world each, in pixels.
    """
    figure = new_figure(7.2 if len(panels) == 1 else 11.0, 4.6 if len(panels) == 1 else 4.0)
    for ax, panel in _each(figure, panels):
        ax.plot(*panel.wanted.T, "--", color=WANTED, linewidth=1.8, label="wanted")
        ax.plot(*panel.driven.T, color=DRIVEN, linewidth=1.6, label="driven")
        _start(ax, panel)
        _image_axes(ax, panel.size_px, panel.title)
        ax.legend(loc="best", fontsize=9, frameon=False)
    save_png(figure, path)


def draw_ground_paths(path: Path, panels: Sequence[DrivenPanel]) -> None:
    """Draw wanted paths and driven ones on the ground (figure 9).

    Parameters
    ----------
    path : Path
        PNG to write.
    panels : sequence of DrivenPanel
        Of one world each, in metres.
    """
    figure = new_figure(6.4 if len(panels) == 1 else 11.0, 5.2 if len(panels) == 1 else 4.6)
    for ax, panel in _each(figure, panels):
        ax.plot(*panel.wanted.T, color=WANTED, linewidth=1.8, label="wanted")
        ax.plot(*panel.driven.T, "-.", color=DRIVEN, linewidth=1.6, label="driven")
        _start(ax, panel)
        ax.set_aspect("equal")
        dress(ax, title=panel.title, xlabel="x [m]", ylabel="y [m]")
        ax.legend(loc="best", fontsize=9, frameon=False)
    save_png(figure, path)


def draw_velocities(
    path: Path, curves: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]], title: str = ""
) -> None:
    """Draw forward and angular velocity over time (figure 10).

    Parameters
    ----------
    path : Path
        PNG to write.
    curves : mapping of str to ((N,) array, (N,) array, (N,) array) [s, m/s, rad/s]
        Time, forward and angular velocity, by where they were driven.
    title : str
        Above it.
    """
    figure = new_figure(7.2, 4.8)
    above, below = figure.subplots(2, 1, sharex=True)
    for (name, (t, v, omega)), colour in zip(curves.items(), PALETTE, strict=False):
        above.plot(t, v, color=colour, linewidth=1.3, label=name)
        below.plot(t, omega, color=colour, linewidth=1.3)
    for ax in (above, below):
        ax.axhline(0.0, color=SOFT, linewidth=0.8)
    if len(curves) > 1:
        above.legend(loc="best", fontsize=9, frameon=False)
    dress(above, title=title, ylabel="v [m/s]")
    dress(below, xlabel="t [s]", ylabel="ω [rad/s]")
    save_png(figure, path)


def draw_goals(path: Path, panels: Sequence[DrivenPanel]) -> None:
    """Draw calibration drives, and the ways through clicked goals after them, in the image (figure 11).

    Parameters
    ----------
    path : Path
        PNG to write.
    panels : sequence of DrivenPanel
        Of one world each, in pixels; wanted are the goals, in order.
    """
    figure = new_figure(7.2 if len(panels) == 1 else 11.0, 4.6 if len(panels) == 1 else 4.0)
    for ax, panel in _each(figure, panels):
        if panel.calibration is not None:
            ax.plot(
                *panel.calibration.T,
                ":",
                color=CALIBRATION,
                linewidth=1.8,
                label="calibration drive",
            )
        ax.plot(*panel.driven.T, color=DRIVEN, linewidth=1.6, label="from goal to goal")
        ax.plot(
            *panel.wanted.T,
            "o",
            markerfacecolor="none",
            markeredgecolor=WANTED,
            markersize=11,
            markeredgewidth=1.6,
            label="clicked goals",
        )
        for k, (u, v) in enumerate(panel.wanted.tolist()):
            ax.annotate(
                str(k + 1), (u, v), xytext=(9, 7), textcoords="offset points", fontsize=9, color=INK
            )
        _start(ax, panel)
        _image_axes(ax, panel.size_px, panel.title)
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


def _each(figure: Figure, panels: Sequence[DrivenPanel]) -> Iterator[tuple[Axes, DrivenPanel]]:
    """Axes side by side."""
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    yield from zip(axes, panels, strict=True)


def _start(ax: Axes, panel: DrivenPanel) -> None:
    """Cross-hair and line: where the robot starts, and where it heads."""
    at = panel.driven[0]
    if panel.heading is not None:
        ax.plot(*np.stack([at, panel.heading]).T, color=INK, linewidth=1.6)
    ax.plot(*at, "+", color=INK, markersize=14, markeredgewidth=1.6, label="start")


def _image_axes(ax: Axes, size_px: tuple[int, int], title: str) -> None:
    width, height = size_px
    ax.set_xlim(-0.5, width - 0.5)
    ax.set_ylim(height - 0.5, -0.5)  # v points down
    ax.set_aspect("equal")
    dress(ax, title=title, xlabel="u [px]", ylabel="v [px]")
