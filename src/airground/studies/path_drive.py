"""A sketch released, its path driven to and followed, and the same with the true g: for `drive` and for the demo."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.control import PathFollower, PointToPoint, check_path, smooth_sketch
from airground.errors import InputError
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.rig import Drive, Rig
from airground.studies.rig_options import LAG_S

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.control import ImagePath, Limits
    from airground.geometry.arrays import FloatArray

__all__ = ["REST_S", "followed", "oracle_rms", "patience", "released", "tolerance"]

REST_S = 0.5
"""After arrival, before it is measured where the robot stands [s]."""

PATIENCE = 4.0  # times the least time that a way takes, before it is given up
GRACE_S = 20.0  # on top
FINE_PX = 0.3  # tolerance of smoothing what is smooth already


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
        tolerance_m=tolerance(rig.limits),
        response_s=LAG_S,
    )
    first = rig.drive(start, most_s=patience(rig, path.uv[:1]))
    drives: tuple[Drive, ...] = (first,)
    if first.done:
        say("follow the path")
        rig.rest(REST_S)
        follower = PathFollower(
            path, rig.limits, response_s=LAG_S, arrive_m=0.3 * tolerance(rig.limits)
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


def tolerance(limits: Limits) -> float:
    """How near to a goal a robot comes: a centimetre at 0.3 m/s, and more for what is larger and faster.

    Parameters
    ----------
    limits : Limits
        Of the robot.

    Returns
    -------
    tolerance : float [m]
        For controllers.
    """
    return 0.01 * max(1.0, limits.speed_mps / 0.3)


def patience(rig: Rig, goals: FloatArray) -> float:
    """When a drive through goals is given up.

    Parameters
    ----------
    rig : Rig
        With the robot where it sets out.
    goals : (N, 2) array [px]
        Where it shall go, undistorted.

    Returns
    -------
    patience : float [s]
        Several times what the way takes.
    """
    here = rig.pilot.state_filter.predict(rig.t).uv
    way = np.concatenate([here[None] if np.isfinite(here).all() else goals[:1], goals])
    xy = rig.floor.position(way)
    length = float(np.nansum(np.hypot(*np.diff(xy, axis=0).T)))
    turns = 2 * np.pi * len(goals) / rig.limits.turn_rate_radps
    return PATIENCE * (length / rig.limits.speed_mps + turns) + GRACE_S
