"""airground: a camera that looks down on something that drives becomes a metric sensor and a joystick."""

from airground._version import __version__
from airground.calibration import Motion, MotionSamples, Tracks, estimate_linear
from airground.geometry import LimitedHomography

__all__ = ["LimitedHomography", "Motion", "MotionSamples", "Tracks", "estimate_linear"]
