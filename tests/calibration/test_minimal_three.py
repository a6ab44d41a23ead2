"""g from three samples, without noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given

from airground import MotionSamples
from airground.calibration.minimal_three import ThreeSamples
from airground.calibration.motion_problem import MotionProblem
from scenes import Array, Scene, generators, random_scene, scenes

if TYPE_CHECKING:
    from collections.abc import Sequence

HEADINGS_DEG = {
    "three": [20, 75, 140],
    "two": [20, 110, 20],
    "two, swapped": [110, 20, 20],
    "opposite": [20, 110, 200],
}


def drive(view: Scene, rng: np.random.Generator, headings_deg: Sequence[float]) -> MotionSamples:
    """One sample on each heading, all over the image."""
    a = np.radians(headings_deg) + rng.uniform(-3, 3)
    xy_dot = view.height * rng.uniform(0.1, 0.5, (3, 1)) * np.column_stack([np.cos(a), np.sin(a)])
    xy = view.ground(rng, (3,))
    return MotionSamples(view.project(xy), view.push(xy, xy_dot), xy_dot)


def solutions(samples: MotionSamples) -> tuple[Array, MotionProblem]:
    """Those of the hypotheses that solve eq. 15."""
    problem = MotionProblem(samples, np.array(1.0))
    with np.errstate(all="ignore"):
        models = ThreeSamples().solve(problem.columns[:, :, None])
        speeds = np.abs(problem.columns[2:4]).max()
        squares = problem.on(None).squares(models)[0] / problem.weight**2
    return models[np.sqrt(squares.max(axis=1)) < 1e-5 * speeds], problem


@pytest.mark.parametrize("headings", HEADINGS_DEG)
def test_the_truth_is_among_the_solutions(headings: str, rng: np.random.Generator) -> None:
    errors, counts = [], []
    for _ in range(60):
        view = random_scene(rng)
        models, problem = solutions(drive(view, rng, HEADINGS_DEG[headings]))
        errors.append(
            min((np.linalg.norm(problem.g(m) - view.g) for m in models), default=np.inf)
            / np.linalg.norm(view.g)
        )
        counts.append(len(models))
    # A few of the sets are close to degenerate.
    assert np.median(errors) < 1e-11
    assert np.mean(np.array(errors) < 1e-6) > 0.9
    assert max(counts) <= 6
    if headings != "three":
        assert set(counts) <= {0, 1}  # with two headings it is the only solution
        assert np.mean(counts) > 0.9


@given(view=scenes(max_tilt_deg=60), rng=generators())
def test_each_solution_gives_the_image_velocities(view: Scene, rng: np.random.Generator) -> None:
    samples = drive(view, rng, [0, 50, 110])
    models, problem = solutions(samples)
    for model in models:
        g = problem.g(model)
        n = np.cross(g[:, 0], g[:, 1])
        c = np.column_stack([samples.uv, np.ones(3)])
        way = samples.xy_dot @ g.T
        got = (c @ n)[:, None] * (way[:, :2] - samples.uv * way[:, 2:])  # eq. 15
        assert np.abs(got - samples.uv_dot).max() < 1e-4 * np.abs(samples.uv_dot).max()


def test_a_batch_is_its_sets_one_by_one(rng: np.random.Generator) -> None:
    columns = rng.normal(size=(6, 3, 5))
    with np.errstate(all="ignore"):
        together = ThreeSamples().solve(columns)
        single = np.concatenate([ThreeSamples().solve(columns[:, :, [k]]) for k in range(5)])
    assert len(together) == len(single) > 0
    # Where two roots are close, or are no solutions, rounding moves them.
    away = np.array([np.abs(together - model).max(axis=1).min() for model in single])
    assert np.mean(away < 1e-6 * np.abs(single).max(axis=1)) > 0.5


def test_one_heading_gives_nothing_finite_or_nothing_right(rng: np.random.Generator) -> None:
    view = random_scene(rng)
    models, _ = solutions(drive(view, rng, [20, 20, 200]))
    assert len(models) == 0
