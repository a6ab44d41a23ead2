"""The camera: MuJoCo draws what a pinhole sees; lens and sensor are laid over it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from airground.sim3d.backend import make_renderer
from airground.sim3d.scene import POINT_GROUP
from airground.vision.raster.noise import SensorNoise
from airground.vision.raster.pixel_map import PixelMap

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.sim3d.camera_pose import CameraPose
    from airground.sim3d.canvas import Canvas
    from airground.sim3d.options import CameraOptions3d
    from airground.vision.frame import ImageArray

__all__ = ["Eye3d"]


class Eye3d:
    """Draws states of the world. To be used by one thread.

    Parameters
    ----------
    mujoco : module
        MuJoCo.
    model : MjModel
        The world, painted.
    options : CameraOptions3d
        The camera.
    canvas : Canvas
        What the pinhole draws.
    seed : int
        Of the sensor's noise.

    Raises
    ------
    UnreachableError
        If nothing can be drawn here.
    """

    def __init__(
        self, mujoco: Any, model: Any, options: CameraOptions3d, canvas: Canvas, seed: int
    ) -> None:
        self._mujoco = mujoco
        self._model = model
        self._data = mujoco.MjData(model)
        self._renderer = make_renderer(model, canvas.size_px)
        self._map = PixelMap(canvas.places())
        size = options.image_size_px
        self._noise = SensorNoise(size, options.noise_dark, options.noise_bright, seed)
        self._world, self._alone = mujoco.MjvOption(), mujoco.MjvOption()
        for k in range(len(self._world.geomgroup)):
            self._world.geomgroup[k] = k != POINT_GROUP
            self._alone.geomgroup[k] = k == POINT_GROUP

    def image(self, qpos: FloatArray, pose: CameraPose, index: int) -> ImageArray:
        """Take a picture.

        Parameters
        ----------
        qpos : (Q,) array
            Where all is.
        pose : CameraPose
            Where the camera is.
        index : int
            Number of the picture: the same number, the same noise.

        Returns
        -------
        image : (H, W, 3) array
            Blue, green, red.
        """
        self._data.qpos[:] = qpos
        image = self._drawn(pose, self._world)
        self._noise.apply(image, index)
        return image

    def point(self, xyz: FloatArray, pose: CameraPose) -> ImageArray:
        """Take a picture of a bright point alone, without noise.

        Parameters
        ----------
        xyz : (3,) array [m]
            Where it is.
        pose : CameraPose
            Where the camera is.

        Returns
        -------
        image : (H, W, 3) array
            Blue, green, red; black where it is not.
        """
        self._place("point", xyz, np.array([1.0, 0.0, 0.0, 0.0]))
        return self._drawn(pose, self._alone)

    def close(self) -> None:
        """Let go of the renderer; calling it again does nothing."""
        self._renderer.close()

    def _drawn(self, pose: CameraPose, shown: Any) -> ImageArray:
        self._place("camera", pose.position, pose.quaternion)
        self._mujoco.mj_kinematics(self._model, self._data)
        self._mujoco.mj_comPos(self._model, self._data)
        self._mujoco.mj_camlight(self._model, self._data)
        self._renderer.update_scene(self._data, "camera", shown)
        image = self._map.apply(self._renderer.render())
        return np.ascontiguousarray(image[..., ::-1])

    def _place(self, body: str, xyz: FloatArray, quaternion: FloatArray) -> None:
        k = int(self._model.body(body).mocapid[0])
        self._data.mocap_pos[k] = xyz
        self._data.mocap_quat[k] = quaternion
