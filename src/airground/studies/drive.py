"""``airground drive`` in the embedded world: to clicked pixels, or along a sketch; and the same with the true g."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.control.goals.point_to_point import PointToPoint
from airground.errors import InputError
from airground.records import make_folder
from airground.session.goal_check import check_goal
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.drive_result import DriveOrder, DriveResult, write_drive
from airground.studies.driving_world import world_for
from airground.studies.path_drive import (
    followed,
    oracle_rms,
    patience,
    released,
    tolerance,
)
from airground.studies.rig import Rig
from airground.studies.rig_options import LAG_S, RigOptions, limits_for

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from airground.calibration import Calibration

__all__ = ["drive_in_world"]


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
    asked = np.array(order.goals_px) if order.drawn is None else order.drawn.uv
    world, why = world_for(calibration, seed=order.seed, shown_px=asked)
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
            tolerance_m=tolerance(rig.limits),
            response_s=LAG_S,
        ),
        most_s=patience(rig, goals),
    )
    off_px, off_m = rig.stands_off(raw[-1])
    return DriveResult(
        rig.world,
        why,
        drives=(drive,),
        reached=drive.done,
        trouble=drive.trouble,
        goal_px=raw[-1],
        goal_error_px=off_px,
        goal_error_m=off_m,
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
