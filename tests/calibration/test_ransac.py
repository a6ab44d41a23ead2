"""The loop, on a problem that is none of airground's: a line through points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from airground.calibration.ransac import IntArray, Options, ransac

Array = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@dataclass
class Points:
    """Points (x, y); models are y = a x + b."""

    xy: Array
    tolerance: float = 0.1

    def costs(self, models: Array) -> Array:
        residual = self.xy[:, 1] - models[:, :1] * self.xy[:, 0] - models[:, 1:]
        squares = (residual / self.tolerance) ** 2
        return np.asarray(np.fmin(squares, 1.0).mean(axis=1))

    def refine(self, models: Array) -> Array:
        fits = []
        for a, b in models:
            near = np.abs(self.xy[:, 1] - a * self.xy[:, 0] - b) < self.tolerance
            fits.append(
                np.polyfit(self.xy[near, 0], self.xy[near, 1], 1) if near.sum() > 2 else (a, b)
            )
        return np.array(fits)


@dataclass
class Pairs:
    xy: Array
    size: int = 2
    asked: int = 0
    empty: bool = False

    def hypotheses(self, count: int, rng: np.random.Generator) -> Array:
        self.asked += 1
        if self.empty:
            return np.empty((0, 2))
        p, q = self.xy[rng.integers(len(self.xy), size=(2, count))]
        with np.errstate(all="ignore"):
            a = (q[:, 1] - p[:, 1]) / (q[:, 0] - p[:, 0])  # NaN where both are one point
            return np.column_stack([a, p[:, 1] - a * p[:, 0]])


@dataclass
class Lines:
    xy: Array
    sources: tuple[Pairs, ...]

    def __len__(self) -> int:
        return len(self.xy)

    def on(self, rows: IntArray | None) -> Points:
        return Points(self.xy if rows is None else self.xy[rows])


def problem(rng: np.random.Generator, count: int, wrong: float, *, empty: bool = False) -> Lines:
    x = rng.uniform(-1, 1, count)
    y = 2 * x + 0.5 + rng.normal(0, 0.02, count)
    bad = rng.permutation(count) < wrong * count
    y[bad] = rng.uniform(-3, 3, int(bad.sum()))
    xy = np.column_stack([x, y])
    return Lines(xy, (Pairs(xy, empty=empty),))


@pytest.mark.parametrize("count", [20, 300, 2000])
@pytest.mark.parametrize("wrong", [0.0, 0.3, 0.6])
def test_finds_the_line(count: int, wrong: float, rng: np.random.Generator) -> None:
    lines = problem(rng, count, wrong)
    with np.errstate(all="ignore"):
        found = ransac(lines, rng, Options())
    assert np.abs(found.models[0] - (2, 0.5)).max() < 0.1
    assert (np.diff(found.costs) >= 0).all()
    assert found.judges == min(count, Options().many)
    assert found.tried == Options().batch * lines.sources[0].asked


def test_more_wrong_points_take_more_batches(rng: np.random.Generator) -> None:
    asked = []
    for wrong in (0.0, 0.6, 0.85):
        lines = problem(rng, 1000, wrong)
        with np.errstate(all="ignore"):
            ransac(lines, rng, Options())
        asked.append(lines.sources[0].asked)
    assert asked[0] == 1
    assert asked[0] <= asked[1] < asked[2]


def test_no_hypothesis_at_all_ends_at_once(rng: np.random.Generator) -> None:
    lines = problem(rng, 100, 0.0, empty=True)
    found = ransac(lines, rng, Options())
    assert len(found.models) == found.tried == 0
    assert lines.sources[0].asked == 1


def test_noise_alone_ends_after_the_most_sets(rng: np.random.Generator) -> None:
    lines = problem(rng, 1000, 1.0)
    with np.errstate(all="ignore"):
        ransac(lines, rng, Options(max_sets=640))
    assert lines.sources[0].asked == 10
