"""The linear method: exact without noise, and indifferent to what cannot matter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground import LimitedHomography, MotionSamples, estimate_linear
from airground.calibration.linear import linear_system
from airground.geometry import n_error
from scenes import Array, Scene, circle, figure_eight, generators, scenes


def drive_in(scene: Scene, drive: tuple[Array, Array], speed: float = 1.0) -> MotionSamples:
    """Drive it where the camera sees all of it; exact samples."""
    centre, scale = scene.place(drive[0])
    xy, xy_dot = centre + scale * drive[0], speed * scale * drive[1]
    return MotionSamples(scene.project(xy), scene.push(xy, xy_dot), xy_dot)


def in_normal_pixels(g: Array, samples: MotionSamples) -> Array:
    """Rows of like size, so that an error of row 3 counts."""
    T = np.diag([1.0, 1.0, 1.0])
    T[:2, 2] = -samples.uv.mean(axis=0)
    T[:2] /= samples.uv.std()
    return np.asarray(T @ g)


def assert_same_model(got: LimitedHomography, want: Array, samples: MotionSamples) -> None:
    error = n_error(in_normal_pixels(want, samples), in_normal_pixels(got.g, samples))
    assert error < 1e-7  # rounding of 1e-12 px, over the least singular value


DRIVES = {"circle": circle(12, 0.1), "figure eight": figure_eight(16), "few": circle(5, 0.3)}


@pytest.mark.parametrize("name", DRIVES)
@given(scene=scenes(square=False))
def test_exact_samples_give_the_exact_g(name: str, scene: Scene) -> None:
    samples = drive_in(scene, DRIVES[name])
    assert_same_model(estimate_linear(samples), scene.g, samples)


@given(scenes(), generators())
def test_exact_samples_from_anywhere_at_any_speed(scene: Scene, rng: np.random.Generator) -> None:
    xy, xy_dot = scene.ground(rng, (25,)), scene.velocities(rng, (25,))
    samples = MotionSamples(scene.project(xy), scene.push(xy, xy_dot), xy_dot)
    assert_same_model(estimate_linear(samples), scene.g, samples)


@given(scenes())
def test_the_truth_is_the_null_vector_of_the_system(scene: Scene) -> None:
    samples = drive_in(scene, DRIVES["circle"])
    A, T = linear_system(samples)
    truth = (T @ scene.g).ravel()
    assert_allclose(A @ truth, 0, atol=1e-9 * float(np.linalg.norm(A) * np.linalg.norm(truth)))
    singular = np.linalg.svd(A, compute_uv=False)
    assert singular[4] > 1e-2 * singular[0]  # the reason of the normalisation


@given(scenes(), generators())
def test_the_order_of_samples_does_not_matter(scene: Scene, rng: np.random.Generator) -> None:
    samples = drive_in(scene, DRIVES["circle"])
    shuffled = samples.take(rng.permutation(len(samples)))
    assert_same_model(estimate_linear(shuffled), estimate_linear(samples).g, samples)


@given(scenes(), st.floats(1e-3, 1e3), st.booleans())
def test_the_unit_and_direction_of_time_do_not_matter(
    scene: Scene, unit: float, backwards: bool
) -> None:
    samples = drive_in(scene, DRIVES["circle"])
    unit = -unit if backwards else unit
    slower = MotionSamples(samples.uv, samples.uv_dot * unit, samples.xy_dot * unit)
    assert_same_model(estimate_linear(slower), estimate_linear(samples).g, samples)


@given(scenes(), st.floats(-5000, 5000), st.floats(-5000, 5000))
def test_moved_pixels_move_the_horizon(scene: Scene, right: float, down: float) -> None:
    samples = drive_in(scene, DRIVES["circle"])
    moved = MotionSamples(samples.uv + np.array([right, down]), samples.uv_dot, samples.xy_dot)
    shift = np.array([[1.0, 0.0, right], [0.0, 1.0, down], [0.0, 0.0, 1.0]])
    assert_same_model(estimate_linear(moved), shift @ estimate_linear(samples).g, moved)


@given(scenes(), st.floats(0.1, 10.0))
def test_smaller_pixels(scene: Scene, scale: float) -> None:
    samples = drive_in(scene, DRIVES["figure eight"])
    zoomed = MotionSamples(samples.uv * scale, samples.uv_dot * scale, samples.xy_dot)
    want = np.diag([scale, scale, 1.0]) @ scene.g / np.cbrt(scale**2)  # unit determinant again
    assert_same_model(estimate_linear(zoomed), want, zoomed)


@given(scenes(), st.floats(0.01, 100.0))
def test_another_unit_of_length(scene: Scene, scale: float) -> None:
    samples = drive_in(scene, DRIVES["figure eight"])
    other = MotionSamples(samples.uv, samples.uv_dot, samples.xy_dot * scale)
    # G diag(1/k, 1/k, 1) has determinant k^-2: g / k times cbrt(k^2).
    assert_same_model(estimate_linear(other), scene.g / np.cbrt(scale), samples)


@given(scenes(), st.floats(-3.0, 3.0))
def test_a_turned_ground_frame_gives_the_rotated_model(scene: Scene, angle: float) -> None:
    samples = drive_in(scene, DRIVES["circle"])
    c, s = math.cos(angle), math.sin(angle)
    seen_there = samples.xy_dot @ np.array([[c, -s], [s, c]])  # headings less by the angle
    turned = estimate_linear(MotionSamples(samples.uv, samples.uv_dot, seen_there))
    assert_same_model(turned, estimate_linear(samples).rotated(angle).g, samples)


@given(scenes())
def test_a_mirrored_ground_frame_mirrors_the_model_and_its_sign(scene: Scene) -> None:
    samples = drive_in(scene, DRIVES["circle"])
    mirrored = MotionSamples(samples.uv, samples.uv_dot, samples.xy_dot * [1.0, -1.0])
    found = estimate_linear(mirrored)
    assert_same_model(found, -scene.g * [1.0, -1.0], samples)  # the signed cube root of -1
    before = LimitedHomography(scene.g).nearness(samples.uv)
    assert (np.sign(found.nearness(samples.uv)) == -np.sign(before)).all()


@given(scenes())
def test_samples_twice_say_the_same(scene: Scene) -> None:
    samples = drive_in(scene, DRIVES["circle"])
    rows = np.concatenate([np.arange(len(samples))] * 2)
    assert_same_model(estimate_linear(samples.take(rows)), scene.g, samples)


@given(scenes())
def test_a_stop_adds_nothing_and_spoils_nothing(scene: Scene) -> None:
    samples = drive_in(scene, DRIVES["circle"])
    still = np.zeros((5, 2))
    with_stop = MotionSamples(
        np.vstack([samples.uv, samples.uv[:5]]),
        np.vstack([samples.uv_dot, still]),
        np.vstack([samples.xy_dot, still]),
    )
    assert_same_model(estimate_linear(with_stop), scene.g, samples)
