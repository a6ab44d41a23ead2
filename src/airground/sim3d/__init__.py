"""A world that is not of our own making: MuJoCo moves the robots and draws what the camera sees. Needs the extra sim3d.

Nothing here is imported from MuJoCo until a world is built.
"""

from airground.sim3d.camera_pose import CameraPose
from airground.sim3d.options import (
    CameraOptions3d,
    Other3d,
    Robot3d,
    RobotOptions3d,
    World3dOptions,
)
from airground.sim3d.survey import survey
from airground.sim3d.truth import Truth3d
from airground.sim3d.world import World3d

__all__ = [
    "CameraOptions3d",
    "CameraPose",
    "Other3d",
    "Robot3d",
    "RobotOptions3d",
    "Truth3d",
    "World3d",
    "World3dOptions",
    "survey",
]
