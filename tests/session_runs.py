"""Sessions in the embedded world and in simulated time, whose camera is known from the start."""

from __future__ import annotations

from dataclasses import replace
from math import hypot
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import Calibration
from airground.calibration.calibration import Fit
from airground.calibration.observability import Observability
from airground.geometry import LimitedHomography
from airground.session.options import SessionOptions
from airground.session.orders import DriveTo
from airground.session.stepped import SteppedSession, embedded_robots
from airground.sim.live_options import EmbeddedOptions
from airground.sim.live_world import EmbeddedWorld
from airground.sim.vehicle_odometry import OdometryNoise

if TYPE_CHECKING:
    from airground.session.tick import RobotView

GOOD_WHEELS = OdometryNoise(speed_share=0.02)
"""Speeds off by 2 % that changes slowly."""

SIGMA = 0.003
"""Relative deviation that the calibration of tests states."""

RED_GOAL, BLUE_GOAL = (822.0, 227.0), (1112.0, 431.0)
"""Three metres straight ahead of the one; behind the other."""
STANDS_MPS = 0.02


def known_calibration(world: EmbeddedWorld) -> Calibration:
    """The truth, as a calibration that is good to a third of a percent."""
    camera = world.camera
    width, height = camera.image_size_px
    model = LimitedHomography(camera.g)
    return Calibration(
        model=model,
        covariance=np.diag((SIGMA / 3 * np.abs(model.g).ravel()) ** 2),
        origin_px=np.array([width / 2, height / 2]),
        fit=Fit("trajectory", 0.3, 1000, 1.0),
        observability=Observability("ok", SIGMA, (1.0,) * 6, ""),
        time_offset_s=world.time_offset_s,
        image_size_px=(width, height),
    )


def session(
    robots: int = 1,
    *,
    seed: int = 0,
    known: bool = True,
    at_controls: str = "me",
    job_s: float = 0.05,
    site: dict[str, Any] | None = None,
    **options: Any,
) -> SteppedSession:
    """A session whose operator is at the controls; robots stand, and nothing else moves."""
    given: dict[str, Any] = {"odometry": GOOD_WHEELS, "cart": False} | options
    world = EmbeddedWorld(EmbeddedOptions(robots=robots, **given), seed)
    stepped = SteppedSession(
        world,
        known_calibration(world) if known else None,
        options=replace(SessionOptions(embedded_robots(world)), **(site or {})),
        job_s=job_s,
    )
    stepped.operator = at_controls
    return stepped


def under_way(robots: int = 1, wait_s: float = 1.5, **options: Any) -> SteppedSession:
    """The same, where robots have been driving to a goal for a while."""
    stepped = session(robots, **options)
    stepped.run(0.3)
    for name, goal in (("red", RED_GOAL), ("blue", BLUE_GOAL))[:robots]:
        stepped.order(DriveTo(name, (goal,)))
    stepped.run(wait_s)
    return stepped


def view(stepped: SteppedSession, name: str = "red") -> RobotView:
    """What was said of a robot in the last step."""
    assert stepped.tick is not None
    return next(one for one in stepped.tick.robots if one.name == name)


def speed(stepped: SteppedSession, name: str = "red") -> float:
    """How fast a robot truly is [m/s]."""
    return abs(stepped.world.truth(name, stepped.t).v)


def off_px(stepped: SteppedSession, goal: tuple[float, float], name: str = "red") -> float:
    """How far from a pixel a robot's mark truly is [px]."""
    u, v = stepped.world.truth(name, stepped.t).uv.tolist()
    return hypot(u - goal[0], v - goal[1])


def off_m(stepped: SteppedSession, goal: tuple[float, float], name: str = "red") -> float:
    """The same on the ground [m]."""
    there = stepped.world.camera.unproject(np.array(goal))
    return float(np.hypot(*(stepped.world.truth(name, stepped.t).xy - there)))
