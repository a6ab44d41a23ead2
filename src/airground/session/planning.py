"""From what an operator drew to what a robot can drive: work that takes too long for the loop. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, sin
from typing import TYPE_CHECKING

import numpy as np

from airground.control import PathFollower, PointToPoint, check_path, smooth_sketch
from airground.control.goals.point_to_point_omni import PointOmni
from airground.control.separation.planner import WayPlanner
from airground.errors import InputError
from airground.session.goal_check import check_goal
from airground.session.tick import PathView

if TYPE_CHECKING:
    from airground.control import Controller, ImagePath, Limits
    from airground.geometry.arrays import FloatArray
    from airground.session.ground import Ground
    from airground.session.options import RobotOptions
    from airground.session.orders import DriveTo, Sketch

__all__ = ["Way", "plan_goals", "plan_path", "plan_sketch", "way_controller"]

SPARE_M = 0.02  # on top of a robot's radius, when a way is planned: what following it costs
SHOWN_POINTS = 240  # of a path


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A controller, and what to show of it."""

    controller: Controller
    """To drive with."""

    goals_px: tuple[tuple[float, float], ...]
    """Where it leads, in raw pixels."""


def way_controller(
    ground: Ground,
    robot: RobotOptions,
    limits: Limits,
    goals_uv: FloatArray,
    heading: float | None = None,
) -> Controller:
    """Controller of the robot's kind for goals.

    Parameters
    ----------
    ground : Ground
        Where.
    robot : RobotOptions
        Which.
    limits : Limits
        At the speed that the operator set.
    goals_uv : (N, 2) array [px]
        In undistorted pixels.
    heading : float, optional [rad]
        On the ground, at the end.

    Returns
    -------
    controller : Controller
        Within the limits.
    """
    fine = 0.01 * max(1.0, limits.speed_mps / 0.3)  # a centimetre at 0.3 m/s
    if robot.kind == "omni":
        return PointOmni(ground.floor, goals_uv, limits, heading, tolerance_m=fine)
    return PointToPoint(
        ground.floor,
        goals_uv,
        limits,
        heading,
        tolerance_m=fine,
        response_s=max(robot.state.speed_lag_s, 0.05),
    )


def plan_goals(
    ground: Ground, robot: RobotOptions, limits: Limits, order: DriveTo, start_uv: FloatArray
) -> Way:
    """Plan a way through clicked pixels, round what is in between.

    Parameters
    ----------
    ground : Ground
        Where.
    robot : RobotOptions
        Which.
    limits : Limits
        At the speed that the operator set.
    order : DriveTo
        What was clicked.
    start_uv : (2,) array [px]
        Where the robot is, undistorted; NaN where that is not known.

    Returns
    -------
    way : Way
        To be driven.

    Raises
    ------
    InputError
        If a goal is no visible ground, or no way leads there.
    UndeterminedError
        If the calibration does not say enough about a goal's place.
    """
    calibration = ground.calibration
    raw = np.array(order.goals_px, dtype=np.float64)
    for uv in raw:
        check_goal(calibration, uv)
    goals = calibration.undistort(raw)
    heading = None
    if order.heading_rad is not None:
        wanted = np.array([cos(order.heading_rad), sin(order.heading_rad)])
        x, y = np.linalg.solve(ground.calibration.jacobian(raw[-1]), wanted).tolist()
        heading = atan2(y, x)
    if ground.fence is not None and np.isfinite(start_uv).all():
        planner = WayPlanner(ground.fence, robot.radius_m + SPARE_M)
        corners, at = [], start_uv
        for goal in goals:
            corners.append(planner.way(at, goal)[1:])
            at = goal
        goals = np.concatenate(corners)
    return Way(way_controller(ground, robot, limits, goals, heading), order.goals_px)


def plan_sketch(
    ground: Ground,
    limits: Limits,
    order: Sketch,
    size_px: tuple[int, int] | None,
    radius_m: float,
) -> tuple[ImagePath | None, PathView]:
    """Make a path of a sketch, and say what of it cannot be driven.

    Parameters
    ----------
    ground : Ground
        Where.
    limits : Limits
        Of the robot.
    order : Sketch
        What was drawn.
    size_px : (int, int) or None [px]
        Of the image, which the path must not leave.
    radius_m : float [m]
        Of the robot, for the fence.

    Returns
    -------
    path : ImagePath or None
        None where nothing of it is a path.
    view : PathView
        For the page.
    """
    calibration, fence = ground.calibration, ground.fence
    drawn = calibration.undistort(np.array(order.points_px, dtype=np.float64))
    try:
        path = smooth_sketch(ground.floor, drawn, limits, speed_mps=order.speed_mps)
    except InputError as error:
        return None, _no_path(order, str(error))
    problems = check_path(
        path,
        limits,
        image_size_px=size_px if calibration.lens is None else None,
        fence=None if fence is None else (lambda uv: fence.inside_image(uv, radius_m)),
    )
    undrivable = []
    for problem in problems:
        stretch = (drawn if problem.drawn else path.uv)[problem.first : problem.last + 1]
        undrivable.append((problem.reason, _pixels(calibration.distort(_thin(stretch, 40)))))
    keep = _rows(len(path.uv), SHOWN_POINTS)
    points = np.column_stack([calibration.distort(path.uv[keep]), path.speed[keep]])
    view = PathView(
        robot=order.robot,
        sketch=order.sketch,
        points=points,
        undrivable=tuple(undrivable),
        length_m=float(path.length),
        duration_s=float(path.duration),
        deviation_px=float(path.max_deviation_px),
    )
    return path, view


def plan_path(
    ground: Ground, robot: RobotOptions, limits: Limits, path: ImagePath
) -> tuple[Controller, Controller]:
    """Controllers to a path's start, and along it.

    Parameters
    ----------
    ground : Ground
        Where.
    robot : RobotOptions
        Which.
    limits : Limits
        At the speed that the operator set.
    path : ImagePath
        To be driven.

    Returns
    -------
    start : Controller
        Ends at the path's first point, in its direction.
    along : Controller
        Ends at its last.
    """
    start = way_controller(ground, robot, limits, path.uv[:1], float(path.theta[0]))
    lag = max(robot.state.speed_lag_s, 0.05)
    fine = 0.003 * max(1.0, limits.speed_mps / 0.3)
    return start, PathFollower(path, limits, response_s=lag, arrive_m=fine)


def _no_path(order: Sketch, why: str) -> PathView:
    return PathView(
        robot=order.robot,
        sketch=order.sketch,
        points=np.empty((0, 3)),
        undrivable=((why, _pixels(np.array(order.points_px)[:: 1 + len(order.points_px) // 80])),),
        length_m=0.0,
        duration_s=0.0,
        deviation_px=0.0,
    )


def _rows(count: int, most: int) -> list[int]:
    rows = np.unique(np.round(np.linspace(0, count - 1, min(count, most))).astype(int))
    return [int(k) for k in rows]


def _thin(uv: FloatArray, most: int) -> FloatArray:
    return uv[_rows(len(uv), most)] if len(uv) else uv


def _pixels(uv: FloatArray) -> tuple[tuple[float, float], ...]:
    return tuple((float(u), float(v)) for u, v in uv if np.isfinite(u + v))
