"""A drone's camera over the MuJoCo world: in wind, and from some time on adrift."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.sim.flights import hover
from airground.sim.scene_camera import Pinhole
from airground.sim3d.camera_pose import CameraPose
from airground.sim3d.canvas import Canvas

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.sim3d.options import CameraOptions3d

__all__ = ["Drone"]

DRIFT_MPS = np.array([0.025, 0.012, 0.0])
BEGIN_S = 4.0  # over which the drift begins


class Drone:
    """Where the camera is: in wind, and from some time on adrift.

    Parameters
    ----------
    options : CameraOptions3d
        Of the camera.
    seed : int
        Of the wind.
    """

    def __init__(self, options: CameraOptions3d, seed: int) -> None:
        pose = CameraPose.looking_at(options.position_m, options.target_m)
        focal = Canvas.of(options).focal_length_px
        base = Pinhole(focal, pose.world_from_camera.T, pose.position, options.image_size_px)
        self.focal_length_px = focal
        """Of the camera [px]."""
        self.adrift_from: float | None = None
        """Since when it drifts [s]."""
        self._hover = hover(base, seed=seed)

    def __call__(self, t: float) -> CameraPose:
        """Tell the pose.

        Parameters
        ----------
        t : float [s]
            When.

        Returns
        -------
        pose : CameraPose
            Then.
        """
        camera = self._hover(t)
        return CameraPose(camera.centre_m + self._drifted(t), camera.camera_from_world.T)

    def _drifted(self, t: float) -> FloatArray:
        if self.adrift_from is None or t <= self.adrift_from:
            return np.zeros(3)
        since = t - self.adrift_from
        way = since**2 / (2 * BEGIN_S) if since < BEGIN_S else since - BEGIN_S / 2
        return DRIFT_MPS * way
