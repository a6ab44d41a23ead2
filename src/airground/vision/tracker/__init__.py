"""Sightings to tracks: who is who, where, and how fast."""

from airground.vision.tracker.options import TrackerOptions
from airground.vision.tracker.recording import TrackRecorder
from airground.vision.tracker.smoother import Smoothed, smooth
from airground.vision.tracker.state import Revision, Track, TrackerState
from airground.vision.tracker.tracker import Tracker

__all__ = [
    "Revision",
    "Smoothed",
    "Track",
    "TrackRecorder",
    "Tracker",
    "TrackerOptions",
    "TrackerState",
    "smooth",
]
