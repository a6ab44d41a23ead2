"""Tracks and motion in, a calibration out. No files, no clocks."""

from airground.calibration.calibrate import SPEED_SCALE_SIGMA, calibrate
from airground.calibration.calibration import Calibration, Fit, Provenance, TargetFit
from airground.calibration.linear import estimate_linear
from airground.calibration.observability import Observability
from airground.calibration.recordings import Motion, Tracks
from airground.calibration.samples import MotionSamples
from airground.calibration.speeds import Speeds, measure_speeds

__all__ = [
    "SPEED_SCALE_SIGMA",
    "Calibration",
    "Fit",
    "Motion",
    "MotionSamples",
    "Observability",
    "Provenance",
    "Speeds",
    "TargetFit",
    "Tracks",
    "calibrate",
    "estimate_linear",
    "measure_speeds",
]
