"""Figure 7: a robot as the camera sees it, and the path it traced."""

from __future__ import annotations

from typing import TYPE_CHECKING

from airground.pictures.style import PALETTE, dress, new_figure, save_png

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from airground.geometry.arrays import FloatArray

__all__ = ["draw_robot_drive"]


def draw_robot_drive(
    path: Path, *, image: NDArray[np.uint8], uv: FloatArray, xy: FloatArray
) -> None:
    """Draw the camera's view with the track in it, and the path on the ground below.

    Parameters
    ----------
    path : Path
        PNG to write.
    image : (H, W, 3) array
        Blue, green, red.
    uv : (N, 2) array [px]
        The track, in the image.
    xy : (N, 2) array [m]
        The same on the ground.
    """
    figure = new_figure(7.2, 8.2)
    view, ground = figure.subplots(2, 1, height_ratios=(1.0, 0.9))
    view.imshow(image[..., ::-1])
    view.plot(*uv.T, color=PALETTE[4], linewidth=1.6)
    dress(view, title="The camera's view, and the robot's track", grid=False)
    view.set_axis_off()
    ground.plot(*xy.T, color=PALETTE[0], linewidth=1.6)
    ground.plot(*xy[0], "o", color=PALETTE[1], markersize=7, label="start")
    ground.set_aspect("equal")
    dress(ground, title="Its path on the ground", xlabel="x [m]", ylabel="y [m]")
    ground.legend(loc="best", fontsize=9, frameon=False)
    save_png(figure, path)
