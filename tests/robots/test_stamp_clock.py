"""Stamps of another clock on ours: drift, jams, early outliers, clocks that are set."""

from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.robots.stamp_clock import StampClock

LEAST_S = 0.004


def run(
    clock: StampClock,
    truth: FloatArray,
    stamps: FloatArray,
    rng: np.random.Generator,
    jam: float = 0.02,
) -> FloatArray:
    """Errors of the times over the least delay, for messages that are late by chance."""
    late = LEAST_S + rng.exponential(jam, len(truth))
    arrivals = np.maximum.accumulate(truth + late)
    found = [clock.take(s, a) for s, a in zip(stamps.tolist(), arrivals.tolist(), strict=True)]
    assert (np.array(found) <= arrivals + 1e-12).all()
    return np.asarray(np.array(found) - truth)


def test_times_are_late_by_the_least_delay_whatever_the_zero(rng: np.random.Generator) -> None:
    truth = np.arange(0, 60, 0.02)
    errors = run(StampClock(), truth, truth + 4711.0, rng)
    assert (errors[500:] > LEAST_S - 1e-9).all()
    assert np.abs(errors[500:] - LEAST_S).max() < 0.003


@pytest.mark.parametrize("ppm", [-100.0, 100.0])
def test_a_drift_of_100_ppm_is_followed_for_an_hour(ppm: float, rng: np.random.Generator) -> None:
    truth = np.arange(0, 3600, 0.1)
    errors = run(StampClock(), truth, truth * (1 + ppm * 1e-6) - 3.0, rng)
    # 20 s of drift, and that the quickest of 200 messages has some 0.1 ms more than the least delay.
    assert np.abs(errors[300:] - LEAST_S).max() < 0.0045
    assert abs(errors[-1]) < 0.01  # and it does not grow


@pytest.mark.parametrize("early_s", [0.1, 0.4, 3.0, 1e6])
def test_one_early_stamp_does_not_poison_it_for_ever(
    early_s: float, rng: np.random.Generator
) -> None:
    truth = np.arange(0, 60, 0.02)
    stamps = truth.copy()
    stamps[1000] += early_s
    errors = run(StampClock(), truth, stamps, rng)
    after = np.abs(errors[1000 + round(21 / 0.02) :] - LEAST_S)
    assert after.max() < 0.003
    if early_s > 0.5:  # it shows itself, as the stamps go back
        assert np.abs(errors[1100:] - LEAST_S).max() < 0.01


def test_a_robot_that_starts_again_is_followed_at_once(rng: np.random.Generator) -> None:
    truth = np.arange(0, 20, 0.02)
    clock = StampClock()
    errors = run(clock, truth, np.where(truth < 10, truth + 5000.0, truth - 10.0), rng, 0.001)
    assert np.abs(errors[502:] - LEAST_S).max() < 0.01
    assert clock.restarts == 1


def test_a_clock_that_is_set_forwards_is_followed_at_once(rng: np.random.Generator) -> None:
    truth = np.arange(0, 20, 0.02)
    errors = run(StampClock(), truth, np.where(truth < 10, truth, truth + 7.0), rng, 0.001)
    assert np.abs(errors[502:] - LEAST_S).max() < 0.01


def test_what_was_held_up_keeps_its_time() -> None:
    clock = StampClock()
    for k in range(100):
        clock.take(k * 0.02, k * 0.02 + 0.01)
    # Messages of a second come at once.
    held = [clock.take(2 + k * 0.02, 3.1) for k in range(50)]
    assert held == pytest.approx([2.01 + k * 0.02 for k in range(50)])


def test_it_remembers_no_more_than_its_window(rng: np.random.Generator) -> None:
    clock = StampClock(window_s=5.0)
    for k in range(20_000):
        clock.take(k * 0.01 * (1 - 1e-4), k * 0.01)
    assert len(clock._least) <= 501


def test_what_is_no_number_is_refused() -> None:
    for stamp, arrival in ((float("nan"), 0.0), (0.0, float("inf"))):
        with pytest.raises(InputError, match="number of seconds"):
            StampClock().take(stamp, arrival)
    with pytest.raises(InputError, match="window_s"):
        StampClock(window_s=0.0)
