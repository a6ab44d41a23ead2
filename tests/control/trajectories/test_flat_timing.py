"""A trajectory's clock against the motion that it gives on the ground of a pinhole camera."""

from __future__ import annotations

import numpy as np

from airground.control import Floor, Limits
from airground.control.trajectories.flat_timing import plan_timing
from airground.control.trajectories.trajectory import GroundEllipse
from airground.geometry import LimitedHomography
from airground.sim import demo_world

CAMERA = demo_world().camera
FLOOR = Floor(LimitedHomography(CAMERA.g), CAMERA.project([0.0, 4.1]))


def test_the_planned_motion_is_within_limits_and_no_slower_than_needed() -> None:
    limits = Limits(lateral_acceleration_mps2=0.3, turn_rate_radps=1.0)
    narrow = GroundEllipse(FLOOR, CAMERA.project([0.0, 4.1]), (1.6, 0.3), 6.0)
    timing = plan_timing(FLOOR, narrow, limits, reverse=True)
    assert timing.repeats
    assert timing.span_s == 6.0
    assert set(timing.gears) == {1.0}
    times = np.linspace(0.0, 6.0, 1201)
    xy = CAMERA.unproject([narrow.at(t)[0] for t in times])
    steps = np.diff(xy, axis=0)
    way = np.hypot(*steps.T)
    rate = np.array([timing.at(t)[0] for t in (times[1:] + times[:-1]) / 2])
    speed = rate * way / 0.005
    curvature = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))) / way[1:]
    lateral = speed[1:] ** 2 * np.abs(curvature)
    gain = np.diff(speed**2) / 2 / way[1:]
    assert speed.max() <= 0.9 * 0.5 + 1e-3
    # The plan's grid is of 0.02 s, between its points it is a little off.
    assert lateral.max() <= 0.9 * 0.3 + 0.01
    assert (speed[1:] * np.abs(curvature)).max() <= 0.9 + 0.02
    assert gain.max() <= 0.7 * limits.acceleration_mps2 + 0.05
    assert gain.min() >= -0.7 * limits.deceleration_mps2 - 0.05
    assert speed.max() > 0.42  # on the straights it is driven out
    assert timing.at(6.0 + 1.3) == timing.at(1.3)


def test_what_ends_is_braked_for() -> None:
    once = GroundEllipse(FLOOR, CAMERA.project([0.0, 4.1]), (1.5, 0.9), 20.0, turns=1.0)
    timing = plan_timing(FLOOR, once, Limits(), reverse=True)
    assert timing.at(10.0)[0] == 1.0
    assert timing.at(19.99)[0] < 0.3
    assert timing.at(20.0)[0] > 0
