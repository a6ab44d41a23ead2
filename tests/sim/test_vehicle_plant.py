"""The simulated vehicle against mechanics written out by hand: arcs, lags, limits, delays."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import STOP, VelocityCommand
from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim import roll_out
from airground.sim.vehicle_drives import VehicleKind
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant

KINDS = get_args(VehicleKind)
AT_ONCE: dict[str, Any] = {
    "latency_s": 0.0,
    "speed_lag_s": 0.0,
    "turn_lag_s": 0.0,
    "acceleration_mps2": 1e6,
    "turn_acceleration_radps2": 1e6,
    "steering_rate_radps": 1e6,
}


def driven(
    options: PlantOptions, command: VelocityCommand, until: float, kind: VehicleKind = "unicycle"
) -> VehiclePlant:
    """A vehicle that has obeyed one command, told again every 0.1 s."""
    plant = VehiclePlant((1.0, 2.0), 0.4, kind, options, rng=np.random.default_rng(5))
    for k in range(round(until * 10)):
        plant.command(k / 10, command)
        plant.advance((k + 1) / 10)
    return plant


@pytest.mark.parametrize("kind", ["unicycle", "differential", "ackermann"])
def test_without_faults_it_drives_the_commanded_arcs(kind: VehicleKind) -> None:
    commands = [(0.5, 0.2), (0.3, -0.4), (-0.2, 0.1), (0.4, 0.0)]
    plant = VehiclePlant((1.0, 2.0), 0.4, kind, PlantOptions(**AT_ONCE))
    for k, (v, omega) in enumerate(commands):
        plant.command(0.4 * k, VelocityCommand(v, omega))
        plant.advance(0.4 * (k + 1))
    xy, theta = roll_out(
        (1.0, 2.0), 0.4, [v for v, _ in commands], [omega for _, omega in commands], 0.4
    )
    assert_allclose(plant.pose(np.linspace(0, 1.6, 5))[0], xy, atol=1e-9)
    assert_allclose(plant.pose(np.linspace(0, 1.6, 5))[1], theta, atol=1e-9)
    assert_allclose(plant.xy, xy[-1], atol=1e-9)
    # Between commands too, and between steps: half an arc is the arc of half the time.
    midway = roll_out(xy[1], float(theta[1]), [0.3], [-0.4], 0.1234)
    at, heading = plant.pose(np.array([0.4 + 0.1234]))
    assert_allclose(at[0], midway[0][-1], atol=1e-9)
    assert_allclose(heading[0], midway[1][-1], atol=1e-9)


def test_what_drives_in_all_directions_goes_sideways_while_it_turns() -> None:
    plant = driven(PlantOptions(**AT_ONCE), VelocityCommand(0.3, 0.5, -0.2), 1.0, "omni")
    t = (np.arange(100_000) + 0.5) / 100_000
    theta = 0.4 + 0.5 * t
    velocity = 0.3 * np.exp(1j * theta) - 0.2 * np.exp(1j * (theta + np.pi / 2))
    assert_allclose(plant.xy - [1.0, 2.0], [velocity.real.mean(), velocity.imag.mean()], atol=1e-8)
    assert plant.lateral == pytest.approx(-0.2)


def test_speed_follows_late_and_with_its_time_constant() -> None:
    o = PlantOptions(
        latency_s=0.1, speed_lag_s=0.2, turn_lag_s=0.05, acceleration_mps2=100, watchdog_s=9
    )
    plant = VehiclePlant((0, 0), 0.0, options=o)
    plant.command(0.0, VelocityCommand(0.5, 1.0))
    plant.advance(1.0)
    t = np.array([0.09, 0.2, 0.3, 0.5])
    since = np.maximum(t - 0.1, 0)
    ground, wheels = plant.motion(t)
    # A step's motion is that of its end: up to 4 ms ahead of the time constant's curve.
    assert_allclose(ground[:, 0], 0.5 * (1 - np.exp(-since / 0.2)), atol=0.5 * 0.004 / 0.2)
    assert_allclose(ground[:, 1], 1 - np.exp(-since / 0.05), atol=0.004 / 0.05)
    assert_allclose(ground, wheels)
    assert ground[0, 0] == 0.0
    assert (plant.v, plant.omega) == pytest.approx((0.5, 1.0), rel=0.02)


@pytest.mark.parametrize("kind", KINDS)
def test_it_keeps_its_own_limits(kind: VehicleKind) -> None:
    o = PlantOptions(speed_mps=0.8, reverse_mps=0.3, turn_rate_radps=2.0, acceleration_mps2=1.0)
    plant = VehiclePlant((0, 0), 0.0, kind, o)
    wild = [(9.0, 9.0), (-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)]
    for k in range(80):
        v, omega = wild[k // 20]
        plant.command(0.05 * k, VelocityCommand(v, omega))
        plant.advance(0.05 * (k + 1))
    t = np.linspace(0, 4, 2001)
    v, omega = plant.motion(t)[0][:, :2].T
    assert v.max() <= 0.8 + 1e-12
    assert v.min() >= -0.8 - 1e-12 if kind == "differential" else v.min() >= -0.3 - 1e-12
    steps = v[50:] - v[:-50]  # over 100 ms, known to a step of 4 ms at either end
    assert np.abs(steps).max() <= 1.0 * 0.108
    assert np.abs(steps).max() >= 1.0 * 0.09
    if kind == "ackermann":
        assert np.abs(omega).max() <= 0.8 * np.tan(0.5) / 0.35 + 1e-12
        assert (np.abs(omega) <= np.abs(v) * np.tan(0.5) / 0.35 + 1e-12).all()
    else:
        assert np.abs(omega).max() <= (2 * 0.8 / 0.35 if kind == "differential" else 2.0) + 1e-12
    assert v.max() > 0.5  # it does use them
    assert v.min() < (-0.05 if kind == "differential" else -0.2)  # its wheels have farther to go


def test_wheels_that_saturate_turn_it_less() -> None:
    o = PlantOptions(speed_mps=0.5, track_width_m=0.4)
    plant = driven(o, VelocityCommand(0.5, 1.0), 3.0, "differential")
    # The outer wheel should do 0.7 m/s and does 0.5; the inner does its 0.3.
    assert plant.v == pytest.approx(0.4, abs=1e-3)
    assert plant.omega == pytest.approx(0.5, abs=1e-3)


def test_a_car_does_not_turn_on_the_spot_and_keeps_its_steering_when_it_stops() -> None:
    assert driven(PlantOptions(), VelocityCommand(0.0, 1.0), 1.0, "ackermann").theta == 0.4
    plant = driven(PlantOptions(), VelocityCommand(0.4, 0.3), 2.0, "ackermann")
    before = plant.omega / plant.v
    plant.command(2.0, STOP)
    plant.advance(2.15)
    assert 0 < plant.v < 0.38
    assert plant.omega / plant.v == pytest.approx(before, rel=1e-6)


def test_it_stops_by_itself_when_nothing_is_heard() -> None:
    o = PlantOptions(latency_s=0.1, watchdog_s=0.5, speed_lag_s=0.0, acceleration_mps2=1e6)
    plant = VehiclePlant((0, 0), 0.0, options=o)
    plant.command(0.0, VelocityCommand(0.5, 0.0))
    plant.advance(3.0)
    assert_allclose(plant.xy, [0.5 * 0.5, 0.0], atol=1e-9)
    assert plant.v == 0.0
    deaf = VehiclePlant(
        (0, 0), 0.0, options=PlantOptions(latency_s=0.1, deaf_s=(0.25, 9.0), watchdog_s=0.5)
    )
    for k in range(20):
        deaf.command(k / 10, VelocityCommand(0.5, 0.0))
        deaf.advance((k + 1) / 10)
    t = np.array([0.75, 2.0])  # the last it heard was sent at 0.2 s
    assert_allclose(deaf.motion(t)[0][:, 0], [0.5, 0.0], atol=0.01)


def test_it_stands_where_it_is_blocked_while_its_wheels_turn() -> None:
    plant = driven(PlantOptions(blocked_s=(1.0, 2.0)), VelocityCommand(0.5, 0.3), 3.0)
    xy, theta = plant.pose(np.array([1.01, 1.99]))
    assert_allclose(xy[0], xy[1], atol=1e-12)
    assert theta[0] == theta[1]
    ground, wheels = plant.motion(np.array([1.5]))
    assert not ground.any()
    assert_allclose(wheels[0, :2], [0.5, 0.3], atol=1e-3)
    assert plant.v == pytest.approx(0.5, abs=1e-3)


def test_wrong_wheels_slip_and_rounding_show_on_the_ground_only() -> None:
    o = PlantOptions(speed_scale=0.9, turn_scale=-1.0, speed_quantum_mps=0.1)
    plant = driven(o, VelocityCommand(0.26, 0.2), 2.0)
    assert (plant.v, plant.omega) == pytest.approx((0.27, -0.2), abs=1e-3)
    assert_allclose(plant.motion(np.array([2.0]))[1][0, :2], [0.3, 0.2], atol=1e-3)
    pulled = driven(PlantOptions(pull_per_m=0.2, side_slip_s=0.5), VelocityCommand(0.5, 0.0), 2.0)
    assert pulled.omega == pytest.approx(0.1, abs=1e-3)
    assert pulled.lateral == pytest.approx(-0.5 * 0.5 * 0.1, abs=1e-3)
    still = driven(
        PlantOptions(dead_band_mps=0.05, dead_band_radps=0.1), VelocityCommand(0.04, 0.09), 1.0
    )
    assert_allclose(still.xy, [1.0, 2.0])
    assert still.theta == 0.4


def test_slip_has_its_size_and_its_correlation_and_is_the_same_however_one_advances() -> None:
    o = PlantOptions(slip=0.1, turn_slip=0.2, slip_s=0.5, watchdog_s=np.inf)
    one, other = (
        VehiclePlant((0, 0), 0.0, options=o, rng=np.random.default_rng(3)) for _ in range(2)
    )
    for plant in (one, other):
        plant.command(0.0, VelocityCommand(0.5, 1.0))
    one.advance(150.0)
    for k in range(1, 200):
        other.advance(k * 0.11)
    assert_allclose(other.xy, one.pose(np.array([other.now]))[0][0], atol=1e-3)
    t = np.arange(1.0, 150.0, 0.05)
    ground, wheels = one.motion(t)
    slip: FloatArray = ground[:, :2] / wheels[:, :2] - 1
    # 150 s hold about 150 independent values: 6 % of the standard deviation; three of those
    # (interpolation on the 50 ms grid takes another 2 %).
    assert_allclose(slip.std(axis=0), [0.1, 0.2], rtol=0.2)
    lag = np.mean(slip[10:] * slip[:-10], axis=0) / np.mean(slip**2, axis=0)
    assert_allclose(lag, np.exp(-1), atol=0.25)  # over 0.5 s
    assert abs(float(np.mean(slip[:, 0] * slip[:, 1]))) < 0.3 * 0.1 * 0.2


def test_it_has_no_future_and_takes_no_late_or_senseless_commands() -> None:
    plant = VehiclePlant((0, 0), 0.0, options=PlantOptions(latency_s=0.05), start_s=10.0)
    plant.advance(10.5)
    plant.command(10.46, STOP)  # takes effect at 10.51
    assert_allclose(plant.pose(np.array([3.0, 10.5]))[0], 0.0)
    for t in (10.51, np.nan):
        with pytest.raises(InputError, match="advance it"):
            plant.pose(np.array([t]))
    for late in (10.4, 10.455, np.nan, np.inf):
        with pytest.raises(InputError, match="too late"):
            plant.command(late, STOP)
    for t in (10.4, np.nan, np.inf):
        with pytest.raises(InputError, match="cannot be driven"):
            plant.advance(t)
    with pytest.raises(InputError, match="finite"):
        plant.command(10.6, VelocityCommand(np.nan, 0.0))
    with pytest.raises(InputError, match="sideways"):
        plant.command(10.6, VelocityCommand(0.0, 0.0, 0.1))


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"speed_mps": 0.0}, "speed_mps"),
        ({"latency_s": -0.1}, "latency_s"),
        ({"slip": np.nan}, "slip"),
        ({"speed_scale": np.inf}, "speed_scale"),
        ({"steering_rad": 2.0}, "steering_rad"),
        ({"watchdog_s": 0.0}, "watchdog_s"),
        ({"blocked_s": (2.0, 1.0)}, "blocked_s"),
    ],
)
def test_senseless_options_are_refused(change: dict[str, Any], word: str) -> None:
    with pytest.raises(InputError, match=word):
        PlantOptions(**change)


def test_a_vehicle_needs_a_kind_a_place_and_chance_for_its_slip() -> None:
    with pytest.raises(InputError, match="kind"):
        VehiclePlant((0, 0), 0.0, "boat")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="start_m"):
        VehiclePlant((0, np.nan), 0.0)
    with pytest.raises(InputError, match="theta"):
        VehiclePlant((0, 0), np.nan)
    with pytest.raises(InputError, match="rng"):
        VehiclePlant((0, 0), 0.0, options=PlantOptions(slip=0.1))
