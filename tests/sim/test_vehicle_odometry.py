"""Odometry of the simulated vehicle: what its noise is said to be, when it arrives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import VelocityCommand
from airground.errors import InputError
from airground.sim.vehicle_odometry import Odometer, OdometryNoise
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant

EXACT: dict[str, Any] = {
    "heading_rad": 0.0,
    "speed_share": 0.0,
    "speed_mps": 0.0,
    "turn_share": 0.0,
    "turn_rate_radps": 0.0,
}


def test_without_noise_it_is_the_wheels_truth_each_once(rng: np.random.Generator) -> None:
    plant = VehiclePlant((0, 0), 3.0, options=PlantOptions(speed_scale=0.9))
    odometer = Odometer(
        plant, OdometryNoise(rate_hz=50, latency_s=0.03, heading_bias_rad=0.2, **EXACT), rng
    )
    assert odometer.readings(-1.0) == []
    readings = []
    for k in range(200):
        plant.command(k / 100, VelocityCommand(0.5, 0.8))
        plant.advance((k + 1) / 100)
        new = odometer.readings((k + 1) / 100)
        assert all(k / 100 < r.arrives_t + 1e-9 <= (k + 1) / 100 + 1e-6 for r in new)
        readings += new
    t = np.array([r.t for r in readings])
    assert_allclose(t, np.arange(99) / 50)  # the last within 2 s - 30 ms
    assert_allclose([r.arrives_t for r in readings], t + 0.03)
    _, theta = plant.pose(t)
    _, wheels = plant.motion(t)
    assert_allclose(np.exp(1j * np.array([r.theta for r in readings])), np.exp(1j * (theta + 0.2)))
    assert max(abs(r.theta) for r in readings) <= np.pi
    assert_allclose([(r.v, r.omega, r.lateral) for r in readings], wheels)
    assert readings[-1].v == pytest.approx(0.5, rel=1e-3)
    assert plant.v == pytest.approx(0.45, rel=1e-3)


def test_its_noise_has_the_stated_size(rng: np.random.Generator) -> None:
    plant = VehiclePlant((0, 0), 0.0, options=PlantOptions(watchdog_s=np.inf))
    noise = OdometryNoise(slow_s=0.5, heading_swing_rad=0.05, heading_rad=0.02, latency_s=0.0)
    odometer = Odometer(plant, noise, rng)
    plant.command(0.0, VelocityCommand(0.5, 0.8))
    plant.advance(100.0)
    readings = [r for r in odometer.readings(100.0) if r.t > 2]
    t = np.array([r.t for r in readings])
    theta = np.angle(np.exp(1j * (np.array([r.theta for r in readings]) - plant.pose(t)[1])))
    v = np.array([r.v for r in readings])
    omega = np.array([r.omega for r in readings])
    # White noise shows between neighbours 20 ms apart, where the slow part has moved by 4 % of its variance at most.
    neighbours = np.array([np.std(np.diff(x)) / np.sqrt(2) for x in (theta, v, omega)])
    white, slow = np.array([0.02, 0.01, 0.02]), np.array([0.05, 0.05, 0.08])
    assert (neighbours > 0.97 * white).all()
    assert (neighbours < 1.03 * np.hypot(white, slow * np.sqrt(0.04))).all()
    # 100 s hold about 100 independent values of the slow part: 7 %; three of those, and the grid.
    assert_allclose(np.std(theta), np.hypot(0.02, 0.05), rtol=0.22)
    assert_allclose(np.std(v), np.hypot(0.01, 0.05), rtol=0.22)
    assert_allclose(np.std(omega), np.hypot(0.02, 0.08), rtol=0.22)


def test_without_a_compass_there_is_no_heading(rng: np.random.Generator) -> None:
    plant = VehiclePlant((0, 0), 0.0)
    odometer = Odometer(plant, OdometryNoise(compass=False), rng)
    plant.advance(0.1)
    assert all(np.isnan(r.theta) and np.isfinite(r.v) for r in odometer.readings(0.1))


def test_the_future_is_not_told_and_senseless_noise_is_refused(rng: np.random.Generator) -> None:
    plant = VehiclePlant((0, 0), 0.0)
    with pytest.raises(InputError, match="advance it"):
        Odometer(plant, OdometryNoise(), rng).readings(1.0)
    wrong: tuple[dict[str, Any], ...] = (
        {"rate_hz": 0.0},
        {"latency_s": -1.0},
        {"heading_bias_rad": np.nan},
    )
    for change in wrong:
        with pytest.raises(InputError, match=next(iter(change))):
            OdometryNoise(**change)
