"""g and all that follows from it: velocities, horizon, homographies, camera. Pure functions of arrays."""

from airground.geometry.arrays import FloatArray
from airground.geometry.camera import PlaneCamera
from airground.geometry.homography import Collineation, unit_determinant
from airground.geometry.lens import DivisionLens
from airground.geometry.limited import LimitedHomography
from airground.geometry.metrics import align_rotation, n_error, velocity_map_error

__all__ = [
    "Collineation",
    "DivisionLens",
    "FloatArray",
    "LimitedHomography",
    "PlaneCamera",
    "align_rotation",
    "n_error",
    "unit_determinant",
    "velocity_map_error",
]
