"""``airground drive`` in the embedded world: to clicked pixels, or along a sketch; and the same with the true g."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from airground.control.path_follower import PathFollower
from airground.control.point_to_point import PointToPoint
from airground.control.sketch import smooth_sketch
from airground.control.sketch_check import check_path
from airground.errors import FileError, InputError, UndeterminedError
from airground.records import replacing, write_text
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.driving_world import world_for
from airground.studies.rig import LAG_S, Drive, Rig, RigOptions, limits_for

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from airground.calibration import Calibration
    from airground.control import Limits
    from airground.control.image_path import ImagePath
    from airground.geometry.arrays import FloatArray
    from airground.records import DrawnPath
    from airground.studies.driving_world import DrivingWorld

__all__ = ["DriveOrder", "DriveResult", "drive_in_world", "followed", "oracle_rms", "released"]

REST_S = 0.5  # after arrival, before it is measured where the robot stands
PATIENCE = 4.0  # times the least time that a way takes, before it is given up
GRACE_S = 20.0  # on top
WORST_SIGMA = 0.2  # relative deviation of ground velocities where a robot is still sent to
FINE_PX = 0.3  # tolerance of smoothing what is smooth already


@dataclass(frozen=True, slots=True, eq=False)
class DriveOrder:
    """What an operator asks for."""

    goals_px: tuple[tuple[float, float], ...] = ()
    """Raw pixels to drive to, in order; or"""

    drawn: DrawnPath | None = None
    """a sketch to follow."""

    heading_deg: float | None = None
    """To end with, at the last goal [degrees]; None for any."""

    speed_mps: float | None = None
    """To hold on the ground [m/s]; None for the world's own."""

    latency_s: float = 0.1
    """From a picture's exposure to its arrival [s]."""

    sight: Literal["images", "points"] | None = None
    """How the robot is seen; None for images where there is a scene."""

    seed: int = 0
    """Of all noise."""


@dataclass(frozen=True, slots=True, eq=False)
class DriveResult:
    """What was driven, and how well."""

    world: DrivingWorld
    """The truth."""

    why: str
    """Which world, and why, in one line."""

    drives: tuple[Drive, ...]
    """What was driven, in order; where there is a path, the last along it."""

    reached: bool
    """Whether the robot got to the end."""

    trouble: str
    """Why not, in one line; empty where it did."""

    goal_px: FloatArray
    """(2,) [px]. Where it should end, in raw pixels."""

    goal_error_px: float
    """Distance in the image of where it stands from there [px]."""

    goal_error_m: float
    """The same on the ground [m]."""

    path_px: FloatArray | None = None
    """(N, 2) [px]. The path as released, in raw pixels; None where there were goals only."""

    sketch_rms_px: float | None = None
    """Distance of the sketch from the path [px]."""

    path_rms_px: float | None = None
    """Distance from the path while following it, in the image [px]."""

    path_rms_m: float | None = None
    """The same on the ground [m]."""

    oracle_path_rms_m: float | None = None
    """The same in a drive that is given the true g [m]."""

    images: bool = False
    """Whether the robot was seen in rendered images."""

    def document(self) -> dict[str, Any]:
        """Give the JSON object.

        Returns
        -------
        document : dict
            Figures by name, with units.
        """
        return {
            "reached": self.reached,
            "trouble": self.trouble,
            "time_s": float(sum(drive.duration for drive in self.drives)),
            "goal_error_px": self.goal_error_px,
            "goal_error_m": self.goal_error_m,
            "path_rms_px": self.path_rms_px,
            "path_rms_m": self.path_rms_m,
            "oracle_path_rms_m": self.oracle_path_rms_m,
            "sketch_rms_px": self.sketch_rms_px,
            "max_speed_mps": float(max(np.abs(drive.v).max() for drive in self.drives)),
            "stops": len(self._stops()),
            "stop_reasons": self._stops(),
            "world": self.world.name,
            "sight": "images" if self.images else "points",
        }

    def lines(self) -> list[str]:
        """Say it to people.

        Returns
        -------
        lines : list of str
            A few.
        """
        d = self.document()
        end = f"{d['goal_error_px']:.1f} px, {100 * d['goal_error_m']:.1f} cm from the goal"
        lines = [
            f"world: {self.why}; seen in {d['sight']}",
            f"arrived after {d['time_s']:.1f} s, {end}"
            if self.reached
            else f"not arrived: {self.trouble}; {end}",
            f"fastest {d['max_speed_mps']:.3f} m/s, {d['stops']} stops for safety",
        ]
        if self.path_rms_m is not None and self.path_rms_px is not None:
            oracle = self.oracle_path_rms_m
            beside = "" if oracle is None else f"; with the true g {100 * oracle:.2f} cm"
            lines.insert(
                2, f"path: {self.path_rms_px:.2f} px, {100 * self.path_rms_m:.2f} cm rms{beside}"
            )
        return lines + [f"  stop at {line}" for line in self._stops()]

    def _stops(self) -> list[str]:
        return [line for drive in self.drives for line in drive.stops]


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
        _make(out)
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
        _write(out, result)
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
        _check_goal(calibration, uv)
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
    _check_goal(calibration, calibration.distort(path.uv[0]), "the path's start")
    _check_goal(calibration, calibration.distort(path.uv[-1]), "the path's end")
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
            path, rig.limits, response_s=LAG_S, arrive_m=0.5 * _tolerance(rig.limits)
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


