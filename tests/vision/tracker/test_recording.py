"""Recordings of tracks: whose sightings they hold, and what they leave out."""

from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError
from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker, TrackRecorder, smooth
from vision.tracker.points import Detector, Scene, robots


def record(scene: Scene, **settings: float) -> TrackRecorder:
    tracker, recorder = Tracker(), TrackRecorder(**settings)  # type: ignore[arg-type]
    for sightings in scene.sightings:
        recorder.add(sightings, tracker.update(sightings))
    return recorder


def test_rows_are_raw_sightings_from_the_first_on() -> None:
    scene = robots(5, 4, 4.0, Detector(merge_px=0.0, dropouts_per_minute=0.0))
    tracks = record(scene).tracks()
    assert len(tracks.targets) == 4
    assert all(name.startswith("track-") for name in tracks.targets)
    pure = []
    for name in tracks.targets:
        rows = tracks.rows(name)
        assert tracks.t[rows][0] < 0.2  # before it was confirmed
        owners = []
        for t, uv in zip(tracks.t[rows], tracks.uv[rows], strict=True):
            k = int(np.argmin(abs(scene.t - t)))
            match = np.flatnonzero((scene.sightings[k].uv == uv).all(axis=1))
            owners.append(scene.owner[k][match[0]])
        pure.append(np.mean(np.array(owners) == np.bincount(np.array(owners) + 2).argmax() - 2))
    assert np.mean(pure) > 0.98
    assert tracks.sigma is not None
    np.testing.assert_allclose(tracks.sigma, 0.5)


def test_sightings_seen_as_one_are_left_out() -> None:
    scene = robots(0, 20, 5.0, Detector(clutter=0.0, dropouts_per_minute=0.0))
    tracks = record(scene).tracks()
    both = 0
    for k, sightings in enumerate(scene.sightings):
        several = sightings.uv[scene.owner[k] == -2]
        now = tracks.uv[tracks.t == scene.t[k]]
        both += sum(bool((now == uv).all(axis=1).any()) for uv in several)
    assert both < 0.2 * sum((o == -2).sum() for o in scene.owner)


def test_short_and_still_tracks_are_left_out() -> None:
    tracker, long, moving = Tracker(), TrackRecorder(), TrackRecorder(least_travel_px=5.0)
    for k in range(60):
        uv = [[100 + k, 50.0], [300.0, 200.0], *([[500.0, 400.0]] if k < 10 else [])]
        sightings = Sightings.round(k / 30, uv, 0.2, labels=("a", "b", "c")[: len(uv)])
        state = tracker.update(sightings)
        long.add(sightings, state)
        moving.add(sightings, state)
    assert set(long.tracks().targets) == {"a", "b"}
    assert moving.tracks().targets == ("a",)
    smoothed = moving.smoothed()["a"]
    np.testing.assert_allclose(smoothed.uv_dot[30], [30, 0], atol=1)
    np.testing.assert_allclose(smoothed.uv[30], [130, 50], atol=0.3)


def test_nothing_to_record_is_an_error() -> None:
    recorder, tracker = TrackRecorder(), Tracker()
    sightings = Sightings.none(0.0)
    state = tracker.update(sightings)
    recorder.add(sightings, state)
    with pytest.raises(InputError, match="1 frames"):
        recorder.tracks()
    with pytest.raises(InputError, match="in order"):
        recorder.add(sightings, state)


@pytest.mark.parametrize("t", [[], [1.0, 1.0], [2.0, 1.0], [np.nan, 1.0]])
def test_smoothing_refuses_times_that_do_not_ascend(t: list[float]) -> None:
    with pytest.raises(InputError, match="t "):
        smooth(t, np.zeros((len(t), 2)), np.tile(np.eye(2), (len(t), 1, 1)))


def test_one_sighting_is_smoothed_to_itself() -> None:
    answer = smooth([1.0], [[3.0, 4.0]], [np.eye(2)])
    np.testing.assert_array_equal(answer.uv, [[3.0, 4.0]])
