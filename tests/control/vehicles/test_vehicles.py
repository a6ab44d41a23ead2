"""Vehicles against rigid-body motion of their wheels, put down by hand."""

from __future__ import annotations

from math import pi, tan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from airground.control import Limits, VelocityCommand
from airground.control.vehicles.car import Ackermann, SpeedSteering
from airground.control.vehicles.omni import Omnidirectional
from airground.control.vehicles.wheels import DifferentialDrive, Unicycle, WheelSpeeds
from airground.errors import InputError

speeds = st.floats(-3, 3).map(lambda x: round(x, 6))
commands = st.builds(VelocityCommand, v=speeds, omega=speeds, lateral=speeds)

DIFF: dict[str, Any] = {"wheel_radius_m": 0.05, "track_width_m": 0.3}
MECANUM: dict[str, Any] = {"wheel_radius_m": 0.05, "wheelbase_m": 0.4, "track_width_m": 0.3}


def hub(command: VelocityCommand, x: float, y: float, *, clockwise: bool) -> np.ndarray:
    """Velocity of a point of a rigid body: x forwards, y to the left."""
    sign = -1 if clockwise else 1
    turn, left = sign * command.omega, sign * command.lateral
    return np.array([command.v - turn * y, left + turn * x])


@given(commands, st.booleans())
def test_driven_wheels_roll_as_their_hubs_move(command: VelocityCommand, clockwise: bool) -> None:
    vehicle = DifferentialDrive(**DIFF, clockwise=clockwise)
    wheels = vehicle.to_vehicle(command)
    flat = VelocityCommand(command.v, command.omega)
    assert wheels.left * 0.05 == pytest.approx(hub(flat, 0, 0.15, clockwise=clockwise)[0])
    assert wheels.right * 0.05 == pytest.approx(hub(flat, 0, -0.15, clockwise=clockwise)[0])
    back = vehicle.from_vehicle(wheels)
    assert (back.v, back.omega) == pytest.approx((command.v, command.omega), abs=1e-12)


@given(commands, st.booleans())
def test_a_cars_front_wheel_points_where_its_hub_goes(
    command: VelocityCommand, clockwise: bool
) -> None:
    car = Ackermann(wheelbase_m=0.5, max_steering_rad=1.5, clockwise=clockwise)
    can = car.feasible(command)
    told = car.to_vehicle(can)
    front = hub(can, 0.5, 0.0, clockwise=clockwise)
    assert front[0] * tan(told.steering) == pytest.approx(front[1], abs=1e-9)
    back = car.from_vehicle(told)
    assert (back.v, back.omega, back.lateral) == pytest.approx((can.v, can.omega, 0.0), abs=1e-9)


@given(commands, st.booleans())
def test_rollers_do_not_slip(command: VelocityCommand, clockwise: bool) -> None:
    mecanum = Omnidirectional.mecanum(**MECANUM, clockwise=clockwise)
    # Where each wheel is, and the direction in which its rollers let it slide: of those above, an X; on the ground, a
    # diamond.
    wheels = [(0.2, 0.15, -1), (0.2, -0.15, 1), (-0.2, 0.15, 1), (-0.2, -0.15, -1)]
    for (x, y, slope), speed in zip(wheels, mecanum.to_vehicle(command), strict=True):
        slip = hub(command, x, y, clockwise=clockwise) - [0.05 * speed, 0.0]
        grip = np.array([1.0, slope])  # the roller's axle, along which nothing slides
        assert abs(slip @ grip) < 1e-9
    bearings = (0.0, 2 * pi / 3, 4 * pi / 3)
    omni = Omnidirectional.omni_wheels(
        wheel_radius_m=0.05, distance_m=0.2, bearings_rad=bearings, clockwise=clockwise
    )
    for b, speed in zip(bearings, omni.to_vehicle(command), strict=True):
        velocity = hub(command, 0.2 * np.cos(b), 0.2 * np.sin(b), clockwise=clockwise)
        assert velocity @ [-np.sin(b), np.cos(b)] == pytest.approx(0.05 * speed, abs=1e-9)
    for vehicle in (mecanum, omni):
        back = vehicle.from_vehicle(vehicle.to_vehicle(command))
        assert_allclose(
            [back.v, back.omega, back.lateral],
            [command.v, command.omega, command.lateral],
            atol=1e-9,
        )


