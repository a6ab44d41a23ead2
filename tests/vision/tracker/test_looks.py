"""Headings as evidence: their covariance stays one through gaps, and what is missing changes nothing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm  # type: ignore[import-untyped,unused-ignore]

from airground.vision.sightings import Sightings
from airground.vision.tracker import Tracker
from airground.vision.tracker.looks import TURN_RATE, TURN_S, Looks


def headed(t: float, angle: float, sigma: float) -> Sightings:
    place = np.array([[100 + 30 * t, 100.0]])
    return Sightings(
        t, place, 0.1 * np.eye(2)[None], angle=np.array([angle]), angle_sigma=np.array([sigma])
    )


def test_prediction_is_the_matrix_exponential() -> None:
    """Of a heading whose rate forgets itself (Van Loan 1978)."""
    looks = Looks.begin(headed(0.0, 0.3, 0.1)).predict(0.2)
    hh, hr, rr = looks.spread[0]
    before = np.array([[hh, hr], [hr, rr]])
    for dt in (1e-3, 1 / 30, 0.3, 1.5):
        drift = np.array([[0, 1], [0, -1 / TURN_S]])
        block = np.zeros((4, 4))
        block[:2, :2], block[2:, 2:] = -drift, drift.T
        block[1, 3] = 2 / TURN_S * TURN_RATE**2
        whole = expm(block * dt)
        step = whole[2:, 2:].T
        want = step @ before @ step.T + step @ whole[:2, 2:]
        after = looks.predict(dt).spread[0]
        np.testing.assert_allclose(after, want[[0, 0, 1], [0, 1, 1]], rtol=1e-6)


@pytest.mark.parametrize("gap", [1e-6, 0.03, 0.5, 1.0, 5.0])
@pytest.mark.parametrize("sigma", [0.0, 1e-3, 0.05, 3.0])
def test_variances_stay_positive_through_gaps(gap: float, sigma: float) -> None:
    looks = Looks.begin(headed(0.0, 0.0, sigma))
    row = np.array([0])
    for k in range(20):
        looks = looks.predict(gap if k % 3 == 0 else 1 / 30)
        seen = headed(0.0, 0.1 * k, sigma)
        assert np.isfinite(looks.evidence(row, seen, row)).all()
        looks = looks.update(row, seen, row)
        hh, hr, rr = looks.spread[0]
        assert hh > 0
        assert rr > 0
        assert hr**2 <= hh * rr * (1 + 1e-9)


def test_headings_that_come_and_go(rng: np.random.Generator) -> None:
    """A tag whose heading is read now and then, gaps of a second between; any warning is an error."""
    tracker, t = Tracker(), 0.0
    for k in range(60):
        t += 1.0 if k % 10 == 0 else 1 / 30
        known = rng.random() < 0.6
        tracker.update(headed(t, 0.2 * t if known else np.nan, 0.02 if known else np.nan))
        tracker.predict(t + 1.5)
    (track,) = tracker.update(headed(t + 1 / 30, np.nan, np.nan)).tracks
    assert np.isfinite([track.angle, track.angle_sigma]).all()
