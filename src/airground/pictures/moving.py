"""A robot as a moving camera sees it, the same held still, and what that does to the calibration."""

from __future__ import annotations

from typing import TYPE_CHECKING

from airground.pictures.style import PALETTE, SOFT, dress, new_figure, save_png

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from airground.geometry.arrays import FloatArray

__all__ = ["draw_moving"]


def draw_moving(
    path: Path,
    *,
    seen: FloatArray,
    stable: FloatArray,
    n: Mapping[str, Sequence[float | None]],
) -> None:
    """Draw the robot's track in the pictures as they are and held still, and n of each flight.

    Parameters
    ----------
    path : Path
        PNG to write.
    seen : (M, 2) array [px]
        In the pictures.
    stable : (M, 2) array [px]
        The same in the first picture.
    n : mapping of str to sequence of float or None
        Of each flight, by how it was calibrated; None where that was refused.
    """
    figure = new_figure(11.0, 4.2)
    view, bars = figure.subplots(1, 2, width_ratios=(1.4, 1.0))
    view.plot(*seen.T, ":", color=SOFT, linewidth=1.4, label="in the moving picture")
    view.plot(*stable.T, color=PALETTE[0], linewidth=1.6, label="held still")
    view.invert_yaxis()  # v points down
    view.set_aspect("equal")
    dress(view, title="The robot's track under the drone", xlabel="u [px]", ylabel="v [px]")
    view.legend(loc="best", fontsize=9, frameon=False)
    for (name, values), colour in zip(n.items(), PALETTE, strict=False):
        known = [(k, value) for k, value in enumerate(values) if value is not None]
        if known:
            bars.plot(*zip(*known, strict=True), "o", color=colour, label=name)
    bars.set_yscale("log")
    bars.set_xticks(range(max(len(values) for values in n.values())))
    dress(bars, title="n of each flight", xlabel="flight", ylabel="n")
    bars.legend(loc="best", fontsize=9, frameon=False)
    save_png(figure, path)
