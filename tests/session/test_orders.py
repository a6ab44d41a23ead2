"""Orders from JSON: whatever comes gives an order or one line that says what is wrong."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.errors import InputError
from airground.session.orders import (
    KINDS,
    Alive,
    Calibrate,
    DriveTo,
    EndCalibration,
    FollowPath,
    Gone,
    Hand,
    Order,
    Release,
    Rest,
    SetFences,
    SetSpeed,
    Sketch,
    Stop,
    order_document,
    parse_order,
)

NAMES = st.text(st.characters(categories=("L", "N")), min_size=1, max_size=20)
PIXEL = st.floats(-1e5, 1e5)
POINTS = st.lists(st.tuples(PIXEL, PIXEL), min_size=3, max_size=6).map(tuple)
SHARE = st.floats(-1, 1)
NUMBER = st.integers(0, 2**53 - 1)
MAYBE_SPEED = st.none() | st.floats(1e-3, 100)
BUILT: dict[str, st.SearchStrategy[Order]] = {
    "stop": st.just(Stop()),
    "release": st.just(Release()),
    "alive": st.just(Alive()),
    "gone": st.just(Gone()),
    "drive_to": st.builds(DriveTo, NAMES, POINTS, st.none() | st.floats(-100, 100)),
    "sketch": st.builds(Sketch, NAMES, NUMBER, POINTS, MAYBE_SPEED),
    "follow_path": st.builds(FollowPath, NAMES, NUMBER),
    "rest": st.builds(Rest, st.none() | NAMES),
    "set_fences": st.builds(SetFences, st.lists(POINTS, max_size=3).map(tuple), st.tuples(POINTS)),
    "set_speed": st.builds(SetSpeed, NAMES, st.floats(1e-3, 100)),
    "calibrate": st.builds(
        Calibrate, st.sampled_from(["guided", "hand"]), st.lists(NAMES, max_size=3).map(tuple)
    ),
    "end_calibration": st.builds(EndCalibration, st.booleans()),
    "hand": st.builds(Hand, NAMES, SHARE, SHARE),
}
ORDERS = st.one_of(*BUILT.values())

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(["red", "guided", 10**400, -(2**60), float("nan"), "\x00", "a" * 100])
)
JSON: st.SearchStrategy[Any] = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=12,
)
FIELD_NAMES = sorted({one.name for kind in KINDS.values() for one in fields(kind)} | {"x", ""})


@given(ORDERS)
def test_an_order_goes_over_the_wire_and_comes_back_to_the_last_bit(order: Order) -> None:
    document = json.loads(json.dumps(order_document(order)))
    assert parse_order(document) == order
    assert parse_order(order_document(order)) == order


def test_every_kind_is_tried_above() -> None:
    assert set(BUILT) == set(KINDS)


@given(JSON)
def test_any_json_is_an_order_or_refused_in_one_line(document: Any) -> None:
    _parse(document)


@given(st.sampled_from(sorted(KINDS)), st.dictionaries(st.sampled_from(FIELD_NAMES), JSON))
def test_any_fields_are_an_order_or_refused_in_one_line(kind: str, given_: dict[str, Any]) -> None:
    _parse(given_ | {"kind": kind})


@given(ORDERS, st.data())
def test_an_order_with_one_field_spoiled_is_an_order_or_refused(
    order: Order, data: st.DataObject
) -> None:
    document = order_document(order)
    document[data.draw(st.sampled_from(sorted(document)))] = data.draw(JSON)
    _parse(document)


def _parse(document: Any) -> None:
    order, line = None, ""
    try:
        order = parse_order(document)
    except InputError as error:
        line = str(error)
    assert "\n" not in line
    assert len(line) < 400
    if order is None:
        assert line
        return
    assert type(order) in KINDS.values()
    assert parse_order(json.loads(json.dumps(order_document(order), allow_nan=False))) == order


@pytest.mark.parametrize(
    ("document", "line"),
    [
        (None, "an order must be an object, not NoneType"),
        ([], "an order must be an object, not list"),
        ({}, "kind must be one of stop, release, .*, not None"),
        ({"kind": "fly"}, "kind must be one of .*, not 'fly'"),
        ({"kind": ["stop"]}, "kind must be one of"),
        ({"kind": "stop", "now": 1}, "stop: unknown field 'now'; it has none"),
        ({"kind": "drive_to", "robot": "red"}, "drive_to: field goals_px is missing"),
        ({"kind": "drive_to", "robot": "", "goals_px": [[1, 2]]}, "robot must be a name"),
        ({"kind": "drive_to", "robot": "r\n", "goals_px": [[1, 2]]}, "robot must be a name"),
        ({"kind": "drive_to", "robot": "red", "goals_px": []}, "a list of 1 to 50 pixels"),
        ({"kind": "drive_to", "robot": "red", "goals_px": [[1, 2, 3]]}, "must hold pixels"),
        ({"kind": "drive_to", "robot": "red", "goals_px": [[1, True]]}, "must be a number, not"),
        ({"kind": "drive_to", "robot": "red", "goals_px": [[1, 10**400]]}, "a number from"),
        ({"kind": "drive_to", "robot": "red", "goals_px": [[1, float("nan")]]}, "a number from"),
        ({"kind": "sketch", "robot": "red", "sketch": -1, "points_px": [[0, 0]] * 2}, "whole"),
        ({"kind": "sketch", "robot": "red", "sketch": 1.0, "points_px": [[0, 0]] * 2}, "whole"),
        ({"kind": "sketch", "robot": "red", "sketch": 1, "points_px": [[0, 0]] * 4001}, "4000"),
        ({"kind": "set_speed", "robot": "red", "speed_mps": None}, "must be a number, not None"),
        ({"kind": "set_speed", "robot": "red", "speed_mps": 0}, "a number from 0.001 to 100"),
        ({"kind": "set_fences", "keep_out": [[[0, 0], [1, 1]]]}, "a list of 3 to 100 pixels"),
        ({"kind": "calibrate", "by": "magic"}, "by must be guided or hand, not 'magic'"),
        ({"kind": "end_calibration", "keep": 1}, "keep must be true or false, not 1"),
        ({"kind": "hand", "robot": "red", "forward": 1.5, "turn": 0}, "a number from -1 to 1"),
    ],
)
def test_what_is_wrong_is_said(document: Any, line: str) -> None:
    with pytest.raises(InputError, match=line):
        parse_order(document)


def test_what_need_not_be_given_need_not_be_given() -> None:
    assert parse_order({"kind": "rest"}) == Rest(None)
    assert parse_order({"kind": "end_calibration"}) == EndCalibration(True)
    assert parse_order({"kind": "calibrate"}) == Calibrate("guided", ())
    goal = parse_order({"kind": "drive_to", "robot": "red", "goals_px": [[1, 2]]})
    assert goal == DriveTo("red", ((1.0, 2.0),), None)
