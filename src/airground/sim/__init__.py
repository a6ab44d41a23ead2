"""The simulated world: plays the camera, the robot and their noise; seeded, and apart from what is estimated."""

from airground.sim.calibration_drive import (
    CalibrationDrive,
    DriveNoise,
    Path,
    calibration_drive,
    drive_eight,
)
from airground.sim.camera import SimCamera
from airground.sim.unicycle import SegmentDrive, arc, roll_out
from airground.sim.world import FigureEight, Transit, World, demo_world

__all__ = [
    "CalibrationDrive",
    "DriveNoise",
    "FigureEight",
    "Path",
    "SegmentDrive",
    "SimCamera",
    "Transit",
    "World",
    "arc",
    "calibration_drive",
    "demo_world",
    "drive_eight",
    "roll_out",
]
