"""Banded normal equations and their elimination, against dense matrices built by loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.calibration.trajectory.normal import (
    Normal,
    eliminate,
    of_odometry,
    of_sightings,
)
from airground.calibration.trajectory.rows import OdometryRows, SightingRows
from airground.errors import UnobservableMotionError
from scenes import generators

if TYPE_CHECKING:
    from scenes import Array

WIDTHS = st.integers(2, 4)
COUNTS = st.integers(2, 9)
BORDER = 5


def dense_of_bands(bands: Array) -> Array:
    reach, size = bands.shape
    A = np.zeros((size, size))
    for i in range(size):
        for j in range(max(0, i - reach + 1), i + 1):
            A[i, j] = A[j, i] = bands[i - j, j]
    return A


def whole(normal: Normal) -> tuple[Array, Array]:
    """All of the matrix, and all of the right side."""
    A = dense_of_bands(normal.bands)
    return (
        np.block([[A, normal.border], [normal.border.T, normal.corner]]),
        np.concatenate([normal.right, normal.corner_right]),
    )


def sightings(rng: np.random.Generator, count: int, width: int) -> tuple[SightingRows, Array]:
    rows = SightingRows(
        rng.normal(size=(count, 2)),
        rng.normal(size=(count, 2, width)),
        rng.normal(size=(count, 2, BORDER)),
    )
    return rows, rng.uniform(0.1, 2.0, count)


def increments(rng: np.random.Generator, count: int, width: int) -> tuple[OdometryRows, Array]:
    first = np.flatnonzero(rng.random(count - 1) < 0.8)  # some links are broken
    size = len(first)
    rows = OdometryRows(
        first,
        rng.normal(size=(size, 2)),
        rng.normal(size=(size, 2, width)),
        rng.normal(size=(size, 2, 2)),
        rng.normal(size=(size, 2, BORDER)),
    )
    return rows, rng.uniform(0.1, 2.0, (size, 2))


@given(generators(), COUNTS, WIDTHS)
def test_sightings(rng: np.random.Generator, count: int, width: int) -> None:
    rows, weight = sightings(rng, count, width)
    size = count * width + BORDER
    H, right, cost = np.zeros((size, size)), np.zeros(size), 0.0
    for k in range(count):
        for axis in range(2):
            row = np.zeros(size)
            row[width * k : width * (k + 1)] = rows.local[k, axis]
            row[count * width :] = rows.border[k, axis]
            H += weight[k] * np.outer(row, row)
            right += weight[k] * row * rows.residual[k, axis]
            cost += weight[k] * rows.residual[k, axis] ** 2
    found = of_sightings(rows, weight)
    assert_allclose(whole(found)[0], H, atol=1e-12 * size)
    assert_allclose(whole(found)[1], right, atol=1e-12 * size)
    assert found.cost == pytest.approx(cost)


@given(generators(), COUNTS, WIDTHS)
def test_odometry(rng: np.random.Generator, count: int, width: int) -> None:
    rows, weight = increments(rng, count, width)
    size = count * width + BORDER
    H, right, cost = np.zeros((size, size)), np.zeros(size), 0.0
    for k, first in enumerate(rows.first):
        for axis in range(2):
            row = np.zeros(size)
            row[width * first : width * (first + 1)] = rows.start[k, axis]
            row[width * (first + 1) : width * (first + 1) + 2] = rows.end[k, axis]
            row[count * width :] = rows.border[k, axis]
            H += weight[k, axis] * np.outer(row, row)
            right -= weight[k, axis] * row * rows.residual[k, axis]  # downhill
            cost += weight[k, axis] * rows.residual[k, axis] ** 2
    found = of_odometry(rows, weight, count)
    assert_allclose(whole(found)[0], H, atol=1e-12 * size)
    assert_allclose(whole(found)[1], right, atol=1e-12 * size)
    assert found.cost == pytest.approx(cost)


def some_chain(rng: np.random.Generator, count: int, width: int) -> Normal:
    """Enough rows for a definite matrix."""
    total = of_odometry(*increments(rng, count, width), count)
    for _ in range(8):
        total = total + of_sightings(*sightings(rng, count, width))
    return total


@given(generators(), COUNTS, WIDTHS)
def test_elimination(rng: np.random.Generator, count: int, width: int) -> None:
    normal = some_chain(rng, count, width)
    H, right = whole(normal)
    n = count * width
    A, B, C = H[:n, :n], H[:n, n:], H[n:, n:]
    found = eliminate(normal)
    schur = C - B.T @ np.linalg.solve(A, B)
    assert_allclose(found.schur, schur, atol=1e-8 * np.abs(H).max())
    reduced = right[n:] - B.T @ np.linalg.solve(A, right[:n])
    assert_allclose(found.right, reduced, atol=1e-8 * np.abs(right).max())
    assert found.log_det == pytest.approx(np.linalg.slogdet(A)[1], abs=1e-6)
    squared = float(right[:n] @ np.linalg.solve(A, right[:n]))
    assert float(found.local @ found.local) == pytest.approx(squared, rel=1e-6)
    # The whole solution, and that for any change of the globals.
    solution = np.linalg.solve(H, right)
    change = np.asarray(np.linalg.solve(found.schur, found.right), dtype=np.float64)
    atol = 1e-6 * max(1.0, float(np.abs(solution).max()))
    assert_allclose(change, solution[n:], atol=atol)
    assert_allclose(found.back(change), solution[:n], atol=atol)
    other = rng.normal(size=BORDER)
    wanted = np.linalg.solve(A, right[:n] - B @ other)
    assert_allclose(found.back(other), wanted, atol=1e-6 * max(1.0, float(np.abs(wanted).max())))


def test_sums_and_weights_are_those_of_the_matrices(rng: np.random.Generator) -> None:
    a, b = some_chain(rng, 5, 3), some_chain(rng, 5, 3)
    both = a + b.scaled(2.5)
    for found, one, other in zip(whole(both), whole(a), whole(b), strict=True):
        assert_allclose(found, one + 2.5 * other, rtol=1e-12)
    assert both.cost == pytest.approx(a.cost + 2.5 * b.cost)


def test_the_elimination_leaves_its_input_alone(rng: np.random.Generator) -> None:
    normal = some_chain(rng, 5, 3)
    before = whole(normal)
    eliminate(normal)
    for old, new in zip(before, whole(normal), strict=True):
        assert (old == new).all()


def test_a_position_that_nothing_ties_down_is_let_be(rng: np.random.Generator) -> None:
    rows, weight = sightings(rng, 4, 2)
    weight[2] = 0.0
    found = eliminate(of_sightings(rows, weight))
    assert np.isfinite(found.back(np.zeros(BORDER))).all()


def test_what_is_not_positive_or_not_finite_is_refused(rng: np.random.Generator) -> None:
    normal = some_chain(rng, 4, 2)
    for value in (-1.0, np.nan):
        bands = normal.bands.copy()
        bands[0, 3] = value
        bad = Normal(
            bands, normal.border, normal.right, normal.corner, normal.corner_right, normal.cost
        )
        with pytest.raises(UnobservableMotionError, match="does not determine"):
            eliminate(bad)
