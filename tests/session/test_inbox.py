"""What waits for the loop: old frames are dropped, old stops never, and both wake it."""

from __future__ import annotations

from threading import Thread
from typing import Any

import pytest

from airground.session.inbox import Inbox
from airground.session.inputs import CameraNews, Heard, Ordered, Seen
from airground.session.orders import Alive, Stop
from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker


def frame(index: int) -> Seen:
    sightings = Sightings.none(index / 20)
    tracks = Tracker().update(sightings)
    return Seen(index / 20, index / 20, index, (640, 480), sightings, tracks)


def test_the_newest_two_frames_are_kept_and_the_rest_counted() -> None:
    box = Inbox()
    for k in range(5):
        box.put(frame(k))
        box.put(Heard(f"robot {k}", ()))
    taken: list[Any] = box.take()
    assert [one.index for one in taken if isinstance(one, Seen)] == [3, 4]
    assert [one.robot for one in taken if isinstance(one, Heard)] == [
        f"robot {k}" for k in range(5)
    ]
    assert [type(one).__name__ for one in taken[-4:]] == ["Seen", "Heard", "Seen", "Heard"]
    assert box.dropped_frames == 3
    assert box.take() == []


def test_a_flood_drops_all_but_stops(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground.session.inbox.MOST_OTHERS", 20)
    box = Inbox()
    for _ in range(50):
        box.put(Ordered("me", Alive()))
        box.put(Ordered("you", Stop()))
    taken: list[Any] = box.take()
    assert sum(isinstance(one.order, Stop) for one in taken) == 50
    assert box.dropped_others == 50 - sum(isinstance(one.order, Alive) for one in taken) > 30
    box.put(Ordered("me", Alive()))
    assert len(box.take()) == 1


def test_frames_and_stops_wake_the_loop_and_nothing_else() -> None:
    box = Inbox()
    box.put(CameraNews("live"))
    box.put(Ordered("me", Alive()))
    assert not box.wait(0.001)
    for urgent in (frame(1), Ordered("me", Stop())):
        waker = Thread(target=box.put, args=(urgent,))
        waker.start()
        assert box.wait(20.0)
        waker.join()
        box.take()
        assert not box.wait(0.0)
