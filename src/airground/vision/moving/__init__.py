"""A camera that moves: the ground held still by fixed points (section 4.3)."""

from airground.vision.moving.fit_types import HomographyFit, NoiseScale
from airground.vision.moving.fixed_points import PointStabilizer
from airground.vision.moving.homography import fit_homography
from airground.vision.moving.levelling import Level, find_level
from airground.vision.moving.marks_plane import (
    MarksPlane,
    MarksView,
    apply_each,
    calibrate_marks,
)
from airground.vision.moving.point_options import PointOptions
from airground.vision.moving.raised import RaisedStabilizer, raised
from airground.vision.moving.small_motion import apply_homography, homography_jacobian
from airground.vision.moving.stabilization import (
    Stabilization,
    StabilizationStatus,
    rate_between,
)
from airground.vision.moving.stabilizer import Stabilizer, StabilizerOptions

__all__ = [
    "HomographyFit",
    "Level",
    "MarksPlane",
    "MarksView",
    "NoiseScale",
    "PointOptions",
    "PointStabilizer",
    "RaisedStabilizer",
    "Stabilization",
    "StabilizationStatus",
    "Stabilizer",
    "StabilizerOptions",
    "apply_each",
    "apply_homography",
    "calibrate_marks",
    "find_level",
    "fit_homography",
    "homography_jacobian",
    "raised",
    "rate_between",
]
