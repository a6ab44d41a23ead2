"""Unknowns that wander and forget, against the dense covariance of such a process."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.calibration.trajectory.wander import of_process
from scenes import generators

BORDER = 5


@given(generators(), st.integers(2, 9), st.integers(2, 4), st.integers(0, 3))
def test_process(rng: np.random.Generator, count: int, width: int, place: int) -> None:
    """Against the covariance of an Ornstein-Uhlenbeck process, which the rows are the inverse of."""
    place = min(place, width - 1)
    t = np.cumsum(rng.uniform(0.05, 3.0, count))
    link = rng.random(count - 1) < 0.7
    sigma, memory = rng.uniform(0.1, 2.0), rng.uniform(0.5, 5.0)
    value = rng.normal(size=count)
    part = np.concatenate([[0], np.cumsum(~link)])
    together = part[:, None] == part[None, :]
    cov = sigma**2 * np.exp(-np.abs(t[:, None] - t) / memory) * together
    found, log_sigma = of_process(
        value,
        link,
        np.diff(t),
        sigma=sigma,
        memory=memory,
        place=place,
        width=width,
        size=BORDER,
    )
    H, right = np.zeros((count * width, count * width)), found.right
    for i in range(count * width):
        for j in range(max(0, i - 2 * width + 1), i + 1):
            H[i, j] = H[j, i] = found.bands[i - j, j]
    mine = np.arange(place, count * width, width)
    information = np.linalg.inv(cov)
    assert_allclose(H[np.ix_(mine, mine)], information, atol=1e-9 * np.abs(information).max())
    assert_allclose(right[mine], -information @ value, atol=1e-8 * np.abs(information).max())
    assert found.cost == pytest.approx(value @ information @ value, rel=1e-8)
    assert 2 * log_sigma == pytest.approx(np.linalg.slogdet(cov)[1], abs=1e-8)
    others = np.setdiff1d(np.arange(len(H)), mine)
    assert not H[others].any()
    assert not right[others].any()
    assert found.border.shape == (count * width, BORDER)
    assert not found.border.any()
    assert not found.corner.any()
    assert not found.corner_right.any()
