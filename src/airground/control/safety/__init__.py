"""The layer between any controller and any robot: within the limits, or a stop with its reason."""

from airground.control.safety.bounds import SafetyBounds
from airground.control.safety.calibration_sigma import CalibrationSigma
from airground.control.safety.layer import SafetyLayer
from airground.control.safety.types import (
    FenceTest,
    SafetyMemory,
    Sent,
    Situation,
    Stop,
    StopReason,
)

__all__ = [
    "CalibrationSigma",
    "FenceTest",
    "SafetyBounds",
    "SafetyLayer",
    "SafetyMemory",
    "Sent",
    "Situation",
    "Stop",
    "StopReason",
]
