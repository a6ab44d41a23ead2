"""The camera of the paper's Table 1, as far as the paper tells it, and the rest as it must be chosen.

Table 1 gives the first two columns of G, scaled as in eq. 21; Table 2 gives the same camera with -0.00064 in place
of -0.00065, as the third row is rounded. The third column is not given. It does not have to be guessed, and g needs
no scaling: with the ground's origin seen at the image point c0, ``G3 = c0 / (n.c0)``, n = G1 x G2, gives

    det(G) = (G1 x G2) . G3 = n.c0 / (n.c0) = 1

so that g is already scaled as in eq. 21 for every origin. Only the place of the drive in the image is open. The
paper's sensor, a Sony ICX204, has 1024x768 pixels; we put the middle of the drive's extent into the middle of that
image, where the paper's 8 segments of 5 s leave more than 130 px to every border.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.sim.camera import SimCamera

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["G_IDEAL", "G_PAPER_SIM", "IMAGE_SIZE_PX", "camera_at", "paper_camera"]

G_IDEAL = np.array([[-8.8347, -2.0486], [-0.2190, 3.3972], [-0.00065, -0.0048]])
"""(3, 2). Table 1, "ideal"."""

G_PAPER_SIM = np.array([[-9.4843, -2.5053], [-0.4463, 3.5419], [-0.0022, -0.0052]])
"""(3, 2). Table 1, "sim": what the paper's method recovered in a typical trial."""

IMAGE_SIZE_PX = (1024, 768)
"""Of the Sony ICX204 in the paper's camera (section 3.2)."""

MAX_STEPS = 100  # each takes off most of what is left

G_IDEAL.flags.writeable = False
G_PAPER_SIM.flags.writeable = False


def camera_at(origin_uv: FloatArray) -> SimCamera:
    """Table 1's camera with the ground's origin at an image point.

    Parameters
    ----------
    origin_uv : (2,) array [px]
        Where the ground's origin is seen.

    Returns
    -------
    camera : SimCamera
        With the g of Table 1.
    """
    c0 = np.append(origin_uv, 1.0)
    n = np.cross(G_IDEAL[:, 0], G_IDEAL[:, 1])
    return SimCamera(np.column_stack([G_IDEAL, c0 / (n @ c0)]), IMAGE_SIZE_PX)


def paper_camera(xy: FloatArray, shift_px: tuple[float, float] = (0.0, 0.0)) -> SimCamera:
    """Table 1's camera with a path in the middle of the image, or beside it.

    Parameters
    ----------
    xy : (N, 2) array [m]
        Ground points of the path; the corners of straight segments will do, as straight lines stay straight.
    shift_px : (float, float) [px]
        Where the middle of the path's bounding box is seen, from the middle of the image.

    Returns
    -------
    camera : SimCamera
        Its image holds the path.

    Raises
    ------
    InputError
        If the path does not fit into the image.
    """
    middle = (np.array(IMAGE_SIZE_PX) - 1) / 2
    camera = camera_at(middle)
    ground = np.mean(
        xy, axis=0
    )  # the ground point seen in the middle; it moves until the box is in place
    for _ in range(MAX_STEPS):
        uv = camera.project(xy - ground)  # the same g: only the origin is another
        off = (uv.min(axis=0) + uv.max(axis=0)) / 2 - middle - shift_px
        if not np.isfinite(off).all():  # the path runs behind the camera
            break
        if np.abs(off).max() < 1e-9:
            moved = camera_at(camera.project(-ground))
            if moved.visible(xy).all():
                return moved
            break
        ground = ground + camera.unproject(middle + off)
    size = "x".join(str(pixels) for pixels in IMAGE_SIZE_PX)
    raise InputError(f"the drive does not fit into the paper's {size} image; make it shorter")
