"""Robots kept apart, inside fences, clear of obstacles and others; ways round obstacles."""

from airground.control.separation.courtesy import Courtesy
from airground.control.separation.fence import Boundary, Fence
from airground.control.separation.filter import SeparationFilter
from airground.control.separation.planner import WayPlanner, plan_way
from airground.control.separation.types import Body, Passerby, Separated, Separation

__all__ = [
    "Body",
    "Boundary",
    "Courtesy",
    "Fence",
    "Passerby",
    "Separated",
    "Separation",
    "SeparationFilter",
    "WayPlanner",
    "plan_way",
]