@given(commands)
def test_what_is_feasible_is_on_the_same_curve_and_no_wheel_too_fast(
    command: VelocityCommand,
) -> None:
    for vehicle in (
        DifferentialDrive(**DIFF, wheel_speed_radps=10.0),
        Omnidirectional.mecanum(**MECANUM, wheel_speed_radps=10.0),
    ):
        can = vehicle.feasible(command)
        assert can.v * command.omega == pytest.approx(can.omega * command.v, abs=1e-9)
        assert abs(can.v) <= abs(command.v)
        again = vehicle.feasible(can)
        assert (again.v, again.omega) == pytest.approx((can.v, can.omega))
        told = vehicle.to_vehicle(can)
        wheels = (told.left, told.right) if isinstance(told, WheelSpeeds) else told
        fastest = max(map(abs, wheels))
        assert fastest <= 10 * (1 + 1e-12)
        if (can.v, can.omega) != (command.v, command.omega):
            assert fastest == pytest.approx(10)  # no slower than need be
    assert Unicycle().feasible(command) == VelocityCommand(command.v, command.omega)
    car = Ackermann(0.5, 0.6)
    can = car.feasible(command)
    assert can.v == command.v
    assert abs(can.omega) * car.turn_radius_m <= abs(can.v) * (1 + 1e-12)
    assert can.omega * command.omega >= 0


def test_left_and_right_and_the_sense_of_headings() -> None:
    left = VelocityCommand(0.5, 1.0)
    wheels = DifferentialDrive(**DIFF).to_vehicle(left)
    assert wheels.right > wheels.left
    mirrored = DifferentialDrive(**DIFF, clockwise=True).to_vehicle(left)
    assert (mirrored.left, mirrored.right) == (wheels.right, wheels.left)
    assert Ackermann(0.5, 0.6).to_vehicle(left).steering > 0
    assert Ackermann(0.5, 0.6, clockwise=True).to_vehicle(left).steering < 0
    assert Ackermann(0.5, 0.6).to_vehicle(VelocityCommand(-0.5, 1.0)).steering < 0  # in reverse
    assert Ackermann(0.5, 0.6).to_vehicle(VelocityCommand(0.0, 1.0)) == SpeedSteering(0.0, 0.0)
    sideways = Omnidirectional.mecanum(**MECANUM).to_vehicle(VelocityCommand(0, 0, lateral=1.0))
    assert np.sign(sideways).tolist() == [-1, 1, 1, -1]


def test_limits_of_the_build() -> None:
    base = Limits(speed_mps=2.0, reverse_mps=0.2, turn_rate_radps=9.0)
    limits = DifferentialDrive(**DIFF, wheel_speed_radps=10.0).limits(base)
    assert (limits.speed_mps, limits.reverse_mps) == (0.5, 0.2)
    assert limits.turn_rate_radps == pytest.approx(2 * 0.5 / 0.3)
    car = Ackermann(0.5, np.arctan(0.5)).limits(base)
    assert car.turn_radius_m == pytest.approx(1.0)
    omni = Omnidirectional.mecanum(**MECANUM, wheel_speed_radps=10.0).limits(base)
    for angle in np.linspace(0, 2 * pi, 33):  # in every direction
        command = VelocityCommand(
            omni.speed_mps * np.cos(angle), 0.0, omni.speed_mps * np.sin(angle)
        )
        told = Omnidirectional.mecanum(**MECANUM).to_vehicle(command)
        assert max(map(abs, told)) <= 10 + 1e-9
    assert omni.turn_rate_radps == pytest.approx(10 * 0.05 / 0.35)
    assert Unicycle().limits(base) is base


def test_what_cannot_be_built_is_refused() -> None:
    with pytest.raises(InputError, match="track_width_m"):
        DifferentialDrive(0.05, 0.0)
    with pytest.raises(InputError, match="max_steering_rad"):
        Ackermann(0.5, 1.6)
    with pytest.raises(InputError, match="wheelbase_m"):
        Omnidirectional.mecanum(wheel_radius_m=0.05, wheelbase_m=np.nan, track_width_m=0.3)
    with pytest.raises(InputError, match="all directions"):
        Omnidirectional.omni_wheels(wheel_radius_m=0.05, distance_m=0.2, bearings_rad=(0.0, pi))
    with pytest.raises(InputError, match="shape"):
        Omnidirectional.mecanum(**MECANUM).from_vehicle((1.0, 2.0))
