"""Inputs and options as text and back, to the last bit."""

from __future__ import annotations

from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from airground.control import Limits
from airground.control.safety.bounds import SafetyBounds
from airground.errors import AirgroundError, InputError
from airground.records.session_log_text import exact_json, parse_json
from airground.robots import RobotReading
from airground.session.coding import (
    input_document,
    options_document,
    read_input,
    read_options,
    tracks_document,
)
from airground.session.inputs import CameraNews, Finished, Heard, Input, Ordered, Seen
from airground.session.options import RobotOptions, SessionOptions
from airground.session.orders import DriveTo, Rest, SetFences, Stop
from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from airground.vision.tracker import TrackerState

CRUMB = 0.1 + 0.2  # no short decimal
LEAST = 5e-324


def through(one: Input) -> Any:
    """There and back, as the recording has it."""
    tracker = Tracker()

    def track(sightings: Sightings, segment: int) -> TrackerState:
        assert segment == 3
        return tracker.update(sightings)

    return read_input(parse_json(exact_json(input_document(one))), track, lambda job: f"of {job}")


@pytest.mark.parametrize(
    "one",
    [
        CameraNews("lost", 'a line with "quotes" and ü', CRUMB),
        Heard("red", (RobotReading(CRUMB, -1e300, LEAST, -0.0), RobotReading(1e9 + CRUMB))),
        Heard("red", (RobotReading(nan, inf, -inf, None),)),
        Heard("red", ()),
        Ordered("me", Stop()),
        Ordered("me", Rest(None)),
        Ordered("me", DriveTo("red", ((CRUMB, 2.0), (3.0, 4.0)), CRUMB)),
        Ordered("me", SetFences((((0.0, 0.0), (1.0, 0.0), (CRUMB, 1.0)),), ())),
    ],
    ids=lambda one: type(one).__name__,
)
def test_an_input_comes_back_to_the_last_bit(one: Input) -> None:
    again = through(one)
    assert type(again) is type(one)
    assert repr(again) == repr(one)  # NaN too, and the sign of zero


def test_finished_work_is_done_again() -> None:
    again = through(Finished(12, AirgroundError("something")))
    assert (again.job, again.result) == (12, "of 12")


@pytest.mark.parametrize("count", [0, 1, 4])
def test_a_frame_comes_back_to_the_last_bit(count: int, rng: np.random.Generator) -> None:
    L = rng.normal(size=(count, 2, 2))
    sightings = Sightings(
        CRUMB,
        rng.uniform(0, 700, (count, 2)),
        L @ L.swapaxes(1, 2) + 0.1 * np.eye(2),
        labels=tuple(str(k) for k in range(count)),
        angle=rng.normal(size=count),
        score=rng.uniform(size=count),
    )
    seen = Seen(CRUMB, CRUMB + 1e-9, 7, (1280, 720), sightings, Tracker().update(sightings), 3)
    again = through(seen)
    for name in ("t", "arrived_s", "index", "size_px", "segment"):
        assert getattr(again, name) == getattr(seen, name)
    for name in ("uv", "covariance", "angle", "angle_sigma", "score", "outline"):
        assert_array_equal(getattr(again.sightings, name), getattr(sightings, name))
    assert again.sightings.labels == sightings.labels
    assert exact_json(tracks_document(again.tracks)) == exact_json(tracks_document(seen.tracks))


@pytest.mark.parametrize(
    "document",
    [
        {},
        {"kind": "nothing"},
        {"kind": "heard", "robot": "red", "readings": [{"when": 1}]},
        {"kind": "heard", "robot": "red", "readings": 3},
        {"kind": "ordered", "client": "me", "order": {"kind": "fly"}},
        {"kind": "ordered", "client": "me"},
        {"kind": "seen", "t": 0.0, "sightings": {"uv": [[1, 2, 3]]}},
        {"kind": "camera", "state": "live"},
    ],
)
def test_what_is_no_input_is_said(document: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        read_input(document, lambda *_: Tracker().update(Sightings.none(0.0)), lambda _: None)


def test_options_come_back_as_they_were() -> None:
    square = ((0.0, 0.0), (CRUMB, 0.0), (1.0, 1.0))
    options = SessionOptions(
        (
            RobotOptions("red", "0", limits=Limits(speed_mps=0.7), speed_mps=CRUMB),
            RobotOptions("blue", "1", "omni", compass="relative"),
        ),
        name="a site",
        bounds=SafetyBounds(operator_s=2.0, speed_error_mps=inf),
        stay_inside=(square,),
        keep_out=(square, square),
        distortion="division",
    )
    assert read_options(parse_json(exact_json(options_document(options)))) == options


@pytest.mark.parametrize("spoil", ["unknown", "missing", "wrong"])
def test_options_of_another_version_are_refused(spoil: str) -> None:
    document = options_document(SessionOptions((RobotOptions("red", "0"),)))
    if spoil == "unknown":
        document["warp"] = 9
    elif spoil == "missing":
        del document["bounds"]
    else:
        document["robots"] = [{"name": "red"}]
    with pytest.raises(InputError, match="options are not those of this version"):
        read_options(document)
