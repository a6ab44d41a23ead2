"""Sketches: a hand-drawn line becomes a smooth path with speeds in m/s, is checked, and followed."""

from airground.control.paths.image_path import ImagePath, PathPoint
from airground.control.paths.path_follower import PathFollower
from airground.control.paths.sketch import smooth_sketch
from airground.control.paths.sketch_check import check_path
from airground.control.paths.sketch_path import path_through
from airground.control.paths.sketch_undrivable import Undrivable
from airground.control.paths.speed_profile import speed_profile

__all__ = [
    "ImagePath",
    "PathFollower",
    "PathPoint",
    "Undrivable",
    "check_path",
    "path_through",
    "smooth_sketch",
    "speed_profile",
]
