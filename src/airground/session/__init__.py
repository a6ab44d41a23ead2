"""The live system: one loop from camera to robots, on one clock, that can be recorded and replayed."""

from airground.session.inputs import CameraNews, Finished, Heard, Ordered, Seen
from airground.session.options import RobotOptions, SessionOptions
from airground.session.session import Session
from airground.session.tick import SessionTick

__all__ = [
    "CameraNews",
    "Finished",
    "Heard",
    "Ordered",
    "RobotOptions",
    "Seen",
    "Session",
    "SessionOptions",
    "SessionTick",
]
