"""The filters: against numerical integration, and their stated uncertainty against sampled errors."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm  # type: ignore[import-untyped,unused-ignore]
from scipy.stats import chi2  # type: ignore[import-untyped,unused-ignore]

from airground.vision.tracker import TrackerOptions, smooth
from airground.vision.tracker.beliefs import MotionModel, transition

T = 0.5


def van_loan(dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Step and noise of one coordinate by the matrix exponential (Van Loan 1978)."""
    drift = np.array([[0, 1, 0], [0, 0, 1], [0, 0, -1 / T]])
    block = np.zeros((6, 6))
    block[:3, :3], block[3:, 3:] = -drift, drift.T
    block[2, 5] = 2 / T
    whole = expm(block * dt)
    step = whole[3:, 3:].T
    return step, step @ whole[:3, 3:]


def test_transition_is_the_matrix_exponential() -> None:
    for dt in (1e-3, 1 / 30, 0.2, 1.0, 3.0):
        step, noise = transition(dt, T)
        want_step, want_noise = van_loan(dt)
        np.testing.assert_allclose(step, np.kron(want_step, np.eye(2)), rtol=1e-10, atol=1e-14)
        np.testing.assert_allclose(noise[::2, ::2], want_noise, rtol=1e-5, atol=1e-15)
        assert np.linalg.eigvalsh(noise).min() > -1e-18


def test_two_steps_are_one(rng: np.random.Generator) -> None:
    """With one way to move, any division of the time gives the same prediction."""
    model = MotionModel.from_options(TrackerOptions(accelerations_pxps2=(100.0,)))
    begin = model.begin(rng.normal(500, 100, (4, 2)), np.tile(0.3 * np.eye(2), (4, 1, 1)))
    one = model.predict(begin, 0.7)
    two = model.predict(model.predict(begin, 0.1), 0.6)
    np.testing.assert_allclose(one.x, two.x)
    np.testing.assert_allclose(one.covariance, two.covariance, rtol=1e-9)


def ramble(
    rng: np.random.Generator, runs: int, t: np.ndarray, level: float
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities under accelerations that forget themselves, integrated in fine steps."""
    uv = np.zeros((runs, 2))
    rate = rng.normal(0, 100, (runs, 2))
    push = rng.normal(0, level, (runs, 2))
    places, rates = [uv], [rate]
    for dt in np.diff(t):
        h = dt / 20
        for _ in range(20):
            uv, rate = uv + h * rate, rate + h * push
            push = push * np.exp(-h / T) + level * np.sqrt(-np.expm1(-2 * h / T)) * rng.normal(
                size=(runs, 2)
            )
        places.append(uv)
        rates.append(rate)
    return np.stack(places, axis=1), np.stack(rates, axis=1)


def test_stated_uncertainty_is_the_sampled_one(rng: np.random.Generator) -> None:
    """Normalised squared errors and innovations of 100 manoeuvring things, uneven frames, all accelerations mixed."""
    runs, sigma = 100, 0.5
    t = np.cumsum(rng.uniform(0.02, 0.06, 60))
    errors, innovations = [], []
    model = MotionModel.from_options(TrackerOptions(speed_pxps=100.0))
    for level in (10.0, 40.0, 100.0, 300.0):
        uv, rate = ramble(rng, runs, t, level)
        seen = uv + rng.normal(0, sigma, uv.shape)
        noise = np.tile(sigma**2 * np.eye(2), (runs, 1, 1))
        beliefs = model.begin(seen[:, 0], noise)
        for k in range(1, len(t)):
            beliefs = model.predict(beliefs, t[k] - t[k - 1])
            x, cover = beliefs.combined()
            off = seen[:, k] - x[:, :2]
            total = cover[:, :2, :2] + noise
            if k > 20:
                innovations.append((off * np.linalg.solve(total, off[..., None])[..., 0]).sum(-1))
            beliefs, _ = model.update(beliefs, seen[:, k], noise)
        x, cover = beliefs.combined()
        off = np.concatenate([x[:, :2] - uv[:, -1], x[:, 2:4] - rate[:, -1]], axis=1)
        errors.append((off * np.linalg.solve(cover[:, :4, :4], off[..., None])[..., 0]).sum(-1))
    # Expected 2 and 4; the filter does not know the level, so that a third either way is near nominal.
    assert 1.6 < np.mean(innovations) < 2.4
    assert 2.6 < np.mean(errors) < 5.2
    assert np.mean(np.concatenate(errors) < chi2.ppf(0.95, 4)) > 0.88


def test_covariances_stay_sound_through_extremes(rng: np.random.Generator) -> None:
    model = MotionModel.from_options(TrackerOptions())
    beliefs = model.begin(np.full((3, 2), 1e4), np.tile(1e-6 * np.eye(2), (3, 1, 1)))
    for dt in (1e-6, 10.0, 1e-3, 60.0, 0.03) * 20:
        beliefs = model.predict(beliefs, dt)
        noise = np.tile(np.diag([1e-6, 1e2]), (3, 1, 1))
        beliefs, log = model.update(beliefs, np.full((3, 2), 1e4) + rng.normal(0, 1, (3, 2)), noise)
        cover = beliefs.combined(6)[1]
        assert np.isfinite(log).all()
        np.testing.assert_array_equal(cover, cover.swapaxes(1, 2))
        scale = np.sqrt(np.einsum("kii->ki", cover))
        assert np.linalg.eigvalsh(cover / scale[:, :, None] / scale[:, None]).min() > -1e-9


def test_smoothing_helps_and_says_by_how_much(rng: np.random.Generator) -> None:
    t = np.cumsum(rng.uniform(0.02, 0.05, 80))
    uv, rate = ramble(rng, 30, t, 100.0)
    seen = uv + rng.normal(0, 1.0, uv.shape)
    noise = np.tile(np.eye(2), (len(t), 1, 1))
    squares, off = [], []
    for k in range(len(uv)):
        answer = smooth(t, seen[k], noise)
        miss = np.concatenate([answer.uv - uv[k], answer.uv_dot - rate[k]], axis=1)[20:-20]
        cover = answer.covariance[20:-20]
        squares.append((miss * np.linalg.solve(cover, miss[..., None])[..., 0]).sum(-1).mean())
        off.append(np.sqrt((miss[:, :2] ** 2).mean()))
    assert np.mean(off) < 0.6  # px; the sightings' own error is 1
    assert 2.8 < np.mean(squares) < 5.2  # 4 expected
