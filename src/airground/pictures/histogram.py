"""How an error is spread over many trials, beside the mean and median that the paper gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.pictures.style import INK, PALETTE, SOFT, dress, new_figure, save_png

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from airground.geometry.arrays import FloatArray

__all__ = ["Series", "draw_histograms"]

MIN_BINS, MAX_BINS = 16, 40


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """One error, trial by trial."""

    label: str
    """What was measured, for the title of its panel."""

    values: FloatArray
    """(M,). One per trial."""


def draw_histograms(
    path: Path,
    series: Sequence[Series],
    *,
    xlabel: str,
    paper_mean: float,
    paper_median: float,
    mark: tuple[str, float] | None = None,
) -> None:
    """Draw histograms under each other, on one scale, each with our and the paper's mean and median.

    Parameters
    ----------
    path : Path
        PNG to write.
    series : sequence of Series
        One panel each, in this order.
    xlabel : str
        What the values are, with their unit.
    paper_mean : float
        The paper's mean; its bars are not known.
    paper_median : float
        The paper's median.
    mark : (str, float), optional
        One more value to mark, with its name.
    """
    figure = new_figure(7.5, 1.0 + 3.0 * len(series))
    panels = figure.subplots(len(series), 1, sharex=True, squeeze=False)[:, 0]
    edges = _edges([one.values for one in series])
    for k, (ax, one) in enumerate(zip(panels, series, strict=True)):
        _draw_panel(ax, one.values, edges, PALETTE[k % len(PALETTE)])
        lines = [
            (paper_mean, "-", f"paper, mean {paper_mean:.4f}"),
            (paper_median, "--", f"paper, median {paper_median:.4f}"),
        ]
        for value, dash, label in lines:
            ax.axvline(value, color=INK, linestyle=dash, linewidth=1.4, label=label)
        if mark is not None:
            ax.axvline(
                mark[1], color=SOFT, linestyle=":", linewidth=2.0, label=f"{mark[0]} {mark[1]:.4f}"
            )
        ax.set_xlim(left=0.0)
        last = k == len(series) - 1
        title = f"{one.label}, {len(one.values)} trials"
        dress(ax, title=title, xlabel=xlabel if last else "", ylabel="number of trials")
        # Above the bars' right shoulder there is always room: errors are skewed to the right.
        ax.legend(
            loc="upper right",
            handlelength=2.6,
            fontsize=9,
            frameon=True,
            framealpha=0.92,
            edgecolor="none",
            labelcolor=INK,
        )
    save_png(figure, path)


def _draw_panel(ax: Axes, values: FloatArray, edges: FloatArray, color: str) -> None:
    # Wider than the paper's lines, which are drawn on top: where both agree, both can be seen.
    mean, median = float(np.mean(values)), float(np.median(values))
    ax.hist(values, bins=edges.tolist(), color=color, alpha=0.35, edgecolor="white", linewidth=0.8)
    ax.axvline(mean, color=color, linestyle="-", linewidth=3.0, label=f"ours, mean {mean:.4f}")
    ax.axvline(
        median,
        color=color,
        linestyle=(0, (2.0, 1.0)),
        linewidth=3.0,
        label=f"ours, median {median:.4f}",
    )


def _edges(values: Sequence[FloatArray]) -> FloatArray:
    """Common bins from zero on, as narrow as the best filled series allows."""
    top = max(float(np.max(v)) for v in values)
    if not top > 0:
        return np.array([0.0, 1.0])
    widths = []
    for v in values:
        low, high = np.quantile(v, [0.25, 0.75])
        widths.append(2 * float(high - low) / len(v) ** (1 / 3))  # Freedman and Diaconis
    width = float(np.clip(min(widths), top / MAX_BINS, top / MIN_BINS))
    return np.asarray(np.arange(0.0, top + width, width))
