"""A short memory against the long one, and that it is short."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.errors import InputError
from airground.sim.live_memory import KEPT_S, ShortHistory, ShortNoise
from airground.sim.vehicle_history import History, SlowNoise


def test_it_remembers_what_the_long_one_does(rng: np.random.Generator) -> None:
    start = (2.0, np.array([1.0, -1.0]), 0.4)
    short, long = ShortHistory(*start), History(*start)
    now = 2.0
    for _ in range(200):
        ends = (now + np.cumsum(rng.uniform(0.001, 0.02, 3))).tolist()
        motion = [tuple(row) for row in rng.normal(size=(3, 6)).tolist()]
        motion[1] = (0.3, 0.0, *motion[1][2:])  # straight on
        short.drive(ends, motion)
        long.drive(ends, motion)
        now = ends[-1]
    t = np.concatenate([rng.uniform(1.5, now, 300), [2.0, now]])
    for one, other in zip(short.at(t), long.at(t), strict=True):
        assert_allclose(one, other, atol=1e-9)
    assert_allclose(short.rows[-1], long.rows[-1], atol=1e-9)
    assert_allclose(short.rows[-2], long.rows[-2], atol=1e-9)
    assert_allclose(short.newest, long.rows[-1, 1:4], atol=1e-9)


def test_at_first_there_is_no_motion() -> None:
    short = ShortHistory(2.0, np.array([1.0, -1.0]), 0.4)
    assert short.rows.shape == (1, 10)
    xy, theta, motion = short.at(np.array([0.0, 2.0]))
    assert_allclose(xy, [[1.0, -1.0]] * 2)
    assert_allclose(theta, 0.4)
    assert_allclose(motion, 0.0)


def test_it_forgets_and_says_so() -> None:
    short = ShortHistory(0.0, np.zeros(2), 0.0)
    for k in range(1, 6000):
        short.drive([k * 0.01], [(0.1, 0.0, 0.0, 0.1, 0.0, 0.0)])
    assert len(short._times) <= 2 * KEPT_S / 0.01 + 2
    assert_allclose(short.at(np.array([60 - KEPT_S]))[0][0], [0.1 * (60 - KEPT_S), 0.0])
    with pytest.raises(InputError, match="forgotten; ask from"):
        short.at(np.array([59.0, 1.0]))


def test_short_noise_is_that_of_the_long_one() -> None:
    short = ShortNoise(np.random.default_rng(5), 4.0, 1.0)
    long = SlowNoise(np.random.default_rng(5), 4.0, 1.0)
    t = np.arange(0.0, 200.0, 0.03)
    assert_allclose([short.at(one) for one in t], [long.at(one) for one in t], atol=1e-12)
    assert len(short._values) < 2500 < len(long._values)


def test_after_a_long_gap_noise_begins_anew_and_quickly() -> None:
    short = ShortNoise(np.random.default_rng(5), 4.0, 0.0)
    short.at(1.0)
    short.at(1e6)
    assert len(short._values) < 10
    values = [short.at(1e6 + k) for k in range(0, 2000, 8)]
    assert 0.7 < np.std(values) < 1.3
