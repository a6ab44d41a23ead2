"""Filter, controller and safety as one step: what is sent is what the filter is told, and a stop holds progress."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from airground.control import STOP, Floor, Guidance, Limits, RobotState, VelocityCommand
from airground.control.estimation.options import StateOptions
from airground.control.estimation.state_filter import StateFilter
from airground.control.goals import PointToPoint
from airground.control.pilot import Links, Pilot
from airground.control.safety.layer import SafetyLayer
from airground.control.safety.types import StopReason
from airground.control.separation import Fence
from airground.geometry import LimitedHomography
from airground.sim import demo_world
from airground.sim.point_eye import EyeOptions, PointEye
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant

CAMERA = demo_world().camera
DT = 0.025


class Forward:
    """Drives on for ever, and counts its steps in its progress."""

    def step(self, state: RobotState, progress: float, dt: float) -> Guidance:  # noqa: ARG002
        command = VelocityCommand(0.2, 0.0)
        return Guidance(command, progress + 1, False, 0.0, 0.0, state.uv)


@pytest.fixture
def pilot() -> Pilot:
    floor = Floor(LimitedHomography(CAMERA.g), np.array([640.0, 400.0]))
    options = StateOptions(actuation_delay_s=0.05)
    return Pilot(StateFilter(floor, options), SafetyLayer(floor, Limits(), None))


def run(
    pilot: Pilot, first: int, last: int, *, seen: bool = True, stop: bool = False
) -> list[float]:
    """Ticks of a robot that stands and is seen; the speeds that were sent."""
    sent = []
    for k in range(first, last):
        t = k * DT
        if seen:
            pilot.state_filter.see(t - 0.02, CAMERA.project(np.array([0.0, 4.0])))
            pilot.state_filter.read(t - 0.02, heading=0.0, speed=0.0, turn_rate=0.0)
        tick = pilot.tick(t, DT, Links(frame_t=t - 0.02 if seen else None, stop=stop))
        sent.append(tick.sent.command.v)
    return sent


def test_it_starts_when_it_knows_where_the_robot_is(pilot: Pilot) -> None:
    assert pilot.tick(0.0, DT).sent.stop is not None  # nothing seen yet
    pilot.assign(Forward())
    sent = run(pilot, 1, 40)
    assert sent[0] == 0
    assert max(sent) == pytest.approx(0.2)
    assert np.diff(sent).max() <= 0.5 * DT + 1e-9  # the limits' acceleration


def test_without_an_order_it_stands(pilot: Pilot) -> None:
    assert set(run(pilot, 0, 40)) == {0.0}
    pilot.assign(Forward())
    run(pilot, 40, 80)
    pilot.assign(None)
    assert run(pilot, 80, 120)[-1] == 0.0


def test_a_lost_robot_is_stopped_and_its_progress_held(pilot: Pilot) -> None:
    pilot.assign(Forward())
    run(pilot, 0, 40)
    lost = run(pilot, 40, 70, seen=False)  # 0.75 s; the track may be 0.5 s old
    assert lost[-1] == 0.0
    held = pilot.progress
    run(pilot, 70, 75, seen=False)
    assert pilot.progress == held
    assert any(stop.reason is StopReason.TRACK for stop in pilot.memory.stops)


def test_the_operators_stop_waits_for_a_release(pilot: Pilot) -> None:
    pilot.assign(Forward())
    run(pilot, 0, 40)
    assert run(pilot, 40, 41, stop=True) == [0.0]  # within one tick
    assert set(run(pilot, 41, 80)) == {0.0}
    pilot.release()
    assert max(run(pilot, 80, 120)) > 0.1


def test_the_filter_knows_what_was_sent_not_what_was_wanted(pilot: Pilot) -> None:
    told: list[VelocityCommand] = []

    def sent(_: float, command: VelocityCommand) -> bool:
        told.append(command)
        return True

    pilot.state_filter.sent = sent  # type: ignore[method-assign, assignment]
    pilot.assign(Forward())
    ticks = [pilot.tick(k * DT, DT) for k in range(3)]  # nothing is known: all are stops
    assert told == [tick.sent.command for tick in ticks] == [STOP] * 3


def compassless(pilot: Pilot, *, seconds: float, blocked: bool = False) -> VehiclePlant:
    """A robot that tells nothing of itself, asked to go to a pixel."""
    plant = VehiclePlant((0.0, 4.0), 0.7, options=PlantOptions(latency_s=0.05))
    eye = PointEye(
        CAMERA, plant.pose, EyeOptions(latency_s=0.05, sigma_px=0.3), np.random.default_rng(3)
    )
    goal = CAMERA.project(np.array([-0.8, 4.3]))
    pilot.assign(PointToPoint(pilot.state_filter.floor, goal[None], Limits(), tolerance_m=0.02))
    for k in range(round(seconds / DT)):
        t = k * DT
        plant.advance(t)
        for seen in eye.sightings(t):
            pilot.state_filter.see(seen.t, seen.uv)
        tick = pilot.tick(t, DT, Links(frame_t=t))
        if tick.wish.searching:
            assert abs(tick.sent.command.v) <= pilot.safety.bounds.search_mps
            assert tick.sent.command.omega == 0
        plant.command(t, STOP if blocked else tick.command)
        if tick.done:
            break
    return plant


def test_without_a_compass_it_looks_for_its_heading_and_then_arrives(pilot: Pilot) -> None:
    plant = compassless(pilot, seconds=30.0)
    assert np.hypot(*(plant.xy - [-0.8, 4.3])) < 0.04


def test_it_does_not_look_for_its_heading_where_that_is_forbidden(pilot: Pilot) -> None:
    layer = replace(pilot.safety, bounds=replace(pilot.safety.bounds, search_mps=0.0))
    plant = compassless(Pilot(pilot.state_filter, layer), seconds=3.0)
    assert_allclose(plant.xy, [0.0, 4.0])


def test_beside_the_fence_it_does_not_look_for_its_heading(pilot: Pilot) -> None:
    floor = pilot.state_filter.floor
    corners = np.array([[-0.3, 3.0], [2.0, 3.0], [2.0, 5.0], [-0.3, 5.0]])  # 0.3 m from the robot
    fence = Fence(floor, (CAMERA.project(corners),))
    layer = SafetyLayer(floor, Limits(), None, fence=fence)
    searcher = Pilot(pilot.state_filter, layer)
    plant = compassless(searcher, seconds=3.0)
    assert_allclose(plant.xy, [0.0, 4.0])
    assert any(stop.reason is StopReason.LEAVING for stop in searcher.memory.stops)
