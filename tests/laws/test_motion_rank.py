"""What motion determines: the table of ranks, and the error that says what to drive next."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground import MotionSamples, estimate_linear
from airground.calibration.linear import linear_system
from airground.errors import UnobservableMotionError
from scenes import Array, Scene, circle, figure_eight, legs, polygon, random_scene, scene


def lawn_mower() -> tuple[Array, Array]:
    rows = [(x, y) for y in range(5) for x in ((0, 4) if y % 2 == 0 else (4, 0))]
    return legs((np.array(rows, dtype=np.float64) - 2) / 2)


def spokes(headings_deg: list[float]) -> tuple[Array, Array]:
    """One line along each heading, end to end."""
    return legs(polygon(headings_deg))


# Rank of eq. 16, distinct headings modulo 180 degrees
DRIVES: dict[str, tuple[tuple[Array, Array], int, list[float]]] = {
    "one line": (spokes([20]), 1, [20]),
    "one line there and back": (spokes([20, 200]), 1, [20]),
    "one line due east": (spokes([0]), 1, [0]),
    "lawn-mower": (lawn_mower(), 4, [0, 90]),
    "rectangle": (spokes([30, 120, 210, 300]), 4, [30, 120]),
    "two headings, many lines": (spokes([30, 75] * 6), 4, [30, 75]),
    "triangle": (spokes([20, 140, 260]), 3, [20, 80, 140]),
    "four headings, one line each": (spokes([10, 50, 100, 150]), 4, [10, 50, 100, 150]),
}

ENOUGH = {
    "the paper's 8 segments": spokes([30.0 * k for k in range(8)]),
    "quarter circle": circle(20, 0.2, np.pi / 2),
    "figure eight": figure_eight(20),
    "full circle": circle(20),
}


def samples_of(view: Scene, drive: tuple[Array, Array]) -> MotionSamples:
    centre, scale = view.place(drive[0])
    xy, xy_dot = centre + scale * drive[0], scale * drive[1]
    return MotionSamples(view.project(xy), view.push(xy, xy_dot), xy_dot)


def views(rng: np.random.Generator) -> list[Scene]:
    return [scene(), scene(handedness="left", tilt_deg=10)] + [random_scene(rng) for _ in range(4)]


@pytest.mark.parametrize("name", DRIVES)
def test_too_few_lines_is_an_error_that_says_so(name: str, rng: np.random.Generator) -> None:
    drive, rank, headings = DRIVES[name]
    for view in views(rng):
        with pytest.raises(UnobservableMotionError) as caught:
            estimate_linear(samples_of(view, drive))
        error = caught.value
        assert error.rank == rank
        assert len(error.headings_deg) == len(headings)
        away = np.abs((np.array(error.headings_deg) - headings + 90) % 180 - 90)
        assert away.max() < 1
        assert error.advice
        assert error.advice in str(error)
        assert f"{rank} of the 5" in str(error)
        assert "\n" not in str(error)
        assert error.exit_code == 3


@pytest.mark.parametrize("name", DRIVES)
def test_following_the_advice_helps(name: str, rng: np.random.Generator) -> None:
    drive, rank, _ = DRIVES[name]
    view = scene()
    with pytest.raises(UnobservableMotionError) as caught:
        estimate_linear(samples_of(view, drive))
    wanted = re.findall(r"\d+(?=(?: and \d+)* degrees)", caught.value.advice)
    if not wanted:
        assert "other parts of the image" in caught.value.advice
        return
    lines = [np.array([[-0.9, -0.8], [0.7, 0.9]]), np.array([[0.5, -0.9], [-0.6, 0.4]])]
    parts = [drive]
    for heading, middles in zip(wanted, lines, strict=False):
        a = np.radians(float(heading))
        step = 0.1 * np.array([np.cos(a), np.sin(a)])
        parts += [legs([middle / 2 - step, middle / 2 + step], 4) for middle in middles]
    more = np.vstack([p for p, _ in parts]), np.vstack([d for _, d in parts])
    A, _ = linear_system(samples_of(view, more))
    singular = np.linalg.svd(A, compute_uv=False)
    assert int(np.sum(singular > 1e-7 * singular[0])) > rank


@pytest.mark.parametrize("name", ENOUGH)
def test_enough_headings_in_enough_places(name: str, rng: np.random.Generator) -> None:
    for view in views(rng):
        samples = samples_of(view, ENOUGH[name])
        A, _ = linear_system(samples)
        singular = np.linalg.svd(A, compute_uv=False)
        assert singular[4] > 1e-6 * singular[0]
        assert singular[5] < 1e-12 * singular[0]
        found = estimate_linear(samples)
        assert_allclose(
            found.image_velocity(samples.uv, samples.xy_dot),
            samples.uv_dot,
            rtol=0,
            atol=1e-6 * np.abs(samples.uv_dot).max(),
        )


@pytest.mark.parametrize("count", range(6))
def test_a_few_samples_have_at_most_their_number_as_rank(count: int) -> None:
    samples = samples_of(scene(), circle(6)).take(slice(count))
    if count == 5:
        estimate_linear(samples)
        return
    with pytest.raises(UnobservableMotionError) as caught:
        estimate_linear(samples)
    assert caught.value.rank == count


def test_no_motion_at_all_says_drive() -> None:
    still = np.zeros((6, 2))
    with pytest.raises(UnobservableMotionError, match="no motion") as caught:
        estimate_linear(MotionSamples(np.arange(12.0).reshape(6, 2), still, still))
    assert caught.value.rank == 0
    assert caught.value.headings_deg == ()


def test_a_robot_that_stands_in_the_image_while_it_reports_motion() -> None:
    drive = samples_of(scene(), circle(8))
    with pytest.raises(UnobservableMotionError) as caught:
        estimate_linear(MotionSamples(drive.uv, np.zeros((8, 2)), drive.xy_dot))
    assert caught.value.rank == 0
