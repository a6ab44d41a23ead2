from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from airground.errors import InputError
from airground.geometry.arrays import LARGEST, homogeneous, points, readonly, refuse_huge


def test_readonly_is_our_own_copy_and_cannot_be_written_to() -> None:
    given = np.arange(4.0)
    array = readonly(given, (4,), "uv")
    given[0] = 99.0
    assert array[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 1.0
    assert given.flags.writeable  # the caller's stays as it was


@pytest.mark.parametrize(
    ("value", "shape", "message"),
    [
        ([1.0, 2.0], (3,), r"uv must have shape \(3\), not \(2,\)"),
        ([[1.0, 2.0]], (2,), r"not \(1, 2\)"),
        (1.0, (None, 2), r"uv must have shape \(N, 2\), not \(\)"),
        ([1.0, np.nan], (2,), "uv has NaN or infinite entries"),
        ([1.0, np.inf], (None,), "uv has NaN or infinite entries"),
        ([[1.0, 2.0], [3.0]], (None, 2), "uv must be an array of numbers"),
        ([1, 10**400], (2,), "uv must be an array of numbers"),
        (["one", "two"], (2,), "uv must be an array of numbers"),
        ([1j, 2j], (2,), "uv must be an array of numbers"),
        (None, (2,), "uv"),
    ],
)
def test_readonly_refuses_in_one_line(
    value: Any, shape: tuple[int | None, ...], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        readonly(value, shape, "uv")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [1.0, [], [1.0], [[1.0, 2.0, 3.0]]])
def test_points_need_two_coordinates(value: Any) -> None:
    with pytest.raises(InputError, match="uv must have two entries on its last axis"):
        points(value, "uv")


@pytest.mark.parametrize("value", [["one", "two"], [[1.0, 2.0], [3.0]], [1j, 2j]])
def test_points_must_be_numbers(value: Any) -> None:
    with pytest.raises(InputError, match="uv must be an array of numbers") as caught:
        points(value, "uv")
    assert "\n" not in str(caught.value)


def test_points_may_be_unknown() -> None:
    assert np.isnan(points([np.nan, 1.0], "uv")[0])


def test_homogeneous_appends_one_for_points_and_nought_for_directions() -> None:
    xy = np.array([[3.0, 4.0]])
    assert homogeneous(xy).tolist() == [[3.0, 4.0, 1.0]]
    assert homogeneous(xy, 0.0).tolist() == [[3.0, 4.0, 0.0]]


def test_what_is_too_large_to_compute_with() -> None:
    refuse_huge([-LARGEST, LARGEST], "uv")
    refuse_huge([], "uv")
    with pytest.raises(InputError, match=r"uv: found 2e\+15, expected at most 1e\+15"):
        refuse_huge([1.0, -2 * LARGEST], "uv")
