"""Tracks and motion in, a calibration out. No files, no clocks."""

from airground.calibration.calibrate import SPEED_SCALE_SIGMA, calibrate
from airground.calibration.calibration import Calibration, Fit, Provenance, TargetFit
from airground.calibration.guidance import next_leg
from airground.calibration.guidance_types import Leg, LegOptions
from airground.calibration.identify import Identification, RobotIdentity, TrackSpan, identify
from airground.calibration.linear import estimate_linear
from airground.calibration.observability import Observability
from airground.calibration.online import OnlineCalibrator
from airground.calibration.online_state import OnlineEvent, OnlineOptions, OnlineState
from airground.calibration.recordings import Motion, Tracks
from airground.calibration.robust import RobustFit, estimate_robust, robust_fit
from airground.calibration.samples import MotionSamples
from airground.calibration.speeds import Speeds, measure_speeds

__all__ = [
    "SPEED_SCALE_SIGMA",
    "Calibration",
    "Fit",
    "Identification",
    "Leg",
    "LegOptions",
    "Motion",
    "MotionSamples",
    "Observability",
    "OnlineCalibrator",
    "OnlineEvent",
    "OnlineOptions",
    "OnlineState",
    "Provenance",
    "RobotIdentity",
    "RobustFit",
    "Speeds",
    "TargetFit",
    "TrackSpan",
    "Tracks",
    "calibrate",
    "estimate_linear",
    "estimate_robust",
    "identify",
    "measure_speeds",
    "next_leg",
    "robust_fit",
]
