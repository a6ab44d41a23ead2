"""What detectors hand on."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from airground.errors import InputError
from airground.vision.sightings import Sightings


def three() -> Sightings:
    return Sightings(
        1.5,
        np.arange(6.0).reshape(3, 2),
        np.array([k * np.eye(2) for k in (1.0, 2.0, 3.0)]),
        ("a", "b", ""),
        np.array([0.1, np.nan, 0.3]),
        np.array([0.01, np.nan, 0.03]),
        np.array([1.0, 0.5, 0.2]),
        np.arange(24.0).reshape(3, 4, 2),
    )


def test_what_is_left_out_is_filled() -> None:
    seen = Sightings(0.0, np.zeros((2, 2)), np.tile(np.eye(2), (2, 1, 1)))
    assert seen.labels == ("", "")
    assert np.isnan(seen.angle).all()
    assert np.isnan(seen.angle_sigma).all()
    assert_array_equal(seen.score, [1.0, 1.0])
    assert seen.outline.shape == (2, 4, 2)
    assert np.isnan(seen.outline).all()


def test_nothing_seen() -> None:
    none = Sightings.none(2.0)
    assert len(none) == 0
    assert none.t == 2.0
    assert none.covariance.shape == (0, 2, 2)
    assert len(none.take(np.array([], dtype=int))) == 0


@pytest.mark.parametrize("sigma", [2.0, np.array([2.0, 2.0])])
def test_round_squares_the_deviation(sigma: object) -> None:
    seen = Sightings.round(0.0, [[1, 2], [3, 4]], sigma, labels=("x", "y"))  # type: ignore[arg-type]
    assert_array_equal(seen.covariance, np.tile(4.0 * np.eye(2), (2, 1, 1)))
    assert seen.labels == ("x", "y")


def test_round_of_one_point() -> None:
    assert_array_equal(Sightings.round(0.0, [1, 2], 1.0).uv, [[1.0, 2.0]])


@pytest.mark.parametrize("rows", [[2, 0], np.array([True, False, True])])
def test_take_keeps_rows_together(rows: object) -> None:
    part = three().take(rows)  # type: ignore[arg-type]
    order = np.arange(3)[np.asarray(rows)]
    assert_array_equal(part.uv, three().uv[order])
    assert_array_equal(part.covariance, three().covariance[order])
    assert part.labels == tuple(three().labels[k] for k in order)
    assert_array_equal(part.angle, three().angle[order])
    assert_array_equal(part.score, three().score[order])
    assert_array_equal(part.outline, three().outline[order])
    assert part.t == 1.5


def test_arrays_are_copies_that_cannot_be_written_to() -> None:
    uv = np.zeros((1, 2))
    seen = Sightings(0.0, uv, np.eye(2)[None])
    uv[:] = 9.0
    assert_array_equal(seen.uv, [[0.0, 0.0]])
    for array in (seen.uv, seen.covariance, seen.angle, seen.score, seen.outline):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"uv": np.zeros((2, 3))}, "uv must have shape"),
        ({"uv": np.full((1, 2), np.nan)}, "uv has NaN"),
        ({"covariance": np.zeros((1, 2, 2))}, "positive definite"),
        ({"covariance": -np.eye(2)[None]}, "positive definite"),
        ({"covariance": np.array([[[1.0, 2.0], [2.0, 1.0]]])}, "positive definite"),
        ({"covariance": np.eye(2)}, "covariance must have shape"),
        ({"labels": ("a", "b")}, "labels must be 1"),
        ({"angle": np.zeros(2)}, "angle must have shape"),
        ({"angle": np.array([np.inf])}, "angle has infinite"),
        ({"score": np.zeros(3)}, "score must have shape"),
        ({"outline": np.zeros((1, 3, 2))}, "outline must have shape"),
    ],
)
def test_wrong_fields_are_refused(change: dict[str, object], message: str) -> None:
    fields: dict[str, object] = {"t": 0.0, "uv": np.zeros((1, 2)), "covariance": np.eye(2)[None]}
    with pytest.raises(InputError, match=message):
        Sightings(**(fields | change))  # type: ignore[arg-type]
