"""Stretches of sightings that do not move as the readings say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.calibration.trajectory.agreement import following
from airground.calibration.trajectory.start import find_start
from airground.sim.recordings import RecordingNoise, RecordingPlan, record

USUAL = RecordingNoise(tracks_hz=20.0, motion_hz=20.0, pixel_px=1.0, speed_share=0.05)


def told(noise: RecordingNoise, drive: str, robots: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Which sightings follow, and the time of each."""
    found = record(RecordingPlan(drive=drive, robots=robots, tilt_deg=50.0), noise, seed=3)
    start = find_start(found.tracks, found.motion, None)
    every = np.ones(len(found.tracks), dtype=bool)
    return following(found.tracks, found.motion, start, every), found.tracks.t


@pytest.mark.parametrize("drive", ["figure_eight", "rectangle", "lawn_mower", "circle"])
def test_nothing_is_lost_of_a_good_recording(drive: str) -> None:
    """Corners, stops and turns on the spot are no disagreement, and neither is wheel slip of a twentieth."""
    kept, _ = told(replace(USUAL, heading_rad=0.03, slip=0.05), drive)
    assert kept.all()


@pytest.mark.parametrize("drive", ["figure_eight", "rectangle", "random_turns"])
def test_swapped_names(drive: str) -> None:
    kept, t = told(replace(USUAL, swapped_s=(10.0, 22.0)), drive, robots=2)
    swapped = (t >= 10) & (t < 22)
    # Where both happen to drive alike, the wrong name does not show, and does no harm.
    assert kept[swapped].mean() < 0.5
    assert kept[~swapped].mean() > 0.97  # ways cross the ends


def test_an_odometer_that_stands() -> None:
    kept, t = told(replace(USUAL, stuck_s=(12.0, 16.0)), "circle")
    stuck = (t >= 12) & (t < 16)
    assert kept[stuck].mean() < 0.2
    assert kept[~stuck].mean() > 0.97
