from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from airground import MotionSamples
from airground.errors import InputError, SampleError

GOOD = {"uv": np.ones((4, 2)), "uv_dot": np.ones((4, 2)), "xy_dot": np.ones((4, 2))}


@pytest.mark.parametrize("name", GOOD)
def test_samples_are_our_own_copies(name: str) -> None:
    given = {key: value.copy() for key, value in GOOD.items()}
    samples = MotionSamples(**given)
    given[name][0, 0] = 99.0
    assert getattr(samples, name)[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        getattr(samples, name)[0, 0] = 5.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(samples, name, given[name])


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize(
    "bad",
    [
        np.ones((3, 2)),
        np.ones((4, 3)),
        np.ones(4),
        np.ones((4, 2, 1)),
        1.0,
        None,
        np.full((4, 2), np.nan),
        np.full((4, 2), np.inf),
        [["a", "b"]] * 4,
        [[1.0, 2.0], [3.0], [4.0, 5.0], [6.0, 7.0]],
    ],
    ids=str,
)
def test_samples_that_are_not_well_formed(name: str, bad: Any) -> None:
    with pytest.raises(SampleError) as caught:
        MotionSamples(**{**GOOD, name: bad})
    assert isinstance(caught.value, InputError)
    assert caught.value.exit_code == 2
    assert "\n" not in str(caught.value)


def test_no_samples_are_well_formed() -> None:
    none = np.empty((0, 2))
    assert len(MotionSamples(none, none, none)) == 0


@pytest.mark.parametrize(
    ("rows", "want"),
    [(slice(1, 3), [1, 2]), ([3, 0], [3, 0]), (np.array([True, False, False, True]), [0, 3])],
)
def test_take(rows: Any, want: list[int]) -> None:
    uv = np.arange(8.0).reshape(4, 2)
    samples = MotionSamples(uv, uv + 10, uv + 20).take(rows)
    assert len(samples) == len(want)
    assert np.array_equal(samples.uv, uv[want])
    assert np.array_equal(samples.uv_dot, uv[want] + 10)
    assert np.array_equal(samples.xy_dot, uv[want] + 20)
