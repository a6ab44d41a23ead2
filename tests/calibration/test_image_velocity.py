"""Image velocities beside a stop, against a motion that is known."""

from __future__ import annotations

import numpy as np
import pytest

from airground.calibration.image_velocity import image_motion

RATE = 20.0
T = np.arange(0, 12, 1 / RATE)
STOP, GO = 4.0, 8.0
FAST = np.array([60.0, 25.0])  # px/s


def drive(rng: np.random.Generator, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Drives, stands and drives on: positions with noise, and true velocities."""
    way = np.minimum(T, STOP) + np.maximum(T - GO, 0)
    under_way = (T < STOP) | (T > GO)
    uv = 100 + way[:, None] * FAST + rng.normal(0, noise, (len(T), 2))
    return uv, under_way[:, None] * FAST


@pytest.mark.parametrize("wanted", [5, 11, 21])
def test_a_stop_spoils_only_the_sightings_at_it(wanted: int, rng: np.random.Generator) -> None:
    uv, truth = drive(rng, 0.02)
    found = image_motion(T, uv, wanted=wanted, limit=1.0, sigma=np.full(len(T), 0.02))
    error = np.linalg.norm(found.uv_dot - truth, axis=1)
    kink = np.minimum(np.abs(T - STOP), np.abs(T - GO))
    assert error[kink > 0.11].max() < 0.12 * np.linalg.norm(FAST)
    assert np.sqrt(np.mean(error[kink > 0.11] ** 2)) < 0.02 * np.linalg.norm(FAST)
    window = (wanted // 2) / RATE
    plain = np.linalg.norm(_plain(uv, wanted) - truth, axis=1)
    beside = (kink > 0.11) & (kink < window)
    if beside.any():
        assert error[beside].max() < 0.5 * plain[beside].max(), "a window across the stop"


def test_the_deviation_is_that_of_the_errors_everywhere(rng: np.random.Generator) -> None:
    inside = []
    for _ in range(20):
        uv, truth = drive(rng, 0.3)
        found = image_motion(T, uv, wanted=11, limit=1.0, sigma=np.full(len(T), 0.3))
        inside.append(np.abs(found.uv_dot - truth) < 1.96 * found.sigma[:, None])
    share = np.mean(inside, axis=(0, 2))
    assert 0.92 < np.mean(inside) < 0.99
    kink = np.minimum(np.abs(T - STOP), np.abs(T - GO))
    assert share[kink > 0.06].min() > 0.75, "nowhere surer than it is right"


def test_white_noise_is_left_to_the_centred_window(rng: np.random.Generator) -> None:
    uv = 50 + T[:, None] * FAST + rng.normal(0, 0.3, (len(T), 2))
    found = image_motion(T, uv, wanted=11, limit=1.0, sigma=np.full(len(T), 0.3))
    middle = slice(5, -5)
    np.testing.assert_allclose(found.uv_dot[middle], _plain(uv, 11)[middle], rtol=1e-9)


def test_a_gap_is_kept_out_of_all_windows(rng: np.random.Generator) -> None:
    keep = (T < 2) | (T > 6)
    t = T[keep]
    uv = np.where(t[:, None] < 3, t[:, None] * FAST, 500 - t[:, None] * FAST)
    found = image_motion(t, uv, wanted=11, limit=1.0, sigma=np.full(len(t), 0.02))
    truth = np.where(t[:, None] < 3, FAST, -FAST)
    np.testing.assert_allclose(found.uv_dot, truth, atol=1e-8)


def _plain(uv: np.ndarray, count: int) -> np.ndarray:
    """NumPy's parabola over a centred window."""
    velocity = np.full_like(uv, np.nan)
    for k in range(len(T)):
        first = int(np.clip(k - count // 2, 0, len(T) - count))
        rows = slice(first, first + count)
        for axis in (0, 1):
            fit = np.polynomial.Polynomial.fit(T[rows], uv[rows, axis], 2)
            velocity[k, axis] = fit.deriv()(T[k])
    return velocity
