"""Doubt where nobody could see who is who, stated and not passed over."""

from __future__ import annotations

import numpy as np
import pytest

from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker, TrackerOptions, TrackerState
from airground.vision.tracker.encounters import exchanged, mistaken
from airground.vision.tracker.state import AMBIGUOUS
from vision.tracker.points import Detector, robots
from vision.tracker.swaps import look, unannounced


def meet(count: int, stay_s: float, options: TrackerOptions) -> TrackerState:
    """Things come together from all sides, are seen as one for a while, and go back."""
    tracker = Tracker(options)
    ways = np.arange(count) * 2 * np.pi / count
    toward = np.column_stack([np.cos(ways), np.sin(ways)])
    for k in range(int((2.4 + stay_s) * 30)):
        t = k / 30
        gap = 80 * max(1.2 - t, t - 1.2 - stay_s, 0.0)
        uv = 300 + gap * toward
        state = tracker.update(Sightings.round(t, uv if gap > 12 else uv.mean(axis=0)[None], 0.3))
    return state


@pytest.mark.parametrize(("count", "hypotheses"), [(2, 6), (2, 1), (6, 6)])
def test_who_stood_as_one_is_ambiguous(count: int, hypotheses: int) -> None:
    """However many, and whether or not several answers are followed."""
    state = meet(count, 1.0, TrackerOptions(hypotheses=hypotheses))
    known = [track for track in state.confirmed_tracks if track.serial <= count]
    assert known  # a name that is new says nothing about who it was
    assert all(track.ambiguous for track in known)


def test_who_never_met_is_not() -> None:
    scene = robots(4, 3, 3.0, Detector(miss=0.0, clutter=0.0, dropouts_per_minute=0.0))
    tracker = Tracker()
    for sightings in scene.sightings:
        state = tracker.update(sightings)
    assert not scene.shared.any()
    assert not any(track.ambiguous for track in state.tracks)


def test_doubt_grows_with_the_time_together_up_to_a_half() -> None:
    doubt = exchanged(np.array([0.0, 0.2, 0.4, 1.0, 3.0, 100.0]), 0.5)
    assert doubt[0] == 0.0
    assert (np.diff(doubt) > 0).all()
    assert doubt[1] < AMBIGUOUS < doubt[2]
    assert doubt[-1] == pytest.approx(0.5)


def test_one_that_turns_up_where_another_may_be_puts_both_in_doubt() -> None:
    middle = np.array([[100.0, 100.0], [120.0, 100.0], [900.0, 100.0]])
    spread = np.tile(100.0 * np.eye(2), (3, 1, 1))
    away = np.array([True, True, True])
    doubt = mistaken(middle[:1], np.array([0]), away, middle=middle, spread=spread, px=5.0)
    assert doubt[0] == pytest.approx(doubt[1])
    assert doubt[0] > AMBIGUOUS
    assert doubt[2] < 1e-9
    alone = mistaken(
        middle[:1],
        np.array([0]),
        np.array([True, False, False]),
        middle=middle,
        spread=spread,
        px=5.0,
    )
    assert (alone == 0).all()


@pytest.mark.parametrize(
    "seed",
    [
        6,
        pytest.param(
            1,
            marks=pytest.mark.xfail(
                strict=True,
                reason="one of two that are seen as one takes their sightings for its own, and no shared "
                "sighting is noticed until they part: the exchange is stated as 0.0006",
            ),
        ),
    ],
)
def test_exchanges_are_announced(seed: int) -> None:
    """Many in little room; identities do get exchanged here, and nobody is told otherwise."""
    detector = Detector(size_px=(420, 320), clutter=0.5)
    total, silent = unannounced([look(robots(seed, 8, 6.0, detector), every_s=2.5)], AMBIGUOUS)
    assert total >= 1
    assert silent == 0
