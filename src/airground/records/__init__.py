"""Files: recordings and calibrations; read strictly, written whole or not at all."""

from airground.records.atomic import replacing, write_bytes, write_text
from airground.records.folders import make_folder
from airground.records.path_files import DrawnPath, read_path, write_path
from airground.records.recordings_files import read_motion, read_tracks
from airground.records.recordings_writers import (
    write_motion,
    write_smoothed,
    write_speeds,
    write_tracks,
)

__all__ = [
    "DrawnPath",
    "make_folder",
    "read_motion",
    "read_path",
    "read_tracks",
    "replacing",
    "write_bytes",
    "write_motion",
    "write_path",
    "write_smoothed",
    "write_speeds",
    "write_text",
    "write_tracks",
]
