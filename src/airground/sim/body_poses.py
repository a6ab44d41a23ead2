"""Where bodies are at any time: what drives a path, a route or straight on, and what is parked."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.sim.calibration_drive import Path
    from airground.sim.route_drive import RouteDrive
    from airground.sim.world import Transit

__all__ = ["PoseOfTime", "along_path", "along_route", "crossing", "parked"]

PoseOfTime = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""From times (N,) [s] to ground positions (N, 2) [m] and headings (N,) [rad]."""


def parked(x_m: float, y_m: float, theta_rad: float = 0.0) -> PoseOfTime:
    """Stand still.

    Parameters
    ----------
    x_m, y_m : float [m]
        Where.
    theta_rad : float [rad]
        Heading.

    Returns
    -------
    pose : callable
        Always the same.
    """

    def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        count = len(t)
        return np.tile([x_m, y_m], (count, 1)), np.full(count, theta_rad)

    return pose


def along_path(path: Path, start_s: float = 0.0) -> PoseOfTime:
    """Follow a recorded path.

    Parameters
    ----------
    path : Path
        Of the robot.
    start_s : float [s]
        When it begins.

    Returns
    -------
    pose : callable
        At rest before the path begins and after it ends.
    """

    def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        xy, theta, _ = path.at(t - start_s)
        return xy, theta

    return pose


def along_route(drive: RouteDrive, start_s: float = 0.0) -> PoseOfTime:
    """Drive a route.

    Parameters
    ----------
    drive : RouteDrive
        The drive.
    start_s : float [s]
        When it begins.

    Returns
    -------
    pose : callable
        At rest before and after.
    """

    def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        place = drive.at(t - start_s)
        return place.xy, place.theta

    return pose


def crossing(transit: Transit, *, stands: bool = False) -> PoseOfTime:
    """Drive straight on.

    Parameters
    ----------
    transit : Transit
        From where, when, and how fast.
    stands : bool
        Does it wait at its start until it sets off? Otherwise it was under way before.

    Returns
    -------
    pose : callable
        On one line.
    """
    along = np.array([np.cos(transit.heading_rad), np.sin(transit.heading_rad)])

    def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        since = t - transit.start_s
        way = transit.speed_mps * (np.maximum(since, 0.0) if stands else since)
        return transit.start_m + way[:, None] * along, np.full(len(t), transit.heading_rad)

    return pose
