"""g from two headings, two samples on each, without noise."""

from __future__ import annotations

import numpy as np
import pytest

from airground import MotionSamples
from airground.calibration.motion_problem import MotionProblem
from airground.calibration.two_lines import TwoLines
from scenes import random_scene


@pytest.mark.parametrize("senses", [(1, 1, 1, 1), (1, 1, -1, 1), (1, -1, -1, -1)])
@pytest.mark.parametrize("turn_deg", [90, 50])
def test_one_turn_from_a_straight_line_into_another(
    senses: tuple[int, ...], turn_deg: float, rng: np.random.Generator
) -> None:
    # Eq. 16 has rank 2 here; all else comes from how the image speed changes along each line.
    errors = []
    for _ in range(60):
        view = random_scene(rng, tilt_deg=(15, 70))
        centre, scale = view.place(np.array([[-1, -1], [1, 1], [-1, 1], [1, -1]]))
        start = rng.uniform(0, 2 * np.pi)
        first, second = (
            np.array([np.cos(a), np.sin(a)]) for a in (start, start + np.radians(turn_deg))
        )
        xy = centre + scale * np.array([-0.9 * first, 0.5 * second, -0.3 * first, 0.9 * second])
        speed = scale * rng.uniform(0.2, 0.5, (4, 1)) * np.array(senses)[:, None]
        xy_dot = speed * np.array([first, second, first, second])
        problem = MotionProblem(
            MotionSamples(view.project(xy), view.push(xy, xy_dot), xy_dot), np.array(1.0)
        )
        with np.errstate(all="ignore"):
            (model,) = TwoLines().solve(problem.columns[:, :, None])
        errors.append(np.linalg.norm(problem.g(model) - view.g) / np.linalg.norm(view.g))
    assert np.median(errors) < 1e-10
    assert np.mean(np.array(errors) < 1e-5) > 0.9


def test_parallel_lanes(rng: np.random.Generator) -> None:
    errors = []
    for _ in range(60):
        view = random_scene(rng)
        centre, scale = view.place(np.array([[-1, -1], [1, 1], [-1, 1], [1, -1]]))
        xy = centre + scale * np.array([[0.3, -0.9], [-0.8, 0.2], [-0.2, 0.9], [0.9, -0.1]])
        xy_dot = scale * rng.uniform(0.2, 0.5, (4, 1)) * np.array([[1, 0], [0, 1], [-1, 0], [0, 1]])
        problem = MotionProblem(
            MotionSamples(view.project(xy), view.push(xy, xy_dot), xy_dot), np.array(1.0)
        )
        with np.errstate(all="ignore"):
            (model,) = TwoLines().solve(problem.columns[:, :, None])
        errors.append(np.linalg.norm(problem.g(model) - view.g) / np.linalg.norm(view.g))
    assert np.median(errors) < 1e-10
    assert np.mean(np.array(errors) < 1e-5) > 0.9
