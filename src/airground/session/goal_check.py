"""What is refused before a robot moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError, UndeterminedError

if TYPE_CHECKING:
    from airground.calibration import Calibration
    from airground.geometry.arrays import FloatArray

__all__ = ["check_goal"]

WORST_SIGMA = 0.2  # relative deviation of ground velocities where a robot is still sent to


def check_goal(calibration: Calibration, uv: FloatArray, what: str = "the goal") -> None:
    """Refuse a pixel that no robot can be sent to.

    Parameters
    ----------
    calibration : Calibration
        To drive with.
    uv : (2,) array [px]
        The raw pixel.
    what : str
        What to call it.

    Raises
    ------
    InputError
        If it is outside the image, or no ground.
    UndeterminedError
        If the calibration does not say enough about its place.
    """
    u, v = uv.tolist()
    size = calibration.image_size_px
    if size is not None and not (-0.5 <= u <= size[0] - 0.5 and -0.5 <= v <= size[1] - 0.5):
        raise InputError(
            f"{what} {u:g},{v:g} is outside the image of {size[0]}x{size[1]} px; choose a pixel in it"
        )
    if not bool(calibration.is_ground(uv)):
        raise InputError(
            f"{what} {u:g},{v:g} lies on or above the horizon; choose a pixel on the ground"
        )
    unit = calibration.jacobian(uv) @ np.array([1.0, 0.0])
    _, covariance = calibration.ground_velocity(uv, unit)
    sigma = float(np.sqrt(np.trace(covariance) / 2))
    if not sigma <= WORST_SIGMA:
        raise UndeterminedError(
            f"the calibration leaves speeds at {what} {u:g},{v:g} uncertain by {sigma:.0%}; "
            "calibrate with a drive that comes nearer to it"
        )
