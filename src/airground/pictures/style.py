"""One look for all pictures: colours that colour-blind people can tell apart, and no global state.

Figures are made and saved as objects; pyplot and its state are never touched, so that pictures can be drawn in any
thread and without a screen.
"""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["GRID", "INK", "PALETTE", "SOFT", "dress", "new_figure", "save_png"]

PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Series in this order (Okabe and Ito): blue, vermilion, green, purple, orange, sky."""

INK = "#1c2530"
"""Text and axes."""

SOFT = "#5b6774"
"""What should stay behind: tick labels, remarks."""

GRID = "#e3e8ed"
"""Grid lines."""

DPI = 150


def new_figure(width_in: float, height_in: float) -> Figure:
    """Empty figure that is laid out without overlaps.

    Parameters
    ----------
    width_in : float [inch]
        Width.
    height_in : float [inch]
        Height.

    Returns
    -------
    figure : Figure
        With the Agg canvas.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def dress(
    ax: Axes, *, title: str = "", xlabel: str = "", ylabel: str = "", grid: bool = True
) -> None:
    """Give axes the common look; call it after drawing.

    Parameters
    ----------
    ax : Axes
        To be changed.
    title : str
        Above, to the left.
    xlabel : str
        With its unit.
    ylabel : str
        With its unit.
    grid : bool
        Whether to draw lines behind the data.
    """
    ax.set_title(title, loc="left", fontsize=11, color=INK, fontweight="bold", pad=8)
    ax.set_xlabel(xlabel, fontsize=10, color=INK)
    ax.set_ylabel(ylabel, fontsize=10, color=INK)
    ax.tick_params(labelsize=9, labelcolor=SOFT, color=SOFT, length=3)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(SOFT)
    ax.set_axisbelow(True)
    if grid:
        ax.grid(color=GRID, linewidth=0.8)


def save_png(figure: Figure, path: Path) -> None:
    """Draw the figure into a PNG; the same figure gives the same bytes.

    Parameters
    ----------
    figure : Figure
        Of `new_figure`.
    path : Path
        File to write, after drawing has succeeded. Give it the temporary file of `records.replacing` where a full
        disk or Ctrl-C must not leave half a picture.
    """
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    path.write_bytes(buffer.getvalue())
