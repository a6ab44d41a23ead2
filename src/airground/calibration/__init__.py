"""Tracks and motion in, a calibration out. No files, no clocks."""

from airground.calibration.linear import estimate_linear
from airground.calibration.recordings import Motion, Tracks
from airground.calibration.samples import MotionSamples

__all__ = ["Motion", "MotionSamples", "Tracks", "estimate_linear"]
