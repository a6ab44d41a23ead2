"""Image-plane controllers, paths, limits and safety: pure functions of state; no clock, no file, no socket."""

from airground.control.command import STOP, VelocityCommand
from airground.control.controller import Controller, Guidance, ImageTrajectory
from airground.control.floor import Floor
from airground.control.limits import Limits
from airground.control.state import RobotState

__all__ = [
    "STOP",
    "Controller",
    "Floor",
    "Guidance",
    "ImageTrajectory",
    "Limits",
    "RobotState",
    "VelocityCommand",
]
