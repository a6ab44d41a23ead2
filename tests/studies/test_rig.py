"""The closed loop with all that is late in it, judged by the truth of the simulated world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon, points  # type: ignore[import-untyped]

from airground.control import Fence, Floor, PathFollower, PointToPoint, plan_way, smooth_sketch
from airground.geometry.arrays import FloatArray
from airground.sim.point_eye import PointEye
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.driving_world import DrivingWorld, demo_driving_world
from airground.studies.rig import Rig
from airground.studies.rig_body import EmbeddedBody
from airground.studies.rig_options import LAG_S, RigOptions, limits_for

WORLD = demo_driving_world()
EXACT = np.diag([1e-8, 1e-8, 1e-14, 1e-14, 1e-8, 1e-14])
BODY_M = 0.4  # half the robot's diagonal


def rig(world: DrivingWorld = WORLD, **options: object) -> Rig:
    given = replace(RigOptions(sigma_px=0.5), **options)  # type: ignore[arg-type]
    return Rig(world, world.model, None, limits=limits_for(0.3), options=given, seed=1)


def pixel(x: float, y: float) -> FloatArray:
    return WORLD.camera.project(np.array([x, y]))


def error_on_a_wave(loop: Rig) -> float:
    """Root mean square distance from a path while following it [m]."""
    u = np.linspace(520.0, 760.0, 30)
    sketch = np.column_stack([u, 440 + 40 * np.sin(u / 50)])
    path = smooth_sketch(loop.floor, sketch, loop.limits)
    loop.settle()
    start = PointToPoint(
        loop.floor, path.uv[:1], loop.limits, float(path.theta[0]), response_s=LAG_S
    )
    assert loop.drive(start, most_s=60).done
    loop.rest(0.5)
    along = loop.drive(PathFollower(path, loop.limits, response_s=LAG_S), most_s=60)
    assert along.done
    return rms(distance_to_line(along.xy, WORLD.camera.unproject(path.uv)))


def test_what_is_late_is_allowed_for() -> None:
    prompt, late = error_on_a_wave(rig(latency_s=0.0)), error_on_a_wave(rig(latency_s=0.1))
    later = error_on_a_wave(rig(latency_s=0.2))
    blind = error_on_a_wave(rig(latency_s=0.1, predict=False))
    assert later < 0.008
    assert late < 1.3 * prompt
    assert blind > 2 * late  # so that it is the prediction which does it


def test_a_goal_behind_boxes_is_reached_round_them() -> None:
    """Keep-out polygons drawn in the image: a way is planned round them, and the safety layer holds them."""
    box = np.array([[-0.3, 3.6], [0.3, 3.6], [0.3, 4.6], [-0.3, 4.6]])
    drawn = (WORLD.camera.project(box),)
    world = replace(WORLD, start_m=(-1.6, 4.1), heading_rad=0.0)

    def fenced(floor: Floor) -> Fence:
        return Fence(floor, keep_out=drawn)

    loop = Rig(
        world,
        world.model,
        None,
        limits=limits_for(0.3),
        options=RigOptions(sigma_px=0.5),
        seed=2,
        fenced=fenced,
    )
    loop.settle()
    goal = pixel(1.4, 4.0)
    way = plan_way(pixel(-1.6, 4.1), goal, fence=fenced(loop.floor), radius_m=BODY_M)
    assert len(way) > 2
    to = PointToPoint(loop.floor, way[1:], loop.limits, passing_m=0.1, response_s=LAG_S)
    driven = loop.drive(to, most_s=60)
    assert driven.done, driven.trouble
    _, uv = loop.rest(0.5)
    assert np.hypot(*(uv - goal)) < 3
    clear = np.asarray(Polygon(box).distance(points(driven.xy)))
    assert clear.min() > BODY_M - 0.12  # it cuts the corners of the way by `passing_m`


def test_a_goal_inside_a_keep_out_area_ends_in_a_stop_before_it() -> None:
    box = np.array([[0.6, 3.6], [1.6, 3.6], [1.6, 4.6], [0.6, 4.6]])

    def fenced(floor: Floor) -> Fence:
        return Fence(floor, keep_out=(WORLD.camera.project(box),))

    world = replace(WORLD, start_m=(-0.6, 4.1), heading_rad=0.0)
    loop = Rig(
        world,
        world.model,
        None,
        limits=limits_for(0.3),
        options=RigOptions(sigma_px=0.5),
        seed=3,
        fenced=fenced,
    )
    loop.settle()
    to = PointToPoint(loop.floor, pixel(1.1, 4.1)[None], loop.limits, response_s=LAG_S)
    driven = loop.drive(to, most_s=12)
    assert not driven.done
    assert "comes to rest" in driven.trouble
    assert np.asarray(Polygon(box).distance(points(driven.xy))).min() > 0
    assert len(driven.stops) >= 1


@pytest.mark.parametrize("fault", ["hidden", "blocked"])
def test_a_robot_that_is_lost_or_stuck_is_stopped(fault: str) -> None:
    loop = rig()
    loop.settle()
    body = loop.body
    assert isinstance(body, EmbeddedBody)
    if fault == "hidden":
        eye = body.eye
        assert isinstance(eye, PointEye)
        eye.options = replace(eye.options, hidden_s=((2.5, 60.0),))
    else:
        body.plant.options = replace(body.plant.options, blocked_s=(2.5, 60.0))
    to = PointToPoint(loop.floor, pixel(1.5, 4.9)[None], loop.limits, response_s=LAG_S)
    driven = loop.drive(to, most_s=12)
    assert not driven.done
    first = driven.stops[0]
    assert "track lost" in first
    why = "track lost" if fault == "hidden" else "does not do what it is told"
    last = [line for line in driven.stops if why in line][-1]
    stopped_at = float(first.split(" s:")[0])
    assert stopped_at - 2.5 < 1.0
    after = (driven.t > stopped_at) & (driven.t < stopped_at + 0.1)
    assert (driven.commands[after] == 0).all()
    held = driven.t > float(last.split(" s:")[0])
    assert held.sum() > 100
    assert (driven.commands[held] == 0).all()  # for good: a person has to look after it


@pytest.mark.parametrize("wheels", [0.8, 1.25])
def test_the_ground_speed_is_held_with_wheels_of_another_size(wheels: float) -> None:
    """Told 0.2 m/s, from near to far, while the scale of the image halves."""

    def mean_speed(*, hold: bool) -> float:
        world = replace(WORLD, start_m=(-0.4, 3.0), heading_rad=np.pi / 2)
        loop = Rig(
            world,
            world.model,
            None,
            limits=limits_for(0.2),
            options=RigOptions(sigma_px=0.5, wheels=wheels, hold_speed=hold),
            seed=4,
        )
        loop.settle()
        line = np.stack([pixel(-0.4, y) for y in np.linspace(3.0, 6.0, 40)])
        path = smooth_sketch(loop.floor, line, loop.limits)
        along = loop.drive(PathFollower(path, loop.limits, response_s=LAG_S), most_s=60)
        assert along.done
        inner = (along.t - along.t[0] > 6.0) & (along.xy[:, 1] < 5.7)
        return float(along.v[inner].mean())

    assert mean_speed(hold=True) == pytest.approx(
        0.2, rel=0.03
    )  # slip, and what the filter has of it
    assert mean_speed(hold=False) == pytest.approx(0.2 * wheels, rel=0.05)
