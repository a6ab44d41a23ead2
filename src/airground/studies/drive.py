"""``airground drive`` in the embedded world: to clicked pixels, or along a sketch; and the same with the true g."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.control.path_follower import PathFollower
from airground.control.point_to_point import PointToPoint
from airground.control.sketch import smooth_sketch
from airground.control.sketch_check import check_path
from airground.errors import InputError
from airground.studies.drive_checks import check_goal, make_folder
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.drive_result import DriveOrder, DriveResult, write_drive
from airground.studies.driving_world import world_for
from airground.studies.rig import Drive, Rig
from airground.studies.rig_options import LAG_S, RigOptions, limits_for

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from airground.calibration import Calibration
    from airground.control import Limits
    from airground.control.image_path import ImagePath
    from airground.geometry.arrays import FloatArray

__all__ = ["drive_in_world", "followed", "oracle_rms", "released"]

REST_S = 0.5  # after arrival, before it is measured where the robot stands
PATIENCE = 4.0  # times the least time that a way takes, before it is given up
GRACE_S = 20.0  # on top
FINE_PX = 0.3  # tolerance of smoothing what is smooth already


def drive_in_world(
    calibration: Calibration,
    order: DriveOrder,
    *,
    say: Callable[[str], None],
    note: Callable[[str], None],
    out: Path | None = None,
) -> DriveResult:
    """Carry out an order in the embedded world.

    Parameters
    ----------
    calibration : Calibration
        To drive with.
    order : DriveOrder
        What for.
    say : callable
        Is told what is being done.
    note : callable
        Is told what may surprise, a line each.
    out : Path, optional
        Folder for ``drive.json``, ``driven.csv`` and ``drive.png``; made where it is missing.

    Returns
    -------
    result : DriveResult
        How it went; a robot that does not arrive is a result, not an error.

    Raises
    ------
    InputError
        If a goal is no visible ground, or the path cannot be driven: where and why.
    UndeterminedError
        If the calibration does not say enough about a goal's place.
    FileError
        If `out` cannot be made or written to.
    """
    world, why = world_for(calibration, seed=order.seed)
    if out is not None:
        make_folder(out)
    if world.name != "demo":
        note(f"driving in {why}")
    limits = limits_for(order.speed_mps or world.speed_mps)
    images = world.scene is not None and order.sight != "points"
    if order.sight == "images" and world.scene is None:
        raise InputError("--sight images: only the demo's world can be rendered; use points")
    options = RigOptions(latency_s=order.latency_s, images=images)
    rig = Rig(
        world,
        calibration.model,
        calibration.covariance,
        limits=limits,
        options=options,
        seed=order.seed,
        undistorted=calibration.undistort,
        time_offset_s=calibration.time_offset_s,
    )
    if order.drawn is None:
        result = _to_goals(calibration, order, rig, why, say)
    else:
        result = _along(calibration, order, rig, why, say, note=note)
    if out is not None:
        write_drive(out, result)
    return result


def _to_goals(
    calibration: Calibration,
    order: DriveOrder,
    rig: Rig,
    why: str,
    say: Callable[[str], None],
) -> DriveResult:
    raw = np.array(order.goals_px, dtype=np.float64)
    for uv in raw:
        check_goal(calibration, uv)
    goals = calibration.undistort(raw)
    heading = None if order.heading_deg is None else float(np.radians(order.heading_deg))
    say(f"drive to {len(goals)} goal{'' if len(goals) == 1 else 's'}")
    rig.settle()
    drive = rig.drive(
        PointToPoint(
            rig.floor,
            goals,
            rig.limits,
            heading,
            tolerance_m=_tolerance(rig.limits),
            response_s=LAG_S,
        ),
        most_s=_patience(rig, goals),
    )
    xy, uv = rig.rest(REST_S)
    goal_xy = rig.world.camera.unproject(rig.world.undistorted(raw[-1]))
    return DriveResult(
        rig.world,
        why,
        drives=(drive,),
        reached=drive.done,
        trouble=drive.trouble,
        goal_px=raw[-1],
        goal_error_px=float(np.hypot(*(uv - raw[-1]))),
        goal_error_m=float(np.hypot(*(xy - goal_xy))),
        images=rig.options.images,
    )


def _along(
    calibration: Calibration,
    order: DriveOrder,
    rig: Rig,
    why: str,
    say: Callable[[str], None],
    *,
    note: Callable[[str], None],
) -> DriveResult:
    assert order.drawn is not None
    path = released(
        rig,
        calibration.undistort(order.drawn.uv),
        speed_mps=order.drawn.speed,
        size_px=calibration.image_size_px if calibration.lens is None else None,
        note=note,
    )
    check_goal(calibration, calibration.distort(path.uv[0]), "the path's start")
    check_goal(calibration, calibration.distort(path.uv[-1]), "the path's end")
    drives, xy, uv = followed(rig, path, say)
    path_px = calibration.distort(path.uv)
    line = rig.world.camera.unproject(rig.world.undistorted(path_px))
    along = drives[-1]
    complete = len(drives) == 2
    oracle = None
    if complete:
        say("the same path with the true g")
        wish = order.drawn.speed
        oracle = oracle_rms(
            rig,
            path_px,
            line,
            seed=order.seed,
            speed_mps=None if wish is None else float(wish.min()),
        )
    return DriveResult(
        rig.world,
        why,
        drives=drives,
        reached=complete and along.done,
        trouble=along.trouble,
        goal_px=path_px[-1],
        goal_error_px=float(np.hypot(*(uv - path_px[-1]))),
        goal_error_m=float(np.hypot(*(xy - line[-1]))),
        path_px=path_px,
        sketch_rms_px=float(path.rms_deviation_px),
        path_rms_px=rms(distance_to_line(along.uv, path_px)) if complete else None,
        path_rms_m=rms(distance_to_line(along.xy, line)) if complete else None,
        oracle_path_rms_m=oracle,
        images=rig.options.images,
    )


def released(
    rig: Rig,
    uv: FloatArray,
    *,
    speed_mps: FloatArray | None = None,
    size_px: tuple[int, int] | None = None,
    note: Callable[[str], None] | None = None,
) -> ImagePath:
    """Make a path of a sketch, or say what of it cannot be driven, and where.

    Parameters
    ----------
    rig : Rig
        With floor and limits.
    uv : (N, 2) array [px]
        The sketch, undistorted.
    speed_mps : (N,) array, optional [m/s]
        Wished for at its points.
    size_px : (int, int), optional [px]
        Of the image, where the path must stay in it.
    note : callable, optional
        Is told how far the path is from the sketch.

    Returns
    -------
    path : ImagePath
        That can be driven.

    Raises
    ------
    InputError
        If it cannot be driven: the first place and reason, and how many there are.
    """
    path = smooth_sketch(rig.floor, uv, rig.limits, speed_mps=speed_mps)
    problems = check_path(path, rig.limits, image_size_px=size_px)
    if problems:
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise InputError(f"the path cannot be driven: {problems[0].reason}{more}")
    if note is not None:
        note(
            f"the sketch became a path of {path.length:.2f} m, {path.duration:.0f} s; "
            f"it leaves the sketch by {path.max_deviation_px:.1f} px at most"
        )
    return path


def followed(
    rig: Rig, path: ImagePath, say: Callable[[str], None]
) -> tuple[tuple[Drive, ...], FloatArray, FloatArray]:
    """Drive to the start of a path, and along it.

    Parameters
    ----------
    rig : Rig
        With the robot anywhere.
    path : ImagePath
        On its floor.
    say : callable
        Is told what is being done.

    Returns
    -------
    drives : tuple of Drive
        To its start and, if that was reached, along it.
    xy : (2,) array [m]
        Where the robot stands at the end, in truth.
    uv : (2,) array [px]
        Where its mark is in the image, in truth, in raw pixels.
    """
    say("drive to the path's start")
    rig.settle()
    heading = float(path.theta[0])
    start = PointToPoint(
        rig.floor,
        path.uv[:1],
        rig.limits,
        heading,
        tolerance_m=_tolerance(rig.limits),
        response_s=LAG_S,
    )
    first = rig.drive(start, most_s=_patience(rig, path.uv[:1]))
    drives: tuple[Drive, ...] = (first,)
    if first.done:
        say("follow the path")
        rig.rest(REST_S)
        follower = PathFollower(
            path, rig.limits, response_s=LAG_S, arrive_m=0.3 * _tolerance(rig.limits)
        )
        drives += (rig.drive(follower, most_s=PATIENCE * path.duration + GRACE_S),)
    xy, uv = rig.rest(REST_S)
    return drives, xy, uv


def oracle_rms(
    rig: Rig,
    path_px: FloatArray,
    line: FloatArray,
    *,
    seed: int,
    speed_mps: float | None = None,
) -> float | None:
    """Distance from the same path, in the same world with the same noise, of who knows the true g, lens and clock.

    Parameters
    ----------
    rig : Rig
        That drove it with an estimate.
    path_px : (N, 2) array [px]
        The path as released, in raw pixels.
    line : (N, 2) array [m]
        The same on the ground, in truth.
    seed : int
        Of the noise.
    speed_mps : float, optional [m/s]
        Wished for along it.

    Returns
    -------
    rms : float or None [m]
        While following it; None where it did not get to its start.
    """
    world = rig.world
    twin = Rig(
        world,
        world.model,
        None,
        limits=rig.limits,
        options=rig.options,
        seed=seed,
        undistorted=world.undistorted,
        time_offset_s=world.clock_offset_s,
    )
    path = smooth_sketch(
        twin.floor,
        world.undistorted(path_px),
        twin.limits,
        smoothing_px=FINE_PX,
        speed_mps=speed_mps,
    )
    drives, _, _ = followed(twin, path, lambda _: None)
    return rms(distance_to_line(drives[-1].xy, line)) if len(drives) == 2 else None


def _tolerance(limits: Limits) -> float:
    """A centimetre for a robot of 0.3 m/s, and more for what is larger and faster."""
    return 0.01 * max(1.0, limits.speed_mps / 0.3)


def _patience(rig: Rig, goals: FloatArray) -> float:
    """Time after which a drive through goals is given up [s]."""
    here = rig.pilot.state_filter.predict(rig.t).uv
    way = np.concatenate([here[None] if np.isfinite(here).all() else goals[:1], goals])
    xy = rig.floor.position(way)
    length = float(np.nansum(np.hypot(*np.diff(xy, axis=0).T)))
    turns = 2 * np.pi * len(goals) / rig.limits.turn_rate_radps
    return PATIENCE * (length / rig.limits.speed_mps + turns) + GRACE_S
