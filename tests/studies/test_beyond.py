"""`reproduce beyond`: each ability on one drive, and what is said of drives that are made up."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from airground.calibration import Identification, RobotIdentity, TrackSpan
from airground.sim.recordings import RecordingPlan, record
from airground.studies.beyond import BEYOND
from airground.studies.beyond_drives import ABILITIES, judged, one_drive, pairings, unnamed
from airground.studies.item import Work
from airground.studies.reproduce import ITEMS, reproduce
from airground.studies.sheet import markdown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

T = TypeVar("T")

Found = dict[str, float | None]
FLEET = record(RecordingPlan(duration_s=6.0, robots=3), seed=3)


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    found: Any = reproduce(["beyond"], trials=1, seed=0)["beyond"]
    return dict(json.loads(json.dumps(found, allow_nan=False)))


def test_it_is_an_item_of_its_own(document: dict[str, Any]) -> None:
    assert ITEMS["beyond"] is BEYOND
    assert list(document) == ["paper", *ABILITIES, "drives"]
    assert list(document["paper"]) == list(ABILITIES)
    assert document["drives"] == 1
    for key in ABILITIES:
        values = document[key].values()
        assert all(value is None or math.isfinite(value) for value in values)


@pytest.mark.parametrize("key", ABILITIES)
def test_the_whole_drive_copes_with_it(document: dict[str, Any], key: str) -> None:
    assert document[key]["trajectory_refused"] == 0
    assert document[key]["trajectory_n_median"] < 0.015


@pytest.mark.parametrize("key", ["rectangles", "outliers", "robots"])
def test_the_linear_method_refuses_rightly(document: dict[str, Any], key: str) -> None:
    assert document[key]["linear_refused"] == 1
    assert document[key]["linear_n_median"] is None
    assert document[key]["equations_n_median"] > 0.3


@pytest.mark.parametrize("key", ["clocks", "lens"])
def test_the_linear_method_and_the_whole_drive_without_it_are_worse(
    document: dict[str, Any], key: str
) -> None:
    one = document[key]
    assert one["linear_n_median"] > 2 * one["trajectory_n_median"]
    assert one["without_n_median"] > 2 * one["trajectory_n_median"]


def test_the_linear_method_copes_with_an_ordinary_drive(document: dict[str, Any]) -> None:
    assert document["plain"]["linear_n_median"] < 0.02
    assert document["plain"]["equations_n_median"] == document["plain"]["linear_n_median"]


def test_what_is_wrong_is_found(document: dict[str, Any]) -> None:
    assert document["clocks"]["time_offset_s_true"] == 0.3
    assert document["clocks"]["time_offset_s_error_median"] < 0.005
    assert document["lens"]["k1_true"] == -0.15
    assert document["lens"]["k1_error_median"] < 0.03
    assert document["outliers"]["inlier_fraction_error_median"] < 0.04
    assert document["robots"]["right_share"] == 1.0
    assert document["robots"]["wrong_share"] == 0.0
    assert document["robots"]["without_refused"] == 1


def test_the_table_says_what_the_document_says(document: dict[str, Any]) -> None:
    sheet = BEYOND.sheet(document)
    assert sheet.title.startswith("What the paper could not do")
    assert [row[0] for row in sheet.rows] == [one.words for one in ABILITIES.values()]
    shown = markdown(sheet)
    for key in ABILITIES:
        assert f"{document[key]['trajectory_n_median']:.4f}" in shown
    assert f"refused ({document['rectangles']['equations_n_median']:.4f})" in shown
    assert "100% named right" in shown
    assert "item moving" in sheet.note
    assert "item others" in sheet.note


def test_a_drive_depends_on_seed_and_number_only() -> None:
    first, again, other, next_seed = (
        one_drive("rectangles", *of) for of in ((1, 0), (1, 0), (1, 1), (2, 0))
    )
    assert first == again
    assert first["trajectory_n"] not in (other["trajectory_n"], next_seed["trajectory_n"])


def test_no_estimate_has_no_error() -> None:
    assert judged(FLEET, None) is None


def test_tracks_without_names_are_the_same_sightings() -> None:
    tracks = unnamed(FLEET, [2, 0, 1])
    assert tracks.targets == ("track-1", "track-2", "track-3")
    for track, robot in (("track-1", "robot-3"), ("track-2", "robot-1"), ("track-3", "robot-2")):
        there, here = FLEET.tracks.rows(robot), tracks.rows(track)
        assert_array_equal(tracks.uv[here], FLEET.tracks.uv[there])
        assert_array_equal(tracks.t[here], FLEET.tracks.t[there])


def identified(**tracks: list[str]) -> Identification:
    """Robots and the tracks that they were given."""
    robots = tuple(
        RobotIdentity(
            robot=name.replace("_", "-"),
            spans=tuple(TrackSpan(track, 0.0, 1.0, 20) for track in given),
            confidence=0.99,
            margin=5.0,
            candidates=(),
            reason="",
            advice="",
        )
        for name, given in tracks.items()
    )
    return Identification(robots, FLEET.tracks, None, None)


def test_pairings_are_judged_by_the_truth() -> None:
    order = [2, 0, 1]
    right = identified(robot_1=["track-2"], robot_2=["track-3"], robot_3=["track-1"])
    assert pairings(FLEET, order, right) == (1.0, 0.0)
    assert pairings(FLEET, [0, 1, 2], right) == (0.0, 1.0)
    mixed = identified(robot_1=["track-2", "track-1"], robot_2=["track-3"], robot_3=[])
    assert_allclose(pairings(FLEET, order, mixed), [1 / 3, 1 / 3])


@dataclass
class Told:
    """Drives that are told, row by row."""

    found: dict[str, list[Found]]

    def map(
        self,
        function: Callable[..., T],
        tasks: Iterable[tuple[Any, ...]],
        count: int,
        *,
        long: bool = False,
    ) -> Iterator[T]:
        del function, long
        assert count == 3 * len(ABILITIES)
        told: Any = (self.found[key][k] for key, _, k in tasks)
        return iter(told)


def test_refusals_are_counted_and_left_out_of_medians() -> None:
    known: Found = {"linear_n": 0.02, "equations_n": 0.02, "trajectory_n": 0.01, "right": 1.0}
    known |= {"without_n": 0.5, "wrong": 0.0, "k1": -0.14, "time_offset_s": 0.298}
    known |= {"inlier_fraction": 0.79}
    third = known | {
        "linear_n": 0.04,
        "trajectory_n": 0.03,
        "k1": -0.18,
        "right": 0.0,
        "wrong": 1.0,
    }
    refused: Found = {"linear_n": None, "equations_n": 0.9, "trajectory_n": None}
    refused |= {"without_n": None, "right": 1.0, "wrong": 0.0}
    told = {key: [known, refused, third] for key in ABILITIES}
    told["outliers"] = [refused] * 3
    steps: list[tuple[int, int]] = []
    work = Work(3, 0, lambda done, of: steps.append((done, of)), Told(told))
    document = BEYOND.compute(work).document
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert steps == [(k, 18) for k in range(1, 19)]
    lens = document["lens"]
    assert lens["linear_n_median"] == pytest.approx(0.03)
    assert lens["trajectory_n_median"] == pytest.approx(0.02)
    assert lens["linear_refused"] == lens["trajectory_refused"] == lens["without_refused"] == 1
    assert lens["k1_error_median"] == pytest.approx(0.02)
    rows = {row[0]: row[1:] for row in BEYOND.sheet(document).rows}
    lost = ("refused (0.9000)", "refused", "-", "-")
    assert rows[ABILITIES["outliers"].words] == lost
    assert rows[ABILITIES["lens"].words] == (
        "0.0300, 1 of 3 refused (0.0200)",
        "0.0200, 1 of 3 refused",
        "0.5000, 1 of 3 refused",
        "k1 to 0.020",
    )
    assert rows[ABILITIES["robots"].words][-1] == "67% named right, 33% wrong"


def test_few_trials_are_few_drives() -> None:
    counted: list[int] = []

    class Counting(Told):
        def map(
            self,
            function: Callable[..., T],
            tasks: Iterable[tuple[Any, ...]],
            count: int,
            *,
            long: bool = False,
        ) -> Iterator[T]:
            del function, tasks, long
            counted.append(count)
            told: Any = ({"right": 1.0, "wrong": 0.0} for _ in range(count))
            return iter(told)

    for trials in (2, 100):
        BEYOND.compute(Work(trials, 0, None, Counting({})))
    assert np.array_equal(counted, [2 * len(ABILITIES), 5 * len(ABILITIES)])
