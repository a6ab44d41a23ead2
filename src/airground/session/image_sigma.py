"""How well a calibration knows ground velocities over the image, not only where robots were seen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.observability import relative_sigma

if TYPE_CHECKING:
    from airground.calibration import Calibration

__all__ = ["image_sigma"]

GRID = (7, 5)
NEAR = (
    0.2  # of the largest scale in the image: ground further away is not what an operator drives on
)


def image_sigma(calibration: Calibration, size_px: tuple[int, int], border_px: float) -> float:
    """Relative standard deviation of a ground velocity over the image, and all headings.

    Parameters
    ----------
    calibration : Calibration
        What is known.
    size_px : (int, int) [px]
        Of the image.
    border_px : float [px]
        Left out at the image's border.

    Returns
    -------
    sigma : float
        Root mean square over the ground that is not too far away; infinite where there is none.
    """
    low, high = border_px, np.array(size_px) - 1 - border_px
    u, v = (np.linspace(low, high[k], GRID[k]) for k in (0, 1))
    uv = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    uv = uv[calibration.is_ground(uv)]
    if not len(uv):
        return float("inf")
    model, plane = calibration.model, calibration.undistort(uv)
    scale = model.pixels_per_metre(plane)[:, 0]
    plane = plane[scale >= NEAR * scale.max()]
    sigma = relative_sigma(model.g, calibration.covariance, plane)
    return sigma if np.isfinite(sigma) else float("inf")
