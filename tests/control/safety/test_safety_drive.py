"""The safety layer on simulated vehicles: no false alarm for honest ones, and none that is wrong goes unnoticed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np
import pytest

from airground.control import Floor, Limits, RobotState, VelocityCommand
from airground.control.safety.bounds import SafetyBounds
from airground.control.safety.layer import SafetyLayer
from airground.control.safety.types import SafetyMemory, Sent, Situation, StopReason
from airground.control.separation.fence import Fence
from airground.geometry import LimitedHomography
from airground.sim import demo_world
from airground.sim.vehicle_drives import VehicleKind
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant

CAMERA = demo_world().camera
FLOOR = Floor(LimitedHomography(CAMERA.g), np.array([640.0, 400.0]))
CORNERS = FLOOR.pixel(np.array([[-0.8, -1.2], [1.0, -1.2], [1.0, 0.6], [-0.8, 0.6]]))
FENCE = Fence(FLOOR, (CORNERS,))
TICK = 0.05
REACTS = SafetyBounds(reaction_s=TICK + 0.05 + 0.12)  # and the vehicle's latency and lag
SIGMA_M = 0.005


@dataclass
class Rig:
    """A vehicle, a layer, and somebody who wants something of it."""

    rng: np.random.Generator
    kind: VehicleKind = "unicycle"
    options: dict[str, Any] = field(default_factory=dict)
    fence: Fence | None = None
    bounds: SafetyBounds = field(default_factory=SafetyBounds)
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        self.plant = VehiclePlant(
            CAMERA.unproject([640.0, 500.0]),
            0.5,
            self.kind,
            PlantOptions(**{"slip": 0.05, "turn_slip": 0.05, **self.options}),
            rng=self.rng,
        )
        self.layer = SafetyLayer(FLOOR, self.limits, None, self.bounds, self.fence)
        self.memory = SafetyMemory()
        self.wanted = VelocityCommand(0.0, 0.0)

    def tick(self, wanted: VelocityCommand) -> Sent:
        plant, noise = self.plant, self.rng.normal(0.0, SIGMA_M, 3)
        t = plant.now
        state = RobotState(
            t,
            CAMERA.project(plant.xy + noise[:2]),
            plant.theta + noise[2],
            plant.v,
            plant.omega,
            plant.lateral,
            covariance=np.eye(5) * SIGMA_M**2,
            seen_t=t,
        )
        sent = self.layer.check(wanted, Situation(t, state), self.memory)
        self.memory = sent.memory
        plant.command(t, sent.command)
        plant.advance(t + TICK)
        return sent

    def wander(self, seconds: float, fastest: float = 0.6) -> list[Sent]:
        """Want something else about every second."""
        out = []
        for _ in range(round(seconds / TICK)):
            if self.rng.random() < TICK:
                v, omega, side = self.rng.uniform(-1, 1, 3)
                side *= 0.3 * (self.kind == "omni")
                self.wanted = VelocityCommand(fastest * (v + 0.4), 1.5 * omega, side)
            out.append(self.tick(self.wanted))
        return out


@pytest.mark.parametrize("kind", get_args(VehicleKind))
def test_honest_vehicles_raise_no_alarm_and_stay_inside(
    kind: VehicleKind, rng: np.random.Generator
) -> None:
    radius = 0.35 / np.tan(0.5) if kind == "ackermann" else 0.0
    rig = Rig(rng, kind, {"pull_per_m": 0.05}, FENCE, REACTS, Limits(turn_radius_m=radius))
    sent = rig.wander(20.0)
    assert set(rig.memory.counts) == {StopReason.LEAVING}, rig.memory.stops
    assert rig.memory.counts[StopReason.LEAVING] >= 2
    # On its way it was stopped before the fence, by braking no harder than its limits say.
    t = np.linspace(0.0, rig.plant.now, 3000)
    xy, _ = rig.plant.pose(t)
    assert FENCE.clearance(FLOOR.position(CAMERA.project(xy))).min() > 0
    moving = np.mean([s.stop is None for s in sent])
    assert moving > 0.3


@pytest.mark.parametrize(
    ("options", "within_s"),
    [
        ({"blocked_s": (3.0, 99.0)}, 3.0),
        ({"speed_scale": -1.0}, 3.0),
        ({"turn_scale": -1.0}, 3.0),
        ({"speed_scale": 2.5}, 3.0),
        ({"deaf_s": (3.0, 99.0), "watchdog_s": np.inf}, 4.0),
    ],
)
def test_a_vehicle_that_does_something_else_is_stopped(
    options: dict[str, Any], within_s: float, rng: np.random.Generator
) -> None:
    rig = Rig(rng, options=options)
    start = 3.0 if options.keys() & {"blocked_s", "deaf_s"} else 0.3
    last: Sent | None = None
    for k in range(round((start + within_s) / TICK)):
        # In turns, so that a vehicle that has become deaf is told something else.
        last = rig.tick(VelocityCommand(0.3, 0.9 if k * TICK < 3 else -0.9))
        if k * TICK < start:
            assert StopReason.DISOBEDIENCE not in rig.memory.counts
    assert last is not None
    assert last.command.at_rest
    assert rig.memory.latched == {StopReason.DISOBEDIENCE}
    line = next(s.line for s in rig.memory.stops if s.reason is StopReason.DISOBEDIENCE)
    assert line.startswith("told ")


def test_the_wrong_robot_is_noticed_and_a_carried_one_at_the_start_is_not(
    rng: np.random.Generator,
) -> None:
    rig, other = Rig(rng), Rig(rng)
    for _ in range(80):
        rig.plant, mine = other.plant, rig.plant  # what is seen is the other one
        t = other.plant.now
        other.plant.command(t, VelocityCommand(0.0, 0.0))
        sent = rig.layer.check(
            VelocityCommand(0.4, 0.0),
            Situation(
                t,
                RobotState(
                    t, CAMERA.project(other.plant.xy), 0.5, covariance=np.eye(5) * 1e-5, seen_t=t
                ),
            ),
            rig.memory,
        )
        rig.memory, rig.plant = sent.memory, mine
        other.plant.advance(t + TICK)
    assert StopReason.DISOBEDIENCE in rig.memory.latched

    carried = SafetyMemory()
    layer = SafetyLayer(FLOOR, Limits(), None, SafetyBounds(good_ticks=1000))
    for k in range(60):
        uv = FLOOR.pixel(np.array([0.4 * TICK * k, 0.0]))
        state = RobotState(k * TICK, uv, 0.0, covariance=np.eye(5) * 1e-5, seen_t=k * TICK)
        carried = layer.check(VelocityCommand(0.0, 0.0), Situation(k * TICK, state), carried).memory
    assert carried.latched == frozenset()


def test_what_counts_is_the_way_to_rest(rng: np.random.Generator) -> None:
    """Not a circle around the robot, nor a chord: some come to rest inside and pass outside."""
    wall = FLOOR.pixel(np.array([[-1.0, -0.06], [1.5, -0.06], [1.5, 1.5], [-1.0, 1.5]]))
    limits = Limits(
        speed_mps=1.0, reverse_mps=1.0, turn_rate_radps=9.0, lateral_acceleration_mps2=9.0
    )
    bounds = SafetyBounds(fence_sigmas=0.0, reaction_s=0.2)
    layer = SafetyLayer(FLOOR, limits, None, bounds, Fence(FLOOR, (wall,)))
    found = []
    for _ in range(150):
        theta, v, omega = rng.uniform(-np.pi, np.pi), rng.choice([-1, 1]) * 0.6, rng.uniform(-8, 8)
        length = 0.6 * 0.2 + 0.6**2 / (2 * 0.8)  # driven on, then braked
        way = (np.arange(2000) + 0.5) / 2000 * length  # the midpoint rule along the arc
        y = np.cumsum(np.sign(v) * np.sin(theta + omega * way / 0.6)) * length / 2000
        if abs(y.min() + 0.06) < 0.005:
            continue
        command = VelocityCommand(v, omega)
        state = RobotState(
            TICK, FLOOR.origin_uv, theta, v, omega, covariance=np.eye(5) * 1e-8, seen_t=TICK
        )
        memory = SafetyMemory(t=0.0, held=frozenset(), sent=command)
        sent = layer.check(command, Situation(TICK, state), memory)
        leaves = bool(y.min() < -0.06)
        assert [s.reason for s in sent.causes] == [StopReason.LEAVING] * leaves, (theta, v, omega)
        found.append((leaves, bool(y[-1] < -0.06)))
    # Some pass outside and would come to rest inside.
    assert set(found) == {(True, True), (True, False), (False, False)}


def test_one_that_noise_took_too_near_may_go_inwards() -> None:
    wall = FLOOR.pixel(np.array([[-1.0, -0.01], [1.5, -0.01], [1.5, 1.5], [-1.0, 1.5]]))
    layer = SafetyLayer(FLOOR, Limits(), None, SafetyBounds(), Fence(FLOOR, (wall,)))
    for theta, stops in ((1.0, False), (0.0, False), (-1.0, True)):
        state = RobotState(
            TICK, FLOOR.origin_uv, theta, covariance=np.eye(5) * 0.02**2, seen_t=TICK
        )
        memory = SafetyMemory(t=0.0, held=frozenset(), sent=VelocityCommand(0.2, 0.0))
        sent = layer.check(VelocityCommand(0.2, 0.0), Situation(TICK, state), memory)
        assert (sent.stop is not None) == stops
