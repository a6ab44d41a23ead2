"""One figure for each of several things, by several methods: bars on a logarithmic axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.pictures.style import INK, PALETTE, dress, new_figure, save_png

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

__all__ = ["draw_bars"]

THICK = 0.8  # of the place that one thing has


def draw_bars(
    path: Path,
    names: Sequence[str],
    methods: Mapping[str, Sequence[float | None]],
    *,
    title: str,
    xlabel: str,
) -> None:
    """Draw a group of bars for each thing, the first one on top.

    Parameters
    ----------
    path : Path
        PNG to write.
    names : sequence of str
        Of the things.
    methods : mapping of str to sequence of float or None
        For each method one value per thing; no bar where there is none.
    title : str
        Above.
    xlabel : str
        What the values are, with their unit.
    """
    figure = new_figure(9.0, 1.6 + 0.2 * len(methods) * len(names))
    ax = figure.subplots()
    known = [x for values in methods.values() for x in values if x is not None and x > 0]
    least = min(known, default=1.0) / 3
    width = THICK / len(methods)
    for k, (label, values) in enumerate(methods.items()):
        shown = [(i, x) for i, x in enumerate(values) if x is not None and x > 0]
        places = [i + (k - (len(methods) - 1) / 2) * width for i, _ in shown]
        lengths = [x - least for _, x in shown]
        color = PALETTE[k % len(PALETTE)]
        ax.barh(places, lengths, height=0.92 * width, left=least, color=color, label=label)
        for place, (_, x) in zip(places, shown, strict=True):
            ax.annotate(
                f"{x:.3g}",
                (x, place),
                (3, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
                color=INK,
            )
    ax.set_xscale("log")
    ax.set_xlim(least, 3 * max(known, default=1.0))
    ax.set_yticks(np.arange(len(names)), names)
    ax.invert_yaxis()
    dress(ax, title=title, xlabel=xlabel)
    ax.grid(visible=False, axis="y")
    figure.legend(
        loc="outside lower center", ncols=len(methods), frameon=False, fontsize=9, labelcolor=INK
    )
    save_png(figure, path)
