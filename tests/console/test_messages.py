"""What the server tells is JSON that any browser reads: short, and never NaN."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.console.messages import (
    fences_document,
    message_text,
    path_document,
    plain,
    site_document,
    state_document,
)
from airground.session.tick import CameraView, OtherView, PathView, RobotView
from console.fake_session import FakeSession, make_tick, robot_view


@dataclass(frozen=True)
class Nested:
    uv: tuple[float, float]
    rest: Any


@pytest.mark.parametrize(
    ("value", "document"),
    [
        (None, None),
        (True, True),
        (3, 3),
        ("a", "a"),
        (1.23456789, 1.2346),
        (math.nan, None),
        (math.inf, None),
        (-math.inf, None),
        ((1.0, math.nan), [1.0, None]),
        (np.float64(0.5), 0.5),
        (np.float32(math.nan), None),
        (np.int64(3), 3),
        (np.bool_(True), True),
        (np.array([[1.0, math.inf]]), [[1.0, None]]),
        ({"a": (1,)}, {"a": [1]}),
        (Nested((1.23456, 2.0), Nested((0.0, 0.0), None)), None),
    ],
)
def test_plain(value: object, document: object) -> None:
    if isinstance(value, Nested):
        document = {"uv": [1.23, 2.0], "rest": {"uv": [0.0, 0.0], "rest": None}}
    assert plain(value) == document
    json.dumps(plain(value), allow_nan=False)


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
        lambda inner: st.lists(inner) | st.tuples(inner, inner) | st.dictionaries(st.text(), inner),
        max_leaves=10,
    )
)
def test_anything_can_be_sent(value: object) -> None:
    text = message_text(plain(value))
    assert text.isascii()
    json.loads(text, parse_constant=pytest.fail)


def test_the_state_has_the_names_of_the_tick() -> None:
    document = state_document(make_tick(2.0, why="because"), 2.0123456)
    assert (document["t"], document["now"], document["why"]) == (2.0, 2.012, "because")
    for key, kind in (("robots", RobotView), ("others", OtherView)):
        assert len(document[key]) > 0
        assert set(document[key][0]) == {one.name for one in fields(kind)}
    assert set(document["camera"]) == {one.name for one in fields(CameraView)}
    assert document["robots"][0]["command"] == {"v": 0.0, "omega": 0.0, "lateral": 0.0}


def test_a_state_with_nothing_known_can_be_sent() -> None:
    lost = robot_view(uv=(math.nan, math.inf), heading_rad=None, speed_mps=math.nan)
    camera = CameraView("lost", "unplugged", None, math.nan, -1, None)
    document = state_document(make_tick(robots=(lost,), camera=camera), math.nan)
    assert document["robots"][0]["uv"] == [None, None]
    assert document["now"] is None
    message_text(document)


def test_a_tracker_gone_wild_does_not_fill_the_line() -> None:
    others = make_tick().others * 1000
    text = message_text(state_document(make_tick(others=others), 0.0))
    assert len(text) < 60_000


def test_a_path_says_whether_it_may_be_driven() -> None:
    points = np.array([[1.00004, 2.0, 0.3], [3.0, 4.0, math.nan]])
    path = PathView("one", 4, points, (), 1.0, 2.0, 0.5)
    document = path_document(path)
    assert document["drivable"] is True
    assert document["points"] == [[1.0, 2.0, 0.3], [3.0, 4.0, None]]
    blocked = PathView("one", 4, points, (("too tight", ((1.0, 2.0),)),), 1.0, 2.0, 0.5)
    document = path_document(blocked)
    assert document["drivable"] is False
    assert document["undrivable"] == [["too tight", [[1.0, 2.0]]]]


def test_fences_and_site() -> None:
    fence = ((0.0, 0.0), (10.0, 0.0), (10.0, 9.96))
    tick = make_tick(fences=((fence,), ()), fences_revision=3)
    assert fences_document(tick) == {
        "stay_inside": [[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]],
        "keep_out": [],
        "revision": 3,
    }
    site = site_document(FakeSession().site)
    assert site["robots"][0]["limits"]["speed_mps"] == 0.5
    assert set(site) == {"name", "control_hz", "wanted_sigma", "robots"}