def _check_goal(calibration: Calibration, uv: FloatArray, what: str = "the goal") -> None:
    u, v = uv.tolist()
    size = calibration.image_size_px
    if size is not None and not (-0.5 <= u <= size[0] - 0.5 and -0.5 <= v <= size[1] - 0.5):
        raise InputError(
            f"{what} {u:g},{v:g} is outside the image of {size[0]}x{size[1]} px; choose a pixel in it"
        )
    if not bool(calibration.is_ground(uv)):
        raise InputError(
            f"{what} {u:g},{v:g} lies on or above the horizon; choose a pixel on the ground"
        )
    unit = calibration.jacobian(uv) @ np.array([1.0, 0.0])
    _, covariance = calibration.ground_velocity(uv, unit)
    sigma = float(np.sqrt(np.trace(covariance) / 2))
    if not sigma <= WORST_SIGMA:
        raise UndeterminedError(
            f"the calibration leaves speeds at {what} {u:g},{v:g} uncertain by {sigma:.0%}; "
            "calibrate with a drive that comes nearer to it"
        )


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


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(str(folder), f"cannot be made: {error.strerror or error}") from error


def _write(out: Path, result: DriveResult) -> None:
    from airground.pictures.driving import draw_image_path

    write_text(out / "drive.json", json.dumps(result.document(), indent=2, allow_nan=False) + "\n")
    names = "t_s,u_px,v_px,x_m,y_m,heading_rad,speed_mps,turn_rate_radps"
    tables = [np.column_stack([d.t, d.uv, d.xy, d.theta, d.v, d.omega]) for d in result.drives]
    rows = [",".join(map(repr, row)) for row in np.concatenate(tables).tolist()]
    write_text(out / "driven.csv", "\n".join([names, *rows]) + "\n")
    driven = np.concatenate([d.uv for d in result.drives])
    first = result.drives[0]
    wanted = result.path_px
    if wanted is None:
        wanted = np.stack([driven[0], result.goal_px])
    reach = 0.5 * result.world.speed_mps / 0.3
    ahead = first.xy[0] + reach * np.array([np.cos(first.theta[0]), np.sin(first.theta[0])])
    with replacing(out / "drive.png") as temporary:
        draw_image_path(
            temporary,
            size_px=result.world.camera.image_size_px,
            wanted=wanted,
            driven=driven,
            heading=result.world.distorted(result.world.camera.project(ahead)),
        )
