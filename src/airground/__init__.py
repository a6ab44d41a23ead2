"""airground: a camera that looks down on something that drives becomes a metric sensor and a joystick.

>>> import airground as ag
>>> tracks, motion = ag.read_tracks("tracks.csv"), ag.read_motion("motion.csv")  # doctest: +SKIP
>>> calibration = ag.calibrate(tracks, motion)  # doctest: +SKIP
>>> xy_dot, covariance = calibration.ground_velocity([640, 360], [12.0, -3.0])  # doctest: +SKIP
"""

from airground._version import __version__
from airground.calibration import (
    Calibration,
    Identification,
    Leg,
    LegOptions,
    Motion,
    MotionSamples,
    OnlineCalibrator,
    OnlineOptions,
    Speeds,
    Tracks,
    calibrate,
    estimate_linear,
    estimate_robust,
    identify,
    measure_speeds,
    next_leg,
)
from airground.errors import (
    AirgroundError,
    FileError,
    InputError,
    NoWayError,
    SampleError,
    UndeterminedCameraError,
    UndeterminedError,
    UnobservableMotionError,
    UnreachableError,
)
from airground.geometry import (
    Collineation,
    DivisionLens,
    LimitedHomography,
    PlaneCamera,
    align_rotation,
    n_error,
    velocity_map_error,
)
from airground.records import read_motion, read_tracks, write_motion, write_speeds, write_tracks

__all__ = [
    "AirgroundError",
    "Calibration",
    "Collineation",
    "DivisionLens",
    "FileError",
    "Identification",
    "InputError",
    "Leg",
    "LegOptions",
    "LimitedHomography",
    "Motion",
    "MotionSamples",
    "NoWayError",
    "OnlineCalibrator",
    "OnlineOptions",
    "PlaneCamera",
    "SampleError",
    "Speeds",
    "Tracks",
    "UndeterminedCameraError",
    "UndeterminedError",
    "UnobservableMotionError",
    "UnreachableError",
    "__version__",
    "align_rotation",
    "calibrate",
    "estimate_linear",
    "estimate_robust",
    "identify",
    "measure_speeds",
    "n_error",
    "next_leg",
    "read_motion",
    "read_tracks",
    "velocity_map_error",
    "write_motion",
    "write_speeds",
    "write_tracks",
]
