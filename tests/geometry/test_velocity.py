"""Edges of eq. 15: the horizon, and what a degenerate g gives."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from airground.geometry import velocity

G_LEVEL = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])  # horizon v = 0


def test_by_hand() -> None:
    """The camera of G_LEVEL: u = x / y, v = -1 / y up to the origin; n.c = -v."""
    uv = np.array([2.0, -4.0])
    assert velocity.nearness(G_LEVEL, uv) == 4.0
    assert velocity.horizon_line(G_LEVEL).tolist() == [0.0, -1.0, 0.0]
    # J = (n.c) [[1, -u], [0, -v]]
    assert velocity.velocity_jacobian(G_LEVEL, uv).tolist() == [[4.0, -8.0], [0.0, 16.0]]
    assert velocity.image_velocity(G_LEVEL, uv, [1.0, 2.0]).tolist() == [-12.0, 32.0]
    assert_allclose(velocity.ground_velocity(G_LEVEL, uv, [-12.0, 32.0]), [1.0, 2.0])


def test_nan_on_the_horizon_is_for_those_points_only() -> None:
    uv = np.array([[2.0, 0.0], [2.0, -4.0]])
    found = velocity.ground_velocity(G_LEVEL, uv, [-12.0, 32.0])
    assert np.isnan(found[0]).all()
    assert_allclose(found[1], [1.0, 2.0])


def test_gradient_is_row_by_row() -> None:
    D = velocity.image_velocity_gradient(G_LEVEL, np.array([2.0, -4.0]), np.array([1.0, 2.0]))
    assert D.shape == (2, 6)
    # n.c = (g10 g21 - g20 g11) u + (g20 g01 - g00 g21) v + g00 g11 - g10 g01, so d(n.c)/dg00 = -v = 4,
    # and u' = (n.c) (g00 x + g01 y - u (g20 x + g21 y)): d/dg00 = 4 (1 - 2 * 2) + 4 * 1.
    assert D[0, 0] == 4 * (1 - 4) + 4
    # d/dg01: n.c does not change, 4 * y.
    assert D[0, 1] == 8


def test_derivative_by_the_point_against_finite_differences(rng: np.random.Generator) -> None:
    g, uv, xy_dot = rng.normal(size=(3, 2)), rng.normal(size=(20, 2)), rng.normal(size=(20, 2))
    found = velocity.image_velocity_by_point(g, uv, xy_dot)
    h = 1e-6
    for i, e in enumerate(np.eye(2)):
        high, low = (velocity.image_velocity(g, uv + s * h * e, xy_dot) for s in (1, -1))
        assert_allclose(found[..., i], (high - low) / (2 * h), rtol=1e-6, atol=1e-7)
    one = velocity.image_velocity_by_point(g, uv[0], xy_dot)
    assert one.shape == (20, 2, 2)
