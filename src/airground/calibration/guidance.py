"""Where to drive next, so that few metres of driving calibrate well.

A leg is judged by what it, and the best one after it, are expected to leave of the uncertainty of ground velocities
over the image, for each metre. Without the look ahead, legs would end in corners from which nothing good leads on.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.calibration import Calibration
from airground.calibration.guidance_planner import Planner
from airground.calibration.guidance_types import Leg, LegOptions
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.calibration.online import OnlineCalibrator

__all__ = ["next_leg"]

SCRIPT_TURN = math.pi / 3  # a hexagon: headings well apart, and back at the start
SCRIPT_SIDES = 6
SCRIPT_SHIFT = math.pi / 6  # of the next hexagon, driven the other way round


def next_leg(
    calibration: Calibration | OnlineCalibrator | None,
    uv: ArrayLike,
    image_size_px: tuple[int, int],
    *,
    margin_px: float = 20.0,
    driven: int = 0,
    target: str | None = None,
    options: LegOptions | None = None,
) -> Leg:
    """Give the straight leg that tells most about g for each metre.

    Candidates of all headings and of several lengths start where the robot is and end inside the margin. The Fisher
    information of each, with the robot's positions eliminated, is added to that of the calibration. Before there is
    one, a script of hexagons is driven: their headings determine g, and each ends where it began, wherever the camera
    is.

    Parameters
    ----------
    calibration : Calibration or OnlineCalibrator or None
        What is known; None, and an estimator without a calibration, for nothing.
    uv : (2,) array_like [px]
        Where the robot is.
    image_size_px : (int, int) [px]
        Width and height.
    margin_px : float [px]
        Distance to keep from the image's border.
    driven : int
        How many legs of the script have been driven.
    target : str, optional
        Which robot it is to an OnlineCalibrator, that knows how well it knows where the robot is; the first where not
        given.
    options : LegOptions, optional
        How the robot drives and is seen; the defaults where not given.

    Returns
    -------
    leg : Leg
        What to drive.

    Raises
    ------
    InputError
        If the margin leaves nothing of the image.
    UndeterminedError
        If no leg of the shortest length or more leads from there into the image.
    """
    options = options or LegOptions()
    at = readonly(uv, (2,), "uv")
    low = np.full(2, margin_px - 0.5)
    high = np.array(image_size_px, dtype=np.float64) - 0.5 - margin_px
    if not (high > low).all():
        raise InputError(f"a margin of {margin_px} px leaves nothing of {image_size_px}")
    known = calibration
    position = None
    if not (known is None or isinstance(known, Calibration)):
        position = known.position(target)
        known = known.calibration()
    if known is None:
        return _scripted(at, driven, options)
    return Planner(known, low, high, options).best(at, position)


def _scripted(at: FloatArray, driven: int, options: LegOptions) -> Leg:
    """Hexagons, every second one the other way round, each turned from the one before."""
    hexagon, side = divmod(driven, SCRIPT_SIDES)
    turn = SCRIPT_TURN if hexagon % 2 == 0 else -SCRIPT_TURN
    heading = hexagon * (math.pi + SCRIPT_SHIFT) + side * turn
    return Leg(
        heading_rad=math.remainder(heading, math.tau),
        length_m=options.scripted_m,
        start_px=(float(at[0]), float(at[1])),
        end_px=None,
        relative_sigma=math.inf,
        expected_sigma=math.inf,
    )
