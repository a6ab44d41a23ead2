"""Edges of the error measures."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from airground import LimitedHomography
from airground.geometry import align_rotation, n_error, velocity_map_error

G = np.array([[60.0, 5.0], [-4.0, 50.0], [0.001, 0.02]])


def test_arrays_lists_and_models_are_the_same() -> None:
    other = 1.1 * G
    want = n_error(G, other)
    assert n_error(G.tolist(), LimitedHomography(other)) == want
    assert_allclose(want, 0.1)
    a, _ = align_rotation(G.tolist(), other)
    b, _ = align_rotation(LimitedHomography(G), LimitedHomography(other))
    assert np.array_equal(a, b)
    uv = [[10.0, 20.0]]
    assert velocity_map_error(G.tolist(), other, uv) == velocity_map_error(
        LimitedHomography(G), LimitedHomography(other), uv
    )


def test_no_error_is_nought() -> None:
    assert n_error(G, G) == 0
    assert velocity_map_error(G, G, [[10.0, 20.0]]) < 1e-12
    aligned, angle = align_rotation(G, G)
    assert_allclose(aligned, G)
    assert angle == 0


def test_row_three_hardly_counts_in_n_but_does_in_the_velocity_map() -> None:
    wrong = G.copy()
    wrong[2] *= 2
    assert n_error(G, wrong) < 1e-3
    assert velocity_map_error(G, wrong, [[300.0, 900.0]]) > 0.3
