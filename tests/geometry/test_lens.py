"""The division model against its own formula in complex numbers, a bracketing root finder and OpenCV."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.geometry.lens import LIMIT, DivisionLens
from scenes import Array, generators

CENTER = np.array([633.0, 371.5])
REACH = 800.0  # px; about the half diagonal of the images here

# |k1| REACH^2 from nothing to all that the model takes, either sign
strengths = st.one_of(st.floats(-0.94, 0.94), st.sampled_from([0.0, -0.0, 1e-300, -1e-12, 1e-12]))


def lens(strength: float) -> DivisionLens:
    return DivisionLens(strength / REACH**2, CENTER)


def seen(rng: np.random.Generator, shape: tuple[int, ...] = (20,)) -> Array:
    """Raw points within the reach."""
    angle, radius = rng.uniform(-np.pi, np.pi, shape), REACH * np.sqrt(rng.random(shape))
    return np.asarray(
        CENTER + radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    )


def undistorted(uv: Any, k1: Any, center: Any) -> Any:
    """The model, written down a second time; takes complex numbers."""
    d = uv - center
    return center + d / (1 + k1 * (d[..., 0] ** 2 + d[..., 1] ** 2))[..., None]


def by_complex_step(function: Any, at: Any, scale: float = 1.0) -> Array:
    """Derivative of a function of numbers (K,), stacked on the last axis; exact to rounding."""
    at = np.asarray(at, dtype=np.complex128)
    columns = []
    for k in range(len(at)):
        step = np.zeros_like(at)
        step[k] = 1j * 1e-30 * scale
        columns.append(function(at + step).imag / (1e-30 * scale))
    return np.stack(columns, axis=-1)


@given(strengths, generators())
def test_points_are_those_of_the_formula(strength: float, rng: np.random.Generator) -> None:
    a, uv = lens(strength), seen(rng)
    assert_allclose(a.undistort(uv), undistorted(uv, a.k1, CENTER), rtol=1e-14)


@given(strengths, generators())
def test_round_trip(strength: float, rng: np.random.Generator) -> None:
    a, uv = lens(strength), seen(rng)
    there = a.undistort(uv)
    # Near the fold of a pincushion, rounding grows by the inverse of the derivative, up to 80.
    assert_allclose(a.distort(there), uv, rtol=0, atol=1e-9)
    assert_allclose(a.undistort(a.distort(there)), there, rtol=1e-12, atol=1e-9)


@given(st.floats(-0.94, 0.94), generators())
def test_distort_against_bisection(strength: float, rng: np.random.Generator) -> None:
    a, target = lens(strength), seen(rng, (5,)) * 0.7 + CENTER * 0.3
    for point, found in zip(target, a.distort(target), strict=True):
        rho = math.hypot(*(point - CENTER))
        edge = math.sqrt(LIMIT / abs(a.k1)) if a.k1 else math.inf
        low, high = 0.0, min(edge, 2 * rho + 1)  # a pincushion doubles a radius at most
        if not high / (1 + a.k1 * high**2) > rho:  # it comes from beyond the limit
            assert np.isnan(found).all()
            continue
        for _ in range(200):
            middle = (low + high) / 2
            low, high = (middle, high) if middle / (1 + a.k1 * middle**2) < rho else (low, middle)
        assert_allclose(found, CENTER + (point - CENTER) * (low / rho), rtol=1e-9, atol=1e-9)


def test_distort_against_opencv(rng: np.random.Generator) -> None:
    """OpenCV's rational model with k4 alone is the division model: 1 / (1 + k4 r^2), from undistorted to raw.

    So OpenCV's projection is our `undistort` with the roles of the points changed, and its iterative undistortion is
    our closed form.
    """
    f, uv = 900.0, seen(rng, (200,)).astype(np.float64)
    K = np.array([[f, 0.0, CENTER[0]], [0.0, f, CENTER[1]], [0.0, 0.0, 1.0]])
    for strength in (-0.3, 0.2):
        a = lens(strength)
        model = np.array([0.0, 0, 0, 0, 0, a.k1 * f**2, 0, 0])
        rays = np.column_stack([(uv - CENTER) / f, np.ones(len(uv))])
        projected, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), K, model)
        assert_allclose(a.undistort(uv), projected[:, 0], rtol=1e-12)
        back = cv2.undistortPoints(
            projected, K, model, P=K, criteria=(cv2.TERM_CRITERIA_COUNT, 2000, 0.0)
        )
        assert_allclose(a.distort(projected[:, 0]), back[:, 0], rtol=0, atol=1e-6)


@given(strengths, generators())
def test_derivatives_at_raw_points(strength: float, rng: np.random.Generator) -> None:
    a, uv = lens(strength), seen(rng)
    uv_dot = rng.normal(0, 100, uv.shape)
    by_point = np.stack(
        [by_complex_step(lambda z: undistorted(z, a.k1, CENTER), point) for point in uv]
    )
    assert_allclose(a.undistort_jacobian(uv), by_point, rtol=1e-11, atol=1e-14)
    assert_allclose(
        a.undistort_velocity(uv, uv_dot),
        np.einsum("nij,nj->ni", by_point, uv_dot),
        rtol=1e-9,
        atol=1e-9,
    )
    by_k1 = by_complex_step(lambda k: undistorted(uv, k[0], CENTER), [a.k1], 1e-6)[..., 0]
    assert_allclose(a.undistort_by_k1(uv), by_k1, rtol=1e-10)
    by_center = by_complex_step(lambda c: undistorted(uv, a.k1, c), CENTER)
    assert_allclose(a.undistort_by_center(uv), by_center, rtol=1e-9, atol=1e-13)


@given(strengths, generators())
def test_derivatives_at_undistorted_points(strength: float, rng: np.random.Generator) -> None:
    """Implicit differentiation of the formula: raw points move so that undistorted ones stay."""
    a, uv = lens(strength), seen(rng)
    there = a.undistort(uv)
    J = np.stack([by_complex_step(lambda z: undistorted(z, a.k1, CENTER), p) for p in uv])
    by_k1 = by_complex_step(lambda k: undistorted(uv, k[0], CENTER), [a.k1], 1e-6)
    by_center = by_complex_step(lambda c: undistorted(uv, a.k1, c), CENTER)
    back = np.linalg.inv(J)
    assert_allclose(a.distort_jacobian(there), back, rtol=1e-8, atol=1e-11)
    assert_allclose(a.distort_by_k1(there), -(back @ by_k1)[..., 0], rtol=1e-8, atol=1e-3)
    assert_allclose(a.distort_by_center(there), -back @ by_center, rtol=1e-8, atol=1e-11)


@pytest.mark.parametrize("strength", [-0.5, 0.4, -1e-9])
def test_distort_against_finite_differences(strength: float, rng: np.random.Generator) -> None:
    """The same derivatives, from `distort` itself."""
    a = lens(strength)
    there = a.undistort(seen(rng))
    h = 1e-3
    for j, e in enumerate(np.eye(2)):
        numeric = (a.distort(there + h * e) - a.distort(there - h * e)) / (2 * h)
        assert_allclose(a.distort_jacobian(there)[..., j], numeric, rtol=1e-5, atol=1e-7)
        high, low = DivisionLens(a.k1, CENTER + h * e), DivisionLens(a.k1, CENTER - h * e)
        numeric = (high.distort(there) - low.distort(there)) / (2 * h)
        assert_allclose(a.distort_by_center(there)[..., j], numeric, rtol=1e-5, atol=1e-7)
    h = 1e-5 / REACH**2
    high, low = DivisionLens(a.k1 + h, CENTER), DivisionLens(a.k1 - h, CENTER)
    numeric = (high.distort(there) - low.distort(there)) / (2 * h)
    assert_allclose(a.distort_by_k1(there), numeric, rtol=1e-5, atol=1e-7 * REACH**3)


@given(strengths, generators())
def test_velocity_by_k1(strength: float, rng: np.random.Generator) -> None:
    """Velocities are derivatives of points along a straight motion: a second complex step needs no Jacobian."""
    a, uv = lens(strength), seen(rng)
    uv_dot = rng.normal(0, 100, uv.shape)

    def velocity(k: Any) -> Any:
        step = 1e-4  # s; a fourth-order difference in time keeps k complex
        at = [undistorted(uv + n * step * uv_dot, k[0], CENTER) for n in (-2, -1, 1, 2)]
        return (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)

    numeric = by_complex_step(velocity, [a.k1], 1e-6)[..., 0]
    found = a.undistort_velocity_by_k1(uv, uv_dot)
    assert_allclose(found, numeric, rtol=1e-6, atol=1e-7 * np.abs(found).max())


def test_by_hand() -> None:
    a = DivisionLens(-0.01, np.array([10.0, 20.0]))  # the circle of infinity has radius 10
    assert a.undistort([13.0, 24.0]).tolist() == [10 + 3 / 0.75, 20 + 4 / 0.75]
    assert_allclose(a.distort([10 + 4.0, 20 + 16 / 3]), [13.0, 24.0], rtol=1e-15)
    assert a.undistort([10.0, 20.0]).tolist() == [10.0, 20.0]
    # along the radius (1 + 0.25) / 0.75^2, across it 1 / 0.75
    assert_allclose(a.undistort_jacobian([15.0, 20.0]), np.diag([1.25 / 0.75**2, 1 / 0.75]))


def test_no_distortion_is_the_identity(rng: np.random.Generator) -> None:
    a, uv = DivisionLens(0.0, CENTER), rng.normal(0, 1e6, (100, 2))
    assert_allclose(a.undistort(uv), uv, rtol=1e-15)
    assert_allclose(a.distort(uv), uv, rtol=1e-15)
    assert_allclose(a.undistort_jacobian(uv), np.broadcast_to(np.eye(2), (100, 2, 2)))
    d = uv - CENTER
    cubic = d * np.sum(d**2, axis=1, keepdims=True)
    assert_allclose(a.distort_by_k1(uv), cubic, rtol=1e-12)  # finite where k1 is zero
    assert_allclose(a.undistort_by_k1(uv), -cubic, rtol=1e-12)


@pytest.mark.parametrize("sign", [-1, 1])
def test_small_k1_does_not_cancel(sign: int) -> None:
    """Relative precision of the shift itself: by series, d = w (1 + z + 2 z^2 + ...), z = k1 w.w."""
    w = np.array([300.0, 400.0])
    for k1 in sign * 10.0 ** np.arange(-26, -10):
        z = k1 * 250_000
        a = DivisionLens(k1, np.zeros(2))
        expected = w * (1 + z + 2 * z**2 + 5 * z**3)
        assert_allclose(a.distort(w), expected, rtol=4e-16)
        assert_allclose(a.distort_by_k1(w), w * 250_000 * (1 + 4 * z), rtol=1e-9)


@pytest.mark.parametrize("sign", [-1, 1])
def test_beyond_the_limit_nothing_is_said(sign: int) -> None:
    a = DivisionLens(sign * 1e-6, CENTER)
    edge = 1e3 * math.sqrt(LIMIT)
    inside, outside = CENTER + [[0.999999 * edge, 0.0]], CENTER + [[0.0, 1.000001 * edge]]
    wild = CENTER + np.array([[1e3, 0.0], [5e3, 1.0], [1e10, 0], [np.inf, 0], [np.nan, 0]])
    beyond = np.concatenate([outside, wild])
    for name in ("undistort", "undistort_jacobian", "undistort_by_k1", "undistort_by_center"):
        assert np.isfinite(getattr(a, name)(inside)).all(), name
        assert np.isnan(getattr(a, name)(beyond)).all(), name
    for name in ("undistort_velocity", "undistort_velocity_by_k1"):
        assert np.isfinite(getattr(a, name)(inside, [1.0, 2.0])).all(), name
        assert np.isnan(getattr(a, name)(beyond, [1.0, 2.0])).all(), name
    # Undistorted: a barrel's limit lies at 20 times the radius, a pincushion's fold at half of 1 / sqrt(k1).
    far = edge / (1 + sign * LIMIT)
    out = CENTER + np.array([[1.000001 * far, 0.0], [0.0, 1e12], [np.inf, 0.0], [np.nan, 1.0]])
    for name in ("distort", "distort_jacobian", "distort_by_k1", "distort_by_center"):
        assert np.isfinite(getattr(a, name)(CENTER + [[0.0, 0.999999 * far]])).all(), name
        assert np.isnan(getattr(a, name)(out)).all(), name


@given(st.sampled_from([-1, 1]), generators())
def test_what_is_just_within_the_limit_comes_back(sign: int, rng: np.random.Generator) -> None:
    a = DivisionLens(sign * 10 ** rng.uniform(-9, -5), rng.uniform(0, 1000, 2))
    angle = rng.uniform(-np.pi, np.pi, 50)
    radius = math.sqrt(LIMIT / abs(a.k1)) * (1 - 1e-15 * rng.integers(0, 5, 50))
    uv = a.center + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    there = a.undistort(uv)
    within = np.isfinite(there).all(axis=1)
    assert (np.isfinite(a.distort(there)).all(axis=1) == within).all()


@given(strengths)
def test_it_is_monotonic_wherever_it_is_used(strength: float) -> None:
    a = lens(strength)
    radius = np.linspace(0, 3 * REACH, 4000)
    out = a.undistort(CENTER + radius[:, None] * [0.6, 0.8]) - CENTER
    along = out @ [0.6, 0.8]
    along = along[np.isfinite(along)]
    assert len(along) > 100
    assert (np.diff(along) > 0).all()
    assert np.isfinite(a.undistort(CENTER + REACH * np.array([0.6, 0.8]))).all()


@pytest.mark.parametrize("shape", [(), (1,), (3, 1, 2, 1), (0,)])
def test_leading_axes_broadcast(shape: tuple[int, ...], rng: np.random.Generator) -> None:
    a, uv = lens(-0.3), seen(rng, shape)
    flat = uv.reshape(-1, 2)
    for name, tail in (
        ("undistort", (2,)),
        ("distort", (2,)),
        ("undistort_jacobian", (2, 2)),
        ("distort_jacobian", (2, 2)),
        ("undistort_by_k1", (2,)),
        ("distort_by_k1", (2,)),
        ("undistort_by_center", (2, 2)),
        ("distort_by_center", (2, 2)),
    ):
        found = getattr(a, name)(uv)
        assert found.shape == (*shape, *tail), name
        assert_allclose(found.reshape(-1, *tail), getattr(a, name)(flat), rtol=1e-14)
        assert not np.shares_memory(found, uv)
    for name in ("undistort_velocity", "undistort_velocity_by_k1"):
        assert getattr(a, name)(uv, [1.0, 2.0]).shape == (*shape, 2)
        many = getattr(a, name)(uv[..., None, :], rng.normal(size=(4, 2)))
        assert many.shape == (*shape, 4, 2)


def test_it_is_our_own_copy_and_refuses_nonsense() -> None:
    center = np.array([1.0, 2.0])
    a = DivisionLens(np.float64(1e-8), center)
    center[:] = 9
    assert a.center.tolist() == [1.0, 2.0]
    assert type(a.k1) is float
    with pytest.raises(ValueError, match="read-only"):
        a.center[0] = 3
    for k1, c in [
        (math.nan, [0, 0]),
        (math.inf, [0, 0]),
        (1e300, [0, 0]),
        ("x", [0, 0]),
        ([1e-8], [0, 0]),
        (1e-8, [0, math.nan]),
        (1e-8, [0]),
        (1e-8, [1e300, 0]),
    ]:
        with pytest.raises(InputError):
            DivisionLens(k1, c)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="two entries"):
        a.undistort([1.0, 2.0, 3.0])
