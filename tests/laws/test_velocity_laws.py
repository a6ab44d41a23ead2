"""Eq. 15 and all that is said of it, against the derivative of the whole projection."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from numpy.testing import assert_allclose

from airground import LimitedHomography
from airground.geometry.velocity import image_velocity_gradient
from scenes import Array, Scene, generators, scenes

# Rounding: the worst of 60,000 points in 3,000 random scenes was 3e-14. Near the horizon n.c cancels, which the inverse
# squares; 1e-11 leaves room for the corners that hypothesis looks for, and still sees every error of principle.
RTOL = 1e-11


def model_of(scene: Scene) -> LimitedHomography:
    return LimitedHomography.from_homography(scene.G)


def by_size(actual: Array, desired: Array) -> None:
    """Compare vectors of the last axis, each with its own length as the unit."""
    unit = np.linalg.norm(desired, axis=-1, keepdims=True)
    assert_allclose(actual / unit, desired / unit, rtol=0, atol=RTOL)


@given(scenes(square=False), generators())
def test_image_velocity_is_the_derivative_of_the_projection(
    scene: Scene, rng: np.random.Generator
) -> None:
    xy, xy_dot = scene.ground(rng, (20,)), scene.velocities(rng, (20,))
    by_size(
        model_of(scene).image_velocity(scene.project(xy), xy_dot), scene.push(xy, xy_dot)
    )  # complex step: no truncation, only rounding


@given(scenes(square=False), generators())
def test_image_velocity_is_the_limit_of_central_differences(
    scene: Scene, rng: np.random.Generator
) -> None:
    xy, xy_dot = scene.ground(rng), scene.velocities(rng)
    exact = model_of(scene).image_velocity(scene.project(xy), xy_dot)
    # Steps as shares of the depth: truncation falls with the square of the step, rounding grows with its inverse.
    depth = float(scene.depth(xy))
    errors = []
    for share in (1e-2, 1e-3, 1e-4):
        dt = share * depth / float(np.linalg.norm(xy_dot))
        ahead, behind = scene.project(xy + dt * xy_dot), scene.project(xy - dt * xy_dot)
        errors.append(
            float(np.linalg.norm((ahead - behind) / (2 * dt) - exact) / np.linalg.norm(exact))
        )
    assert errors[0] < 2e-4  # (share of the depth)^2, as d(1/z) = (1 + share^2) / z
    assert errors[1] < 2e-6
    assert errors[2] < 1e-6  # here it is rounding: 1e-16 * 4000 px / (1e-4 of the focal length)


@given(scenes(square=False), generators())
def test_jacobian_is_the_derivative_along_x_and_along_y(
    scene: Scene, rng: np.random.Generator
) -> None:
    xy = scene.ground(rng, (6,))
    columns = [scene.push(xy, np.broadcast_to(axis, xy.shape)) for axis in np.eye(2)]
    J, want = model_of(scene).jacobian(scene.project(xy)), np.stack(columns, axis=-1)
    by_size(J.reshape(-1, 4), want.reshape(-1, 4))


@given(scenes(square=False), generators())
def test_ground_velocity_undoes_image_velocity(scene: Scene, rng: np.random.Generator) -> None:
    model, uv, xy_dot = model_of(scene), scene.pixels(rng, (20,)), scene.velocities(rng, (20,))
    by_size(model.ground_velocity(uv, model.image_velocity(uv, xy_dot)), xy_dot)


@given(scenes(square=False), generators())
def test_ground_velocity_of_a_projected_motion_is_that_motion(
    scene: Scene, rng: np.random.Generator
) -> None:
    xy, xy_dot = scene.ground(rng, (20,)), scene.velocities(rng, (20,))
    by_size(model_of(scene).ground_velocity(scene.project(xy), scene.push(xy, xy_dot)), xy_dot)


@given(scenes(square=False), generators())
def test_determinant_of_the_jacobian_is_the_cube_of_the_nearness(
    scene: Scene, rng: np.random.Generator
) -> None:
    model, uv = model_of(scene), scene.pixels(rng, (20,))
    assert_allclose(np.linalg.det(model.jacobian(uv)), model.nearness(uv) ** 3, rtol=1e-8)


@given(scenes(), generators())
def test_pixels_per_metre_bound_the_speed_over_all_headings(
    scene: Scene, rng: np.random.Generator
) -> None:
    uv = scene.pixels(rng)
    heading = np.linspace(0, np.pi, 721)
    moves = np.column_stack([np.cos(heading), np.sin(heading)])
    speed = np.linalg.norm(scene.push(scene.unproject(uv), moves), axis=-1)
    low, high = model_of(scene).pixels_per_metre(uv)
    rounding = RTOL * high
    assert low - rounding <= speed.min()
    assert speed.max() <= high + rounding
    # No heading is further than half a step, an eighth of a degree, from the slowest and from the fastest.
    sine = np.sin(np.radians(0.125))
    assert speed.min() <= np.hypot(low, high * sine) + rounding
    assert speed.max() >= high * np.sqrt(1 - sine**2) - rounding


def eq16(g: Array, uv: Array, uv_dot: Array, xy_dot: Array) -> float:
    """(-v', u') [I | -(u, v)] (G1 G2) (x', y')."""
    (u, v), (ud, vd) = uv, uv_dot
    across = np.array([[-vd, ud]])
    return float((across @ np.array([[1, 0, -u], [0, 1, -v]]) @ g @ xy_dot)[0])


def eq20(g: Array, uv: Array, uv_dot: Array, xy_dot: Array) -> float:
    """((u, v, 1) x (u', v', 0)) . (G1 G2) (x', y')."""
    (u, v), (ud, vd) = uv, uv_dot
    line = np.cross([u, v, 1.0], [ud, vd, 0.0])
    return float(line @ (g @ xy_dot))


@given(scenes(square=False), generators())
def test_eqs_16_and_20_are_the_same_number_for_any_g(
    scene: Scene, rng: np.random.Generator
) -> None:
    g = model_of(scene).g * (1 + 0.3 * rng.normal(size=(3, 2)))  # not the truth: neither is zero
    uv, uv_dot = scene.pixels(rng), rng.normal(size=2) * 100
    xy_dot = scene.velocities(rng)
    first, second = eq16(g, uv, uv_dot, xy_dot), eq20(g, uv, uv_dot, xy_dot)
    unit = np.linalg.norm(uv_dot) * np.linalg.norm(g @ xy_dot)
    assume(abs(first) > 1e-6 * unit)  # else there is nothing to compare
    assert_allclose(first, second, rtol=1e-7)


@given(scenes(square=False), generators())
def test_eqs_16_and_20_vanish_at_the_truth_and_only_there(
    scene: Scene, rng: np.random.Generator
) -> None:
    model, xy, xy_dot = model_of(scene), scene.ground(rng), scene.velocities(rng)
    uv, uv_dot = scene.project(xy), scene.push(xy, xy_dot)
    across = np.array([-uv_dot[1], uv_dot[0]])
    wrong = model.g + np.vstack([np.outer(across, xy_dot), np.zeros((1, 2))]) * (
        0.1 * np.linalg.norm(model.g[:2]) / np.linalg.norm(uv_dot) / np.linalg.norm(xy_dot)
    )
    for equation in (eq16, eq20):
        away = abs(equation(wrong, uv, uv_dot, xy_dot))
        assert abs(equation(model.g, uv, uv_dot, xy_dot)) < RTOL * away


def eq15(g: Array, uv: Array, xy_dot: Array) -> Array:
    """Eq. 15 in plain scalars; g may be complex."""
    ((a, b), (c, d), (e, f)), (u, v), (x, y) = g, uv, xy_dot
    near = (c * f - e * d) * u + (e * b - a * f) * v + (a * d - c * b)
    hx, hy, hz = a * x + b * y, c * x + d * y, e * x + f * y
    return np.array([near * (hx - u * hz), near * (hy - v * hz)])


@given(scenes(square=False), generators())
def test_eq_15_in_plain_scalars(scene: Scene, rng: np.random.Generator) -> None:
    model, uv, xy_dot = model_of(scene), scene.pixels(rng), scene.velocities(rng)
    by_size(model.image_velocity(uv, xy_dot), eq15(model.g, uv, xy_dot))


@given(scenes(square=False), generators())
def test_gradient_by_g_is_the_derivative_of_eq_15(scene: Scene, rng: np.random.Generator) -> None:
    g, uv, xy_dot = model_of(scene).g, scene.pixels(rng), scene.velocities(rng)
    D = image_velocity_gradient(g, uv, xy_dot)
    for k in range(6):
        step = np.zeros((3, 2), dtype=complex)
        step[divmod(k, 2)] = 1e-30j
        want = eq15(g + step, uv, xy_dot).imag / 1e-30
        by_size(D[:, k], want)


@given(scenes(), generators())
def test_gradient_by_g_is_the_limit_of_central_differences(
    scene: Scene, rng: np.random.Generator
) -> None:
    model, uv, xy_dot = model_of(scene), scene.pixels(rng), scene.velocities(rng)
    D = image_velocity_gradient(model.g, uv, xy_dot)
    rows = np.linalg.norm(model.g, axis=1).max() * np.array([1.0, 1.0, 1e-3])  # [px], [px], [1]
    for k in range(6):
        step = np.zeros((3, 2))
        i, j = divmod(k, 2)
        step[i, j] = 1e-4 * rows[i]
        ahead = LimitedHomography(model.g + step).image_velocity(uv, xy_dot)
        behind = LimitedHomography(model.g - step).image_velocity(uv, xy_dot)
        numeric = (ahead - behind) / (2 * step[i, j])
        # Eq. 15 is cubic in g, but quadratic in one entry: central differences are exact but for rounding.
        scale = np.linalg.norm(model.image_velocity(uv, xy_dot)) / rows[i]
        assert_allclose(D[:, k], numeric, rtol=1e-7, atol=1e-8 * scale)


@given(scenes(), generators())
def test_euler_a_cubic_form_has_three_times_its_value_as_radial_derivative(
    scene: Scene, rng: np.random.Generator
) -> None:
    model, uv, xy_dot = model_of(scene), scene.pixels(rng, (5,)), scene.velocities(rng, (5,))
    D = image_velocity_gradient(model.g, uv, xy_dot)
    by_size(D @ model.g.ravel(), 3 * model.image_velocity(uv, xy_dot))


@pytest.mark.parametrize("scale", [2.0, -1.0, 1e-3])
def test_the_scale_of_g_is_the_metric(scale: float, rng: np.random.Generator) -> None:
    g = np.array([[60.0, 5.0], [-4.0, 50.0], [0.001, 0.02]])
    uv, xy_dot = rng.uniform(0, 500, (7, 2)), rng.normal(size=(7, 2))
    scaled = LimitedHomography(scale * g).image_velocity(uv, xy_dot)
    assert_allclose(scaled, scale**3 * LimitedHomography(g).image_velocity(uv, xy_dot), rtol=1e-12)
