"""Where a vehicle of the embedded world really is; for tests, never for what drives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.sim.body_poses import PoseOfTime
    from airground.sim.camera import SimCamera

__all__ = ["RobotTruth", "robot_truth"]

STEP_S = 1e-3  # over which speeds are taken: less than a vehicle's own


@dataclass(frozen=True, slots=True, eq=False)
class RobotTruth:
    """A vehicle at one time."""

    t: float
    """When [s]."""

    xy: FloatArray
    """(2,) [m]. Of its axle."""

    theta: float
    """Heading [rad], counter-clockwise from x; does not wrap."""

    uv: FloatArray
    """(2,) [px]. Its mark in the image."""

    v: float
    """Speed along the heading [m/s], over the ground."""

    omega: float
    """Rate of the heading [rad/s]."""


def robot_truth(pose: PoseOfTime, t: float, camera: SimCamera) -> RobotTruth:
    """Tell the truth about a vehicle.

    Parameters
    ----------
    pose : callable
        Of the vehicle.
    t : float [s]
        When.
    camera : SimCamera
        Over the plane of the marks.

    Returns
    -------
    truth : RobotTruth
        Then; speeds are those of the millisecond before.
    """
    xy, theta = pose(np.array([t - STEP_S, t]))
    along = np.array([np.cos(theta[1]), np.sin(theta[1])])
    return RobotTruth(
        t=t,
        xy=xy[1],
        theta=float(theta[1]),
        uv=camera.project(xy[1]),
        v=float((xy[1] - xy[0]) @ along) / STEP_S,
        omega=float(theta[1] - theta[0]) / STEP_S,
    )
