"""Clicked goals: to a pixel, through several, with a heading at the end (paper, section 4.2)."""

from airground.control.goals.point_to_point import PointToPoint
from airground.control.goals.point_to_point_omni import PointOmni

__all__ = [
    "PointOmni",
    "PointToPoint",
]
