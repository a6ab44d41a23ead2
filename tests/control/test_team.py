"""Two robots that would meet head on: seen late and with noise, steered by their pilots, kept apart."""

from __future__ import annotations

import numpy as np
import pytest

from airground.control import Floor, Limits
from airground.control.estimation.options import StateOptions
from airground.control.estimation.state_filter import StateFilter
from airground.control.goals.point_to_point import PointToPoint
from airground.control.pilot import Links, Pilot
from airground.control.safety.layer import SafetyLayer
from airground.control.separation.filter import SeparationFilter
from airground.control.team import Team, TeamMember
from airground.errors import InputError
from airground.geometry import LimitedHomography
from airground.sim import demo_world
from airground.sim.point_eye import EyeOptions, PointEye
from airground.sim.vehicle_odometry import Odometer, OdometryNoise
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant

CAMERA = demo_world().camera
LIMITS = Limits(speed_mps=0.3)
RADIUS_M = 0.25
DT = 0.05
ENDS = {"left": ((-1.5, 4.0), (1.5, 4.02)), "right": ((1.5, 4.0), (-1.5, 3.98))}


def pilot(floor: Floor) -> Pilot:
    options = StateOptions(actuation_delay_s=0.05, speed_lag_s=0.12, heading_sigma_rad=0.02)
    return Pilot(StateFilter(floor, options), SafetyLayer(floor, LIMITS, None))


def test_two_that_meet_head_on_pass_each_other(rng: np.random.Generator) -> None:
    floor = Floor(LimitedHomography(CAMERA.g), CAMERA.project(np.array([0.0, 4.0])))
    members, plants, eyes, odometers = {}, {}, {}, {}
    for name, (start, goal) in ENDS.items():
        one, two = rng.spawn(2)
        heading = 0.0 if name == "left" else np.pi
        plants[name] = VehiclePlant(start, heading, options=PlantOptions())
        eyes[name] = PointEye(
            CAMERA, plants[name].pose, EyeOptions(latency_s=0.1, sigma_px=0.5), one
        )
        odometers[name] = Odometer(plants[name], OdometryNoise(), two)
        members[name] = TeamMember(pilot(floor), RADIUS_M)
        aim = CAMERA.project(np.array(goal))
        members[name].pilot.assign(
            PointToPoint(floor, aim[None], LIMITS, tolerance_m=0.03, response_s=0.15)
        )
    team = Team(members, SeparationFilter())
    nearest, arrived = np.inf, set()
    for k in range(round(30 / DT)):
        t = k * DT
        for name, member in members.items():
            plants[name].advance(t)
            for seen in eyes[name].sightings(t):
                member.pilot.state_filter.see(seen.t, seen.uv)
            for r in odometers[name].readings(t):
                member.pilot.state_filter.read(r.t, heading=r.theta, speed=r.v, turn_rate=r.omega)
        answer = team.tick(t, DT, {name: Links(frame_t=t - 0.1) for name in members})
        for name, tick in answer.ticks.items():
            plants[name].command(t, tick.command)
            if tick.done:
                arrived.add(name)
        nearest = min(nearest, float(np.hypot(*(plants["left"].xy - plants["right"].xy))))
        if len(arrived) == 2:
            break
    assert arrived == {"left", "right"}
    assert nearest > 2 * RADIUS_M  # their discs never touch
    for name, (_, goal) in ENDS.items():
        assert np.hypot(*(plants[name].xy - goal)) < 0.05


def test_one_floor_for_all() -> None:
    model = LimitedHomography(CAMERA.g)
    floors = [Floor(model, np.array([640.0, v])) for v in (400.0, 500.0)]
    members = {str(k): TeamMember(pilot(floor), RADIUS_M) for k, floor in enumerate(floors)}
    with pytest.raises(InputError, match="one floor"):
        Team(members, SeparationFilter())
