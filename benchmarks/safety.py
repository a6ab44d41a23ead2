"""Time of one tick of the safety layer, and how soon it notices what is wrong with a robot.

Prints what a tick takes with all its checks, and for each fault the time from its start to the stop, over seeds.
"""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from airground.control import Floor, Limits, RobotState, VelocityCommand
from airground.control.safety.bounds import SafetyBounds
from airground.control.safety.layer import SafetyLayer
from airground.control.safety.types import SafetyMemory, Situation, StopReason
from airground.control.separation.fence import Fence
from airground.geometry import LimitedHomography
from airground.sim import demo_world
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant

CAMERA = demo_world().camera
FLOOR = Floor(LimitedHomography(CAMERA.g), np.array([640.0, 400.0]))
FENCE = Fence(FLOOR, (np.array([[100.0, 150.0], [1200.0, 150.0], [1250.0, 700.0], [30.0, 700.0]]),))
COVARIANCE = np.diag((2e-3 * CAMERA.g.ravel()) ** 2)
TICK = 1 / 30
FAULT_S = 4.0

FAULTS: dict[str, dict[str, Any]] = {
    "honest, 5 % slip": {},
    "honest, 10 % slip, slow motors": {"slip": 0.1, "turn_slip": 0.1, "speed_lag_s": 0.3},
    "blocked": {"blocked_s": (FAULT_S, 99.0)},
    "radio gone, robot drives on": {"deaf_s": (FAULT_S, 99.0), "watchdog_s": np.inf},
    "motors reversed": {"speed_scale": -1.0},
    "turns the wrong way": {"turn_scale": -1.0},
    "twice as fast": {"speed_scale": 2.0},
}


def tick_times() -> np.ndarray:
    """One tick with every check, of a robot that drives a circle."""
    layer = SafetyLayer(FLOOR, Limits(), COVARIANCE, SafetyBounds(), FENCE, (1280, 720))
    memory, xy, theta, times = SafetyMemory(), np.zeros(2), 0.0, []
    for k in range(3000):
        t, told = k * TICK, memory.sent
        theta += TICK * told.omega
        xy = xy + TICK * told.v * np.array([np.cos(theta), np.sin(theta)])
        state = RobotState(
            t, FLOOR.pixel(xy), theta, told.v, told.omega, covariance=np.eye(5) * 1e-4, seen_t=t
        )
        now = Situation(t, state, frame_t=t, operator_t=t, robot_t=t)
        start = perf_counter()
        memory = layer.check(VelocityCommand(0.3, 0.8), now, memory).memory
        times.append(perf_counter() - start)
    assert memory.going
    return np.array(times)


def noticed_after(options: dict[str, Any], seed: int) -> float:
    """Drive towards changing wishes; seconds from a fault to the stop for disobedience, NaN where there is none."""
    rng = np.random.default_rng(seed)
    nature = PlantOptions(**{"slip": 0.05, "turn_slip": 0.05, **options})
    plant = VehiclePlant((0.0, 4.0), rng.uniform(0, 6), options=nature, rng=rng)
    layer = SafetyLayer(FLOOR, Limits(), COVARIANCE)
    memory, wish = SafetyMemory(), VelocityCommand(0.3, 0.5)
    for _ in range(round(30 / TICK)):
        if rng.random() < TICK / 2:
            wish = VelocityCommand(
                rng.uniform(0.15, 0.5), rng.choice([-1, 1]) * rng.uniform(0.4, 1)
            )
        t, off = plant.now, rng.normal(0.0, 0.007, 3)
        state = RobotState(
            t,
            CAMERA.project(plant.xy + off[:2]),
            plant.theta + off[2],
            covariance=np.eye(5) * 0.007**2,
            seen_t=t,
        )
        memory = layer.check(wish, Situation(t, state), memory).memory
        if StopReason.DISOBEDIENCE in memory.latched:
            late = {"blocked_s", "deaf_s"} & options.keys()
            return t - (FAULT_S if late else 0.0)
        plant.command(t, memory.sent)
        plant.advance(t + TICK)
    return float("nan")


def main() -> None:
    """Print both tables."""
    times = tick_times() * 1e6
    low, middle, high = np.percentile(times, [5, 50, 95])
    print(f"tick [us]: median {middle:.0f}, 5 % {low:.0f}, 95 % {high:.0f}")
    print(f"\n{'robot':32} noticed  after [s]: median  longest")
    for name, options in FAULTS.items():
        after = np.array([noticed_after(options, seed) for seed in range(12)])
        found = after[~np.isnan(after)]
        numbers = f"{np.median(found):17.1f} {found.max():8.1f}" if len(found) else ""
        print(f"{name:32} {len(found):3}/{len(after)}  {numbers}", flush=True)


if __name__ == "__main__":
    main()
