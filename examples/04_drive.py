"""A robot that goes where the image says: a simulated vehicle, a pilot, a clicked pixel, a sketched path.

Run: python examples/04_drive.py
"""

import numpy as np

from airground import LimitedHomography
from airground.control import (
    Controller,
    Floor,
    Limits,
    PathFollower,
    Pilot,
    PointToPoint,
    SafetyLayer,
    StateFilter,
    StateOptions,
    smooth_sketch,
)
from airground.sim import EyeOptions, Odometer, OdometryNoise, PointEye, VehiclePlant, demo_world

DT = 0.025
LIMITS = Limits(speed_mps=0.3)


def main() -> None:
    rng = np.random.default_rng(0)
    camera = demo_world().camera
    plant = VehiclePlant((0.0, 4.1), 0.8)  # the robot: it slips, lags, and obeys 50 ms late
    eye = PointEye(camera, plant.pose, EyeOptions(latency_s=0.1, sigma_px=0.5), rng)
    odometer = Odometer(plant, OdometryNoise(), rng)

    floor = Floor(
        LimitedHomography(camera.g), np.array([640.0, 400.0])
    )  # or Calibration.load(...).model
    pilot = Pilot(
        StateFilter(floor, StateOptions(actuation_delay_s=0.05)),
        SafetyLayer(floor, LIMITS, covariance=None, image_size_px=(1280, 720)),
    )

    def drive(controller: Controller) -> float:
        pilot.assign(controller)
        begun = plant.now
        for k in range(1, round(60 / DT)):
            t = begun + k * DT
            plant.advance(t)
            for seen in eye.sightings(t):
                pilot.state_filter.see(seen.t, seen.uv)
            for r in odometer.readings(t):
                pilot.state_filter.read(r.t, heading=r.theta, speed=r.v, turn_rate=r.omega)
            tick = pilot.tick(t, DT)
            plant.command(t, tick.command)
            if tick.done:
                break
        return plant.now - begun

    goal = np.array([780.0, 380.0])
    took = drive(PointToPoint(floor, goal[None], LIMITS))
    off = np.hypot(*(camera.project(plant.xy) - goal))
    print(f"at pixel {goal} after {took:.1f} s, {off:.1f} px off")

    u = np.linspace(780, 500, 40)  # drawn with a trembling hand
    sketch = np.column_stack([u, 380 + 70 * np.sin((780 - u) / 60)]) + rng.normal(0, 1.5, (40, 2))
    path = smooth_sketch(floor, sketch, LIMITS)
    print(
        f"the sketch became {path.length:.2f} m in {path.duration:.1f} s, {path.max_deviation_px:.1f} px beside it"
    )
    took = drive(PathFollower(path, LIMITS))
    off = np.hypot(*(camera.project(plant.xy) - path.uv[-1]))
    print(f"followed in {took:.1f} s, stopped {off:.1f} px off its end")
    print(
        f"stops for safety on the way: {[stop.line for stop in pilot.memory.stops if stop.t > 0.2]}"
    )


if __name__ == "__main__":
    main()
