"""The step from a frame to tracks: stages put together, and what a moving camera changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from airground.errors import UndeterminedError
from airground.sim import WorldCamera
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes, Look
from airground.vision.frame import Frame
from airground.vision.moving import Stabilizer
from airground.vision.sightings import Sightings
from airground.vision.still_view import StillView
from airground.vision.tracker import Tracker, TrackRecorder
from airground.vision.video_tracks import track_video
from footage import circling, true_uv

if TYPE_CHECKING:
    from collections.abc import Iterator

GREY = np.full((90, 160), 120, dtype=np.uint8)


class Steady:
    """Sees one thing that moves to the right, but not in the frames numbered in `blind`."""

    def __init__(self, blind: tuple[int, ...] = ()) -> None:
        self.blind = blind

    def detect(self, frame: Frame) -> Sightings:
        if frame.index in self.blind:
            return Sightings.none(frame.t)
        return Sightings.round(frame.t, [[10 + frame.index, 40]], 0.5)


def frames(count: int, *, segment_from: int | None = None) -> Iterator[Frame]:
    for k in range(count):
        back = segment_from is not None and k >= segment_from
        yield Frame(GREY, k / 20 - (100 if back else 0), index=k, segment=int(back))


def test_a_still_cameras_sightings_go_to_the_tracker_as_they_are() -> None:
    eyes = Eyes(Steady(), Tracker())
    for frame in frames(20):
        look = eyes.look(frame)
        assert look.sightings is look.seen
        assert look.image_from_stable is None
        assert not look.lost
    (track,) = look.state.tracks
    assert track.confirmed
    np.testing.assert_allclose(track.uv, [29, 40], atol=1)


def test_a_camera_that_came_back_begins_anew() -> None:
    """Its clock may have begun anew too; names are not used twice."""
    eyes = Eyes(Steady(), Tracker())
    names = [
        {track.name for track in eyes.look(frame).state.tracks if track.confirmed}
        for frame in frames(40, segment_from=20)
    ]
    assert names[19] == {"track-1"}
    assert names[20] == set()
    assert names[39] == {"track-2"}


def test_frames_without_a_place_give_no_sightings() -> None:
    """A camera that looks at nothing but grey is lost, whatever the detector says it sees."""
    eyes = Eyes(Steady(), Tracker(), Stabilizer())
    for frame in frames(3):
        look = eyes.look(frame)
        assert look.lost
        assert len(look.seen) == 1
        assert len(look.sightings) == 0
        assert look.stabilization is not None
        assert look.stabilization.stable_from_image is None
        assert look.image_from_stable is None
    with pytest.raises(UndeterminedError, match="nothing was seen"):
        track_video(frames(30), Eyes(Steady(), Tracker(), Stabilizer()), TrackRecorder())


def test_sightings_of_a_moving_camera_are_those_of_its_first_view() -> None:
    scene = circling(moving_camera=True)
    eyes = Eyes(make_detector("tag:family=36h11"), Tracker(), Stabilizer())
    off, shaken = [], []
    for frame in WorldCamera(scene, rate_hz=20, duration_s=1.5):
        look = eyes.look(frame)
        truth = true_uv(scene, np.array([frame.t]))[0]
        assert look.stabilization is not None
        assert look.stabilization.ok
        if len(look.sightings):
            off.append(look.sightings.uv[0] - truth)
            shaken.append(look.seen.uv[0] - truth)
            back = look.image_from_stable
            assert back is not None
            w = back @ [*look.sightings.uv[0], 1.0]
            np.testing.assert_allclose(w[:2] / w[2], look.seen.uv[0], atol=1e-6)
    assert len(off) > 25
    assert np.sqrt(np.mean(np.square(off))) < 0.25 * np.sqrt(np.mean(np.square(shaken)))


def test_moving_things_are_found_in_the_stable_view() -> None:
    scene = circling(tag=False, moving_camera=True)
    eyes = Eyes(make_detector("moving:warm_up_frames=9"), Tracker(), Stabilizer())
    off = []
    for frame in WorldCamera(scene, rate_hz=10, duration_s=5):
        look = eyes.look(frame)
        truth = true_uv(scene, np.array([frame.t]))[0]
        if len(look.sightings):
            off.append(np.abs(look.sightings.uv - truth).max(axis=1).min())
    assert len(off) > 20
    assert np.median(off) < 10  # the middle of what is seen of it, not of its roof


def test_a_detector_that_compares_no_frames_needs_no_stable_view() -> None:
    assert not StillView(Steady()).needed
    assert StillView(make_detector("moving")).needed


class Prompt(Steady):
    """Sees one thing in each frame, and one more that it found by looking around in the frame before."""

    def __init__(self) -> None:
        super().__init__()
        self.more = 0

    def follow(self, frame: Frame) -> Sightings:
        places = [[10.0 + frame.index, 40.0], [60.0, 20.0]]
        return Sightings.round(frame.t, places[: 1 + min(self.more, 1)], 0.5)

    def look_around(self) -> None:
        self.more += 1


def test_who_is_in_a_hurry_gets_what_is_known_and_looks_around_later() -> None:
    detector = Prompt()
    eyes = Eyes(detector, Tracker())
    one, two, three = frames(3)
    assert len(eyes.look(one, at_once=True).seen) == 1
    eyes.look_around()
    assert len(eyes.look(two, at_once=True).seen) == 2
    assert len(eyes.look(three).seen) == 1  # by detect
    assert detector.more == 1


def test_a_detector_that_cannot_answer_early_takes_its_time() -> None:
    eyes, other = Eyes(Steady(), Tracker()), Eyes(Steady(), Tracker())
    for frame in frames(5):
        look = eyes.look(frame, at_once=True)
        eyes.look_around()
        np.testing.assert_array_equal(look.seen.uv, other.look(frame).seen.uv)


def test_a_video_counts_its_frames_and_its_time() -> None:
    seen: list[Look] = []
    found = track_video(
        frames(30), Eyes(Steady(blind=(7, 8)), Tracker()), TrackRecorder(), each=seen.append
    )
    assert (found.frames, found.clock, found.image_size_px) == (30, "rate", (160, 90))
    assert found.duration_s == pytest.approx(29 / 20)
    assert len(seen) == 30
    assert found.tracks.targets == ("track-1",)
    assert len(found.tracks) == 28
    assert not found.unplaced
    with pytest.raises(UndeterminedError, match="no frames"):
        track_video(frames(0), Eyes(Steady(), Tracker()), TrackRecorder())
