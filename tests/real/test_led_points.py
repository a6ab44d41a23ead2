"""From every LED of every frame, unlabelled, to a calibration, on real cars; skipped where there are no recordings."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from airground.calibration import Motion, Tracks, calibrate, identify
from airground.geometry import align_rotation, n_error
from airground.geometry.arrays import FloatArray
from airground.records import read_motion, read_tracks
from airground.vision.detectors.constellation import Constellation, constellation_sightings
from airground.vision.tracker import Tracker

SIZE = (2048, 2048)
DESCRIBED = Constellation(np.array([[0.0, 0.01585], [0.0, -0.01585], [0.16, 0.0]]))
"""As the recordings' notes describe the car: two rear LEDs, and one ahead [m]; between the rear ones is its origin."""

RUNS = ["single_vehicle_manual_driving", "vehicle_3_a"]


def read_points(path: Path) -> tuple[FloatArray, list[FloatArray]]:
    """Times from the first frame [s], and the points of each frame."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    stamp = np.array([int(row["stamp_ns"]) for row in rows])
    uv = np.array([[float(row["u_px"]), float(row["v_px"])] for row in rows])
    stamps, first = np.unique(stamp, return_index=True)
    return (stamps - stamps[0]) * 1e-9, np.split(uv, first[1:])


def tracked(t: FloatArray, frames: list[FloatArray], pattern: Constellation | None) -> Tracks:
    """Fragments under the tracker's own names."""
    tracker, rows = Tracker(), []
    for sightings in constellation_sightings(t, frames, pattern):
        state = tracker.update(sightings)
        rows += [
            (sightings.t, f"track-{track.serial}", *sightings.uv[track.sighting])
            for track in state.tracks
            if track.sighting is not None
        ]
    times, names, u, v = zip(*rows, strict=True)
    return Tracks.from_rows(times, names, np.column_stack([u, v]))


def n_of(tracks: Tracks, motion: Motion, truth: FloatArray) -> float:
    aligned, _ = align_rotation(truth, calibrate(tracks, motion, image_size_px=SIZE).model)
    return float(n_error(truth, aligned))


def test_from_unlabelled_leds_to_a_calibration(recordings: Path) -> None:
    folder = recordings / "cpm_lab" / RUNS[0]  # benchmarks/identify.py does both, and all frames
    truth = np.array(json.loads((folder / "truth.json").read_text())["g"])
    motion = read_motion(folder / "motion.csv")
    t, frames = read_points(folder / "led_points.csv")
    t, frames = t[::2], frames[::2]
    found = identify(tracked(t, frames, DESCRIBED), motion)
    mine = found.of("vehicle3")
    assert mine.confidence > 0.99
    # All but the first two seconds, at rest: at half the frames the tracker lets go of the car when it starts.
    assert sum(s.sightings for s in mine.spans) > 0.93 * len(frames)
    # The labelled tracks.csv gives 0.0023; benchmarks/identify.py prints it.
    assert n_of(found.tracks, motion, truth) < 0.0023 + 0.002


def test_a_learned_pattern_finds_the_car_in_every_frame(recordings: Path) -> None:
    folder = recordings / "cpm_lab" / RUNS[0]
    t, frames = read_points(folder / "led_points.csv")
    t, frames = t[100:500], frames[100:500]
    pattern = Constellation.learned(frames)
    assert pattern.always.tolist().count(True) == 3
    assert len(pattern.points) == 4  # with the one that blinks
    found = constellation_sightings(t, frames, pattern)
    assert all(len(s) == 1 for s in found)
    # What was given is between the rear LEDs: a fixed point of the same pattern, a third of it away.
    given = read_tracks(folder / "tracks.csv").uv[100:500]
    off = np.array([s.uv[0] for s in found]) - given
    ahead = np.array([[np.cos(s.angle[0]), np.sin(s.angle[0])] for s in found])
    along = np.sum(off * ahead, axis=1)
    assert np.ptp(along) < 5
    assert np.abs(np.linalg.det(np.stack([off, ahead], axis=1))).max() < 2


@pytest.mark.parametrize("name", RUNS)
def test_the_car_among_others_that_move_as_really(recordings: Path, name: str) -> None:
    folders = [recordings / "cpm_lab" / run for run in (name, *(r for r in RUNS if r != name))]
    mine, other = (read_tracks(folder / "tracks.csv") for folder in folders)
    motion = read_motion(folders[0] / "motion.csv")
    t, uv = mine.t[::4], mine.uv[::4]
    decoys = {
        "other": (other.t[::4], other.uv[::4]),
        "later": (other.t[::4] - 7.0, other.uv[::4]),
        "mirrored": (t, [2047, 0] + uv * [-1, 1]),
        "upside down": (t, [0, 2047] + uv * [1, -1]),
        "reversed": (t, uv[::-1]),
        "late by 8 s": (t + 8.0, uv),
        "parked": (t, uv[:1] + np.random.default_rng(0).normal(0, 0.1, uv.shape)),
    }
    absent = identify(joined(decoys), motion).of("vehicle3")
    assert not absent.identified
    present = identify(joined({"car": (t, uv), **decoys}), motion).of("vehicle3")
    assert {s.track for s in present.spans} == {"car"}
    assert present.confidence > 0.95


def joined(tracks: dict[str, tuple[FloatArray, FloatArray]]) -> Tracks:
    t = np.concatenate([t for t, _ in tracks.values()])
    names = [name for name, (times, _) in tracks.items() for _ in times]
    return Tracks.from_rows(t, names, np.concatenate([uv for _, uv in tracks.values()]))
