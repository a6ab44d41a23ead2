"""Rows of tracks and motion: sorted, checked, our own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from airground import Motion, Tracks
from airground.errors import InputError


def test_rows_in_any_order_come_out_sorted(rng: np.random.Generator) -> None:
    t = np.array([0.0, 1.0, 2.0, 0.5, 1.5])
    target = ["a", "a", "a", "b", "b"]
    uv = np.arange(10.0).reshape(5, 2)
    for _ in range(10):
        order = rng.permutation(5)
        tracks = Tracks.from_rows(
            t[order], [target[k] for k in order], uv[order], np.arange(1, 6)[order]
        )
        assert tracks.targets == tuple(dict.fromkeys(target[k] for k in order))  # as first met
        for name in "ab":
            rows = tracks.rows(name)
            mine = [k for k in range(5) if target[k] == name]
            assert np.array_equal(tracks.t[rows], t[mine])
            assert np.array_equal(tracks.uv[rows], uv[mine])
            assert tracks.sigma is not None
            assert np.array_equal(tracks.sigma[rows], np.array(mine) + 1)


def test_a_name_that_does_not_occur_has_no_rows() -> None:
    tracks = Tracks.from_rows([0.0], ["a"], [[1.0, 2.0]])
    assert len(tracks.uv[tracks.rows("b")]) == 0
    assert len(tracks) == 1


def test_columns_are_our_own_copies() -> None:
    uv, t = np.ones((2, 2)), np.array([0.0, 1.0])
    tracks = Tracks(("a",), np.zeros(2, dtype=np.intp), t, uv)
    uv[0], t[0] = 99.0, -5.0
    assert tracks.uv[0, 0] == 1.0
    assert tracks.t[0] == 0.0
    for array in (tracks.uv, tracks.t, tracks.target_index):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


BAD_TRACKS: dict[str, tuple[Any, Any, Any, Any]] = {
    "no rows": ([], [], np.empty((0, 2)), None),
    "two rows at one time": ([1.0, 1.0], ["a", "a"], np.ones((2, 2)), None),
    "an empty name": ([1.0], [""], np.ones((1, 2)), None),
    "fewer names": ([1.0, 2.0], ["a"], np.ones((2, 2)), None),
    "time is NaN": ([np.nan], ["a"], np.ones((1, 2)), None),
    "uv is NaN": ([1.0], ["a"], [[np.nan, 1.0]], None),
    "three coordinates": ([1.0], ["a"], np.ones((1, 3)), None),
    "fewer points": ([1.0, 2.0], ["a", "a"], np.ones((1, 2)), None),
    "one number for all points": ([1.0], ["a"], 5.0, None),
    "points in words": ([1.0], ["a"], [["left", "top"]], None),
    "times in words": (["now"], ["a"], np.ones((1, 2)), None),
    "more points": ([1.0], ["a"], np.ones((2, 2)), None),
    "sigma is nought": ([1.0], ["a"], np.ones((1, 2)), [0.0]),
    "more sigmas": ([1.0], ["a"], np.ones((1, 2)), [1.0, 2.0]),
}


@pytest.mark.parametrize("name", BAD_TRACKS)
def test_tracks_that_are_not_well_formed(name: str) -> None:
    t, target, uv, sigma = BAD_TRACKS[name]
    with pytest.raises(InputError) as caught:
        Tracks.from_rows(t, target, uv, sigma)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("index", [[0], [0, 2], [-1, 0], [1, 0]])
def test_wrong_target_index(index: list[int]) -> None:
    with pytest.raises(InputError):
        Tracks(("a", "b"), np.array(index, dtype=np.intp), np.array([0.0, 1.0]), np.ones((2, 2)))


def test_names_are_distinct() -> None:
    with pytest.raises(InputError, match="distinct"):
        Tracks(("a", "a"), np.zeros(1, dtype=np.intp), np.array([0.0]), np.ones((1, 2)))


T, A = [0.0, 1.0], ["a", "a"]
COLUMN = np.array([1.0, 2.0])


@pytest.mark.parametrize(
    "columns",
    [
        {"xy_dot": np.ones((2, 2))},
        {"heading": COLUMN, "speed": -COLUMN},
        {"heading": COLUMN, "distance": COLUMN},
        {"heading": COLUMN, "distance": COLUMN, "speed": COLUMN, "sigma_speed": COLUMN},
    ],
)
def test_forms_of_motion(columns: dict[str, Any]) -> None:
    motion = Motion.from_rows(T, A, **columns)
    for name in ("xy_dot", "heading", "speed", "distance", "sigma_speed", "sigma_heading"):
        value = getattr(motion, name)
        assert (value is None) == (name not in columns)
        if value is not None:
            assert np.array_equal(value, columns[name])


@pytest.mark.parametrize(
    "columns",
    [
        {},
        {"heading": COLUMN},
        {"speed": COLUMN},
        {"distance": COLUMN},
        {"xy_dot": np.ones((2, 2)), "heading": COLUMN, "speed": COLUMN},
        {"xy_dot": np.ones((2, 2)), "speed": COLUMN},
        {"xy_dot": np.ones((2, 3))},
        {"heading": COLUMN, "speed": np.array([1.0, np.nan])},
        {"heading": COLUMN, "speed": COLUMN, "sigma_heading": -COLUMN},
        {"heading": COLUMN, "speed": COLUMN[:1]},
        {"heading": np.ones(3), "speed": COLUMN},
    ],
)
def test_motion_that_is_not_well_formed(columns: dict[str, Any]) -> None:
    with pytest.raises(InputError) as caught:
        Motion.from_rows(T, A, **columns)
    assert "\n" not in str(caught.value)
