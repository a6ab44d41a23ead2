"""Motions of an image point in time, tracked by flatness (paper, section 4.1)."""

from airground.control.trajectories.flat_tracker import FlatTracker
from airground.control.trajectories.flatness import FlatInputs, flat_inputs, flat_outputs
from airground.control.trajectories.spline import SplineTrajectory, times_at_speed
from airground.control.trajectories.trajectory import (
    FunctionTrajectory,
    GroundEllipse,
    GroundTrajectory,
    ImageEllipse,
)

__all__ = [
    "FlatInputs",
    "FlatTracker",
    "FunctionTrajectory",
    "GroundEllipse",
    "GroundTrajectory",
    "ImageEllipse",
    "SplineTrajectory",
    "flat_inputs",
    "flat_outputs",
    "times_at_speed",
]
