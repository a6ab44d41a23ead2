"""Factor for errors that hang together, on series whose autocorrelation is known."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.calibration.trajectory.whiteness import (
    CROSSING,
    HANGING,
    _autocovariance,
    correlation_factor,
)

if TYPE_CHECKING:
    from airground.calibration.trajectory.problem import Problem
    from airground.calibration.trajectory.solver import Solution
    from scenes import Array


@dataclass
class Case:
    """What the factor is computed from, and nothing else."""

    series: list[Array]
    uv: Array

    def factor(self, weights: list[Array] | None = None) -> float:
        weights = weights or [np.ones(len(z)) for z in self.series]
        chains = [SimpleNamespace(uv=self.uv) for _ in self.series]
        found = SimpleNamespace(
            sightings=tuple(self.series), weights=tuple((w, np.ones(1)) for w in weights)
        )
        return correlation_factor(
            cast("Problem", SimpleNamespace(chains=tuple(chains))), cast("Solution", found)
        )


LONG_WAY = np.column_stack([np.tile([0.0, 100.0], 500), np.zeros(1000)])  # 999 crossings


def ar(rng: np.random.Generator, rho: float, count: int) -> Array:
    z = rng.normal(size=(count, 2))
    for k in range(1, count):
        z[k] = rho * z[k - 1] + np.sqrt(1 - rho**2) * z[k]
    return z


def test_white_errors_need_no_factor(rng: np.random.Generator) -> None:
    # Three deviations of one lag: once in 700 series.
    found = [Case([rng.normal(size=(500, 2))], LONG_WAY).factor() for _ in range(60)]
    assert found.count(1.0) >= 59


@pytest.mark.parametrize("rho", [0.06, 0.1, 0.15])
def test_below_the_limit_it_is_the_sum_of_the_autocorrelations(
    rho: float, rng: np.random.Generator
) -> None:
    found = Case([ar(rng, rho, 20_000), ar(rng, rho, 10_000)], LONG_WAY).factor()
    whole = (1 + rho) / (1 - rho)
    assert whole < HANGING
    # What lies below the floor of 0.05 is not summed: of these series, all but the first lag.
    assert 1 + 2 * rho - 0.03 < found < whole + 0.03


@pytest.mark.parametrize("rho", [0.5, 0.9])
def test_above_the_limit_one_crossing_holds_a_few_errors_only(
    rho: float, rng: np.random.Generator
) -> None:
    z = ar(rng, rho, 8000)
    there_and_back = np.column_stack([np.abs(np.linspace(-100, 100, 401)), np.zeros(401)])
    found = Case([z], there_and_back).factor()  # two crossings
    assert found == pytest.approx(8000 / (CROSSING * 2))
    # On a way long enough the autocorrelation decides.
    whole = (1 + rho) / (1 - rho)
    assert Case([z], LONG_WAY).factor() == pytest.approx(whole, rel=0.2)
    # A way that does not leave its place is one crossing.
    assert Case([z], np.zeros((10, 2))).factor() == pytest.approx(8000 / CROSSING)
    # Several robots cross each for itself.
    assert Case([z[:4000], z[4000:]], there_and_back).factor() == pytest.approx(8000 / CROSSING / 4)


def test_gross_errors_count_by_their_weight(rng: np.random.Generator) -> None:
    z = ar(rng, 0.1, 4000)
    spoilt, weight = z.copy(), np.ones(4000)
    spoilt[1000:1040] += 100.0  # in a row: they would hang together
    weight[1000:1040] = 1e-6
    assert Case([spoilt], LONG_WAY).factor() > 5
    assert Case([spoilt], LONG_WAY).factor([weight]) == pytest.approx(
        Case([z], LONG_WAY).factor(), abs=0.05
    )


def test_no_errors_at_all_are_white() -> None:
    assert Case([np.zeros((50, 2))], LONG_WAY).factor() == 1.0


def test_series_shorter_than_the_lags(rng: np.random.Generator) -> None:
    assert Case([rng.normal(size=(1, 2))], LONG_WAY).factor() == 1.0
    assert 1.0 <= Case([rng.normal(size=(3, 2)), ar(rng, 0.1, 30)], LONG_WAY).factor() < 4


@pytest.mark.parametrize("count", [1, 2, 7, 64])
def test_autocovariance_is_a_loop(count: int, rng: np.random.Generator) -> None:
    r = rng.normal(size=(count, 2))
    wanted = [sum(float(r[i] @ r[i + k]) for i in range(count - k)) for k in range(count)]
    assert_allclose(_autocovariance(r), wanted, atol=1e-10)
