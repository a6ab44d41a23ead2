"""Headings driven, and the advice that follows from them."""

from __future__ import annotations

import numpy as np
import pytest

from airground.calibration.headings import advise, distinct_headings_deg
from scenes import Array


def moves(headings_deg: Array, speed: float = 1.0) -> Array:
    a = np.radians(headings_deg)
    return np.column_stack([np.cos(a), np.sin(a)]) * speed


def off(found: tuple[float, ...], want: list[float]) -> float:
    """The largest difference, modulo 180 degrees; infinite where the numbers differ."""
    if len(found) != len(want):
        return np.inf
    return max(min(abs((f - w + 90) % 180 - 90) for w in want) for f in found)


@pytest.mark.parametrize("first", range(0, 180, 5))
def test_a_line_there_and_back_is_one_heading_wherever_it_points(first: int) -> None:
    assert off(distinct_headings_deg(moves(np.array([first, first + 180.0] * 9))), [first]) < 1


@pytest.mark.parametrize("first", range(0, 180, 5))
@pytest.mark.parametrize("angle", [30, 45, 60, 90])
def test_two_lines_are_two_headings(first: int, angle: int) -> None:
    driven = np.array([first, first + angle, first + 180.0] * 9)
    assert off(distinct_headings_deg(moves(driven)), [first, (first + angle) % 180]) < 1


@pytest.mark.parametrize("first", [0, 20, 77, 179])
def test_a_compass_that_trembles_makes_no_new_headings(
    first: int, rng: np.random.Generator
) -> None:
    driven = np.concatenate([first + rng.normal(0, 2, 300), first + 91 + rng.normal(0, 2, 300)])
    assert off(distinct_headings_deg(moves(driven)), [first, (first + 91) % 180]) < 2


def test_a_circle_has_many_headings() -> None:
    found = distinct_headings_deg(moves(np.arange(0.0, 360.0, 3.0)))
    assert len(found) >= 10
    assert list(found) == sorted(found)
    assert found[0] >= 0
    assert found[-1] < 180


def test_a_short_stretch_does_not_count() -> None:
    driven = np.vstack([moves(np.full(99, 10.0)), moves(np.array([100.0]), 0.5)])
    assert off(distinct_headings_deg(driven), [10]) < 1


def test_standing_still_has_no_heading() -> None:
    assert distinct_headings_deg(np.zeros((5, 2))) == ()
    assert distinct_headings_deg(np.empty((0, 2))) == ()


@pytest.mark.parametrize(
    ("headings", "wanted"),
    [
        ((), "drive: the readings show no motion"),
        ((20.0,), "80 and 140 degrees"),
        ((20.0, 110.0), "65 degrees"),
        ((0.0, 30.0), "105 degrees"),
        ((20.0, 80.0, 140.0), "other parts of the image"),
        ((22.0, 33.0), "88 and 148 degrees"),
        ((5.0, 175.0), "60 and 120 degrees"),  # near each other, across the wrap
        ((26.0, 37.0, 53.0, 68.0, 83.0, 97.0), "151 degrees"),
        ((0.0, 45.0, 90.0, 135.0), "other parts of the image"),
    ],
)
def test_advice(headings: tuple[float, ...], wanted: str) -> None:
    advice = advise(headings)
    assert wanted in advice
    assert "\n" not in advice
