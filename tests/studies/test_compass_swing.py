from __future__ import annotations

import numpy as np
import pytest

from airground.errors import InputError
from airground.studies.compass_swing import swing_compass


def turn(amplitude: float, phase: float, *, radians: float = 7.0) -> tuple[np.ndarray, ...]:
    """Times, true headings, headings read with iron and a bias, and rates of wheels that slip."""
    t = np.arange(0.0, 10.0, 0.05)
    theta = 1.0 + radians * t / 10.0
    read = np.arctan2(
        np.sin(theta) + amplitude * np.sin(phase), np.cos(theta) + amplitude * np.cos(phase)
    )
    return t, theta, np.angle(np.exp(1j * (read + 0.3))), np.full(len(t), 1.02 * radians / 10.0)


def test_the_swing_is_found_despite_slip_and_bias() -> None:
    t, theta, read, rate = turn(0.05, 2.0)
    swing = swing_compass(t, read, rate)
    off = np.array([swing.corrected(h) for h in read.tolist()]) - theta
    off = np.angle(np.exp(1j * off))
    before = np.angle(np.exp(1j * (read - theta)))
    assert np.ptp(before) == pytest.approx(0.1, rel=0.05)
    assert np.ptp(off) < 0.008, "what is left is of second order"


def test_less_than_a_turn_tells_too_little() -> None:
    t, _, read, rate = turn(0.05, 2.0, radians=2.0)
    with pytest.raises(InputError, match="turn of 4"):
        swing_compass(t, read, rate)
