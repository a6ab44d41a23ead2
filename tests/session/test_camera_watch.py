"""How a camera stands, by its frames and by what its source says."""

from __future__ import annotations

import pytest

from airground.session.camera_watch import CameraWatch
from airground.session.inputs import CameraNews, Seen
from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker

OFFSET_S = -0.05


def frame(t: float, arrived_s: float, index: int = 0) -> Seen:
    sightings = Sightings.none(t)
    return Seen(t, arrived_s, index, (640, 480), sightings, Tracker().update(sightings))


def watch(until_s: float = 1.0, late_s: float = 0.06) -> CameraWatch:
    """Twenty pictures a second, exposed 50 ms before their stamp, in memory a little later."""
    one = CameraWatch()
    for k in range(1 + round(until_s * 20)):
        one.see(frame(k / 20, k / 20 + late_s, k))
    return one


def test_nothing_is_known_before_the_first_picture() -> None:
    one = CameraWatch()
    view = one.view(3.0, OFFSET_S)
    assert (view.state, view.age_s, view.index, view.size_px) == ("opening", None, -1, None)
    assert one.fresh_t(OFFSET_S) is None
    one.hear(CameraNews("lost", "no route to the camera"))
    assert one.view(3.0, OFFSET_S).state == "lost"
    assert one.view(3.0, OFFSET_S).line == "no route to the camera"


def test_a_camera_that_is_well() -> None:
    one = watch()
    view = one.view(1.08, OFFSET_S)
    assert (view.state, view.line, view.index, view.size_px) == ("live", "", 20, (640, 480))
    assert view.age_s == pytest.approx(0.13)
    assert view.rate_hz == pytest.approx(20)
    assert one.fresh_t(OFFSET_S) == pytest.approx(0.95)


def test_silence_is_lost_and_what_is_old_when_it_comes_is_late() -> None:
    one = watch()
    assert one.view(1.40, OFFSET_S).state == "live"
    gone = one.view(1.60, OFFSET_S)  # robots are stopped by now, and nobody says "late"
    assert (gone.state, gone.line) == ("lost", "no picture for 0.5 s")
    assert one.view(9.0, OFFSET_S).rate_hz == 0
    late = watch(late_s=1.0)
    view = late.view(2.02, OFFSET_S)
    assert (view.state, view.line) == ("late", "pictures are 1.1 s old")
    assert late.view(2.7, OFFSET_S).state == "lost"


def test_a_picture_that_does_not_change_is_as_old_as_its_last_change() -> None:
    one = watch()
    assert one.fresh_t(0.0) == 1.0
    for k in range(21, 28):
        one.hear(CameraNews("live", frozen_s=(k - 20) / 20))
        one.see(frame(k / 20, k / 20 + 0.06, k))
    assert one.frozen
    view = one.view(1.41, OFFSET_S)
    assert view.state == "frozen"
    assert "the same picture for 0.3 s" in view.line  # or 0.4
    assert one.fresh_t(0.0) == pytest.approx(1.0)
    one.hear(CameraNews("live"))
    one.see(frame(1.4, 1.46, 28))
    assert one.fresh_t(0.0) == 1.4


def test_changes_are_told_once() -> None:
    one = CameraWatch()
    assert one.changes(0.0, 0.0) == []
    one.see(frame(0.0, 0.06))
    assert one.changes(0.1, 0.0) == [("info", "camera: live")]
    assert one.changes(0.2, 0.0) == []
    assert one.changes(0.7, 0.0) == [("warning", "camera: lost: no picture for 0.6 s")]
    assert one.changes(0.8, 0.0) == []
    one.hear(CameraNews("ended"))
    assert one.changes(0.9, 0.0)[0][1].startswith("camera: ended")
