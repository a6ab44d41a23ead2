"""How likely a lens is, by the evidence of both models."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from airground.calibration.trajectory.problem import Problem
from airground.calibration.trajectory.selection import lens_probability
from airground.calibration.trajectory.solver import Solution
from airground.calibration.trajectory.state import Free, Noise, Priors
from airground.calibration.trajectory.view import View

PRIOR = 0.2
VIEW = View(np.array([300.0, 200.0]), 0.01, np.array([320.0, 240.0]))
PROBLEM = Problem(VIEW, (), Noise(), Priors(bend=PRIOR), Free(), 0.0)  # k1 is the eighth unknown


def solution(cost: float, sigma: float = 1.0) -> Solution:
    made: Any = SimpleNamespace(cost=cost, covariance=np.diag([1.0] * 7 + [sigma**2]))
    return cast("Solution", made)


def probability(less: float, sigma: float) -> float:
    return lens_probability(PROBLEM, solution(100.0), solution(100.0 - less, sigma))


def test_data_that_tell_nothing_leave_it_as_likely_as_not() -> None:
    assert probability(0.0, PRIOR) == pytest.approx(0.5)
    assert probability(0.0, 10 * PRIOR) == pytest.approx(0.5)


def test_evidence_is_the_integral_over_k1() -> None:
    """Against the likelihood of both models, summed over k1: a normal one about an estimate, and the same at zero."""
    for estimate, sigma in ((0.0, 0.01), (0.02, 0.01), (0.06, 0.02)):
        k1, step = np.linspace(-1, 1, 20001, retstep=True)
        prior = np.exp(-((k1 / PRIOR) ** 2) / 2) / (PRIOR * np.sqrt(2 * np.pi))
        bent = float(np.sum(np.exp(-(((k1 - estimate) / sigma) ** 2) / 2) * prior) * step)
        straight = float(np.exp(-((estimate / sigma) ** 2) / 2))
        # The estimator's cost has the prior in it.
        left = 1 / (sigma**-2 + PRIOR**-2)
        best = estimate * left / sigma**2
        cost = ((best - estimate) / sigma) ** 2 + (best / PRIOR) ** 2
        found = probability((estimate / sigma) ** 2 - cost, np.sqrt(left))
        assert found == pytest.approx(bent / (bent + straight), rel=1e-6)


def test_the_more_exact_the_data_the_more_a_lens_must_explain() -> None:
    assert probability(6.0, 0.05) > 0.5 > probability(6.0, 0.005)
    assert probability(1e9, 1e-9) == 1.0


def test_a_usual_lens_is_told_from_the_images_size() -> None:
    """k1 r^2 in a corner is the same in pixels, in half diagonals and in normalised units."""
    larger = View(2 * VIEW.middle, VIEW.scale, 2 * VIEW.center)
    assert VIEW.usual_bend == pytest.approx(4 * larger.usual_bend)
    lens = VIEW.lens(-VIEW.usual_bend)
    assert lens is not None
    assert lens.k1 * (320.0**2 + 240.0**2) == pytest.approx(-0.15)
    around_zero = View(np.zeros(2), 2.0, np.zeros(2))  # pixels counted from the middle
    assert 0 < around_zero.usual_bend < 1
