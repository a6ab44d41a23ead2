"""g from four samples, without noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given

from airground import MotionSamples
from airground.calibration.minimal_four import FourSamples
from airground.calibration.motion_problem import MotionProblem
from scenes import Scene, generators, random_scene, scenes

if TYPE_CHECKING:
    from collections.abc import Sequence

HEADINGS_DEG = {
    "four": [20, 110, 60, 150],
    "two and two": [20, 110, 20, 110],
    "two, there and back": [20, 110, 200, 290],
    "due east and north": [0, 90, 0, 90],
    "two, one and one": [20, 110, 20, 70],
}


def drive(view: Scene, rng: np.random.Generator, headings_deg: Sequence[float]) -> MotionSamples:
    """One sample on each heading, all over the image."""
    a = np.radians(headings_deg)
    xy_dot = view.height * rng.uniform(0.1, 0.5, (4, 1)) * np.column_stack([np.cos(a), np.sin(a)])
    xy = view.ground(rng, (4,))
    return MotionSamples(view.project(xy), view.push(xy, xy_dot), xy_dot)


def error(view: Scene, samples: MotionSamples) -> float:
    """Of the best hypothesis, relative."""
    problem = MotionProblem(samples, np.array(1.0))
    with np.errstate(all="ignore"):
        models = FourSamples().solve(problem.columns[:, :, None])
    assert models.shape == (3, 6)
    away = [np.linalg.norm(problem.g(m) - view.g) for m in models if np.isfinite(m).all()]
    return float(min(away, default=np.inf) / np.linalg.norm(view.g))


@pytest.mark.parametrize("headings", HEADINGS_DEG)
def test_the_truth_is_among_the_solutions(headings: str, rng: np.random.Generator) -> None:
    errors = []
    for _ in range(100):
        view = random_scene(rng)
        errors.append(error(view, drive(view, rng, HEADINGS_DEG[headings])))
    # A few of the sets are close to degenerate.
    assert np.median(errors) < 1e-11
    assert np.mean(np.array(errors) < 1e-6) > 0.95


@given(view=scenes(max_tilt_deg=60), rng=generators())
def test_all_cameras(view: Scene, rng: np.random.Generator) -> None:
    errors = [error(view, drive(view, rng, [10, 100, 50, 150])) for _ in range(5)]
    assert np.median(errors) < 1e-6


def test_three_on_one_heading_are_not_enough(rng: np.random.Generator) -> None:
    errors = []
    for _ in range(20):
        view = random_scene(rng)
        errors.append(error(view, drive(view, rng, [20, 110, 20, 200])))
    assert min(errors) > 1e-6


def test_a_batch_is_its_sets_one_by_one(rng: np.random.Generator) -> None:
    columns = rng.normal(size=(6, 4, 5))
    with np.errstate(all="ignore"):
        together = FourSamples().solve(columns).reshape(3, 5, 6)
        single = [FourSamples().solve(columns[:, :, [k]]) for k in range(5)]
    np.testing.assert_allclose(together, np.stack(single, axis=1), rtol=1e-9)
