"""Small worlds in MuJoCo, and driving in them."""

from __future__ import annotations

from typing import Any

import numpy as np

from airground.control.command import VelocityCommand
from airground.robots.protocol import RobotReading
from airground.sim3d.options import CameraOptions3d, Robot3d, RobotOptions3d, World3dOptions
from airground.sim3d.world import World3d

STEP_S = 0.05


def small_camera(**changed: Any) -> CameraOptions3d:
    """Draws fast."""
    return CameraOptions3d(**{"image_size_px": (640, 360), "samples": 0, **changed})


def alone(camera: CameraOptions3d | None = None, **built: Any) -> World3dOptions:
    """A single robot with perfect wheels, if nothing else is said."""
    robot = Robot3d(start_m=(-0.2, -0.6), options=RobotOptions3d(**{"wheel_share": 0.0, **built}))
    return World3dOptions(robots=(robot,), others=(), camera=camera or small_camera())


def drive(world: World3d, v: float, omega: float, seconds: float) -> list[RobotReading]:
    """Tell the red robot the same for a while; what it told meanwhile comes out."""
    for _ in range(round(seconds / STEP_S)):
        world.command("red", world.now, VelocityCommand(v, omega))
        world.advance(world.now + STEP_S)
    return world.readings("red", world.now)


def mean(readings: list[RobotReading], what: str) -> float:
    """Of a reading's column."""
    return float(np.mean([getattr(k, what) for k in readings]))
