"""Straight legs by compass and odometer, while the camera is not calibrated."""

from airground.control.legs.advice import advise
from airground.control.legs.driver import LegDriver
from airground.control.legs.local_map import LocalMap
from airground.control.legs.script import ScriptOptions, scripted_leg
from airground.control.legs.types import (
    DriveLeg,
    DrivenLeg,
    LegDriveOptions,
    LegInput,
    LegTick,
)

__all__ = [
    "DriveLeg",
    "DrivenLeg",
    "LegDriveOptions",
    "LegDriver",
    "LegInput",
    "LegTick",
    "LocalMap",
    "ScriptOptions",
    "advise",
    "scripted_leg",
]
