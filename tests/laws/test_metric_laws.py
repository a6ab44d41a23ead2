"""Errors of an estimate, by hand and by brute force."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground import LimitedHomography
from airground.geometry import align_rotation, n_error, velocity_map_error
from scenes import Array, Scene, generators, scenes


def estimate_near(g: Array, rng: np.random.Generator, size: float = 0.05) -> Array:
    return np.asarray(g * (1 + size * rng.normal(size=g.shape)))


@given(scenes(), generators())
def test_n_is_the_relative_frobenius_distance(scene: Scene, rng: np.random.Generator) -> None:
    g = scene.g
    g_hat = estimate_near(g, rng)
    squares = sum((g[i, j] - g_hat[i, j]) ** 2 for i in range(3) for j in range(2))
    size = sum(g[i, j] ** 2 for i in range(3) for j in range(2))
    want = math.sqrt(squares / size)
    assert_allclose(n_error(g, g_hat), want, rtol=1e-12)
    models = LimitedHomography(g), LimitedHomography(g_hat)
    assert_allclose(n_error(*models), want, rtol=1e-12)
    assert n_error(g, g) == 0


def test_n_is_relative_to_the_truth() -> None:
    g = np.array([[3.0, 0.0], [0.0, 4.0], [0.0, 0.0]])
    assert n_error(g, 2 * g) == 1.0
    assert n_error(2 * g, g) == 0.5
    assert n_error(g, -g) == 2.0  # a wrong sign is the worst error that there is


def test_n_of_table_1() -> None:
    """The paper's own pair, by hand: sqrt(0.70315 / 93.838)."""
    ideal = [[-8.8347, -2.0486], [-0.2190, 3.3972], [-0.00065, -0.0048]]
    estimate = [[-9.4843, -2.5053], [-0.4463, 3.5419], [-0.0022, -0.0052]]
    assert_allclose(n_error(ideal, estimate), 0.08656, atol=1e-5)


def turned(g: Array, angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(g @ np.array([[c, -s], [s, c]]))


@given(scenes(), generators(), st.floats(-3.1, 3.1))
def test_align_rotation_is_the_best_of_all_angles(
    scene: Scene, rng: np.random.Generator, angle: float
) -> None:
    g = scene.g
    g_hat = turned(estimate_near(g, rng), angle)
    aligned, found = align_rotation(g, g_hat)
    assert_allclose(aligned, turned(g_hat, found), rtol=0, atol=1e-12 * np.abs(g).max())
    best = n_error(g, aligned)
    angles = np.linspace(-math.pi, math.pi, 721)
    brute = np.array([np.linalg.norm(g - turned(g_hat, a)) for a in angles]) / np.linalg.norm(g)
    assert best <= brute.min() + 1e-12
    # The distance squared is a sine of the angle: its minimum is within a step of the best angle.
    nearest = angles[np.argmin(brute)]
    assert abs(math.remainder(found - nearest, 2 * math.pi)) <= math.radians(0.5)


@given(scenes(), st.floats(-3.1, 3.1))
def test_align_rotation_takes_a_turn_away(scene: Scene, angle: float) -> None:
    model = LimitedHomography(scene.g)
    aligned, found = align_rotation(model, model.rotated(angle))
    assert_allclose(aligned, model.g, rtol=0, atol=1e-10 * np.abs(model.g).max())
    assert_allclose(math.remainder(found + angle, 2 * math.pi), 0, atol=1e-9)


@given(scenes())
def test_align_rotation_does_not_mirror(scene: Scene) -> None:
    mirrored = scene.g * np.array([1.0, -1.0])
    aligned, _ = align_rotation(scene.g, mirrored)
    # What is left is twice the lesser singular value: a rotation can bring only the greater one into line.
    greater, lesser = np.linalg.svd(scene.g, compute_uv=False)
    assert_allclose(n_error(scene.g, aligned), 2 * lesser / math.hypot(greater, lesser), rtol=1e-6)


@given(scenes(), generators())
def test_velocity_map_error_is_the_mean_over_points_and_headings(
    scene: Scene, rng: np.random.Generator
) -> None:
    g = scene.g
    g_hat = LimitedHomography.from_homography(scene.G * (1 + 0.02 * rng.normal(size=(3, 3)))).g
    uv = scene.pixels(rng, (4,))
    squares = []
    estimate = LimitedHomography(g_hat)
    for point in uv:
        for heading in np.arange(12) * 2 * math.pi / 12:  # exact for a quadratic form
            move = np.array([math.cos(heading), math.sin(heading)])
            seen = scene.push(scene.unproject(point), move)
            back = estimate.ground_velocity(point, seen)
            squares.append(float(np.sum((back - move) ** 2)))
    want = math.sqrt(sum(squares) / len(squares))
    assert_allclose(velocity_map_error(g, g_hat, uv), want, rtol=1e-6)
    assert_allclose(velocity_map_error(g, g_hat, uv.reshape(2, 2, 2)), want, rtol=1e-6)


@given(scenes(), generators(), st.floats(0.5, 2.0))
def test_velocity_map_error_of_a_wrong_speed_scale(
    scene: Scene, rng: np.random.Generator, scale: float
) -> None:
    # Image velocity goes with g cubed: an estimate whose g is cbrt(scale) too large says 1 / scale of the speed.
    g_hat = np.cbrt(scale) * scene.g
    error = velocity_map_error(scene.g, g_hat, scene.pixels(rng, (5,)))
    assert_allclose(error, abs(1 / scale - 1), rtol=1e-7, atol=1e-9)


@given(scenes(), generators(), st.floats(0.0, 3.1))
def test_velocity_map_error_of_a_turn(scene: Scene, rng: np.random.Generator, angle: float) -> None:
    error = velocity_map_error(scene.g, turned(scene.g, angle), scene.pixels(rng, (5,)))
    assert_allclose(error, 2 * math.sin(angle / 2), atol=1e-8)  # the chord


def test_velocity_map_error_is_infinite_where_the_estimate_sees_the_horizon() -> None:
    g = np.array([[1.0, 0.0], [0.0, 0.5], [0.0, 0.001]])
    n = np.cross(g[:, 0], g[:, 1])
    g_hat = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])  # its horizon is v = 0
    assert n[2] != 0
    assert velocity_map_error(g, g_hat, [[5.0, 0.0], [5.0, 3.0]]) == math.inf
