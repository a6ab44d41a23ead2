"""A drone that looks down on the robot in MuJoCo: hovers in wind while it is calibrated, then drifts while it drives.

The same drive is filmed once more from where the first picture was taken, by a camera that stands. Sightings are
referred to the first picture by what is seen of the floor. The robot's tag is above the floor, so that its place in a
picture moves with the camera in another way: who knows how high it is, and the camera's focal length, can allow for
that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from airground.calibration import calibrate
from airground.errors import UndeterminedError
from airground.geometry import align_rotation, n_error
from airground.geometry.arrays import FloatArray
from airground.sim3d.options import CameraOptions3d, World3dOptions
from airground.sim3d.world import World3d
from airground.studies.drone import Drone
from airground.studies.flight import Flight, MovingGoal, filmed_still
from airground.studies.robot_run import CAMERA_HZ
from airground.studies.robot_stage import ROBOT
from airground.vision.moving import calibrate_marks

if TYPE_CHECKING:
    from airground.calibration import Calibration, Motion, Tracks
    from airground.sim3d.camera_pose import CameraPose
    from airground.sim3d.survey import Survey

__all__ = ["MovingRun", "moving_options", "moving_run"]

HEIGHT_M = 5.0
BACK_M = 2.6  # behind the middle of the drive
METHOD = {"method": "trajectory", "distortion": "none"}  # the drone's video has no lens in it


@dataclass(frozen=True, slots=True, eq=False)
class MovingRun:
    """One flight."""

    seed: int
    """Of the world and of the wind."""

    n: dict[str, float]
    """Error n (eq. 23) by how the camera was: ``still``; ``moving``, with the mark's height told; ``flat``, the mark
    taken to be on the floor. Missing where refused."""

    goals: tuple[MovingGoal, ...]
    """Driven to while the drone drifted."""

    placed_share: float
    """Of the pictures, those whose place is known."""

    moved_m: float
    """How far the camera went from where its first picture was taken, at most [m]."""

    height_m: float
    """Of the camera above the floor at its first picture, in truth [m]."""

    found_height_m: float | None
    """The same as it was found; None where the calibration was refused."""

    uv: FloatArray
    """(M, 2) [px]. Where the robot's mark was seen while it was calibrated, in the pictures as they are."""

    stable_uv: FloatArray
    """(M, 2) [px]. The same in the first picture."""


def moving_options(rate_hz: float = CAMERA_HZ) -> World3dOptions:
    """The world of the flights.

    Parameters
    ----------
    rate_hz : float
        Pictures per second.

    Returns
    -------
    options : World3dOptions
        The robot of table 2, seen from higher up and without a lens.
    """
    camera = CameraOptions3d(
        position_m=(0.0, -0.25 - BACK_M, HEIGHT_M),
        target_m=(0.0, -0.05, 0.0),
        k1=0.0,
        rate_hz=rate_hz,
    )
    return World3dOptions(robots=(ROBOT,), camera=camera)


def moving_run(seed: int, goals: int, options: World3dOptions | None = None) -> MovingRun:
    """Calibrate under a hovering drone, and drive while it drifts.

    Parameters
    ----------
    seed : int
        Of the world and of the wind.
    goals : int
        How many.
    options : World3dOptions, optional
        `moving_options` where not given.

    Returns
    -------
    run : MovingRun
        How it went.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    UnreachableError
        If it cannot draw here.
    """
    options = options or moving_options()
    drone = Drone(options.camera, seed)
    with World3d(options, seed, camera_pose=drone) as world:
        flight = Flight(world, drone)
        motion = flight.film(seed)
        tracks = flight.tracks
        ground, raw, truth = dict(flight.ground), flight.raw, flight.survey(flight.first_s)
        try:
            found = calibrate_marks(tracks, ground, motion, flight.view)
        except UndeterminedError:
            found = None
        n = _errors(
            truth,
            {
                "moving": None if found is None else found.calibration,
                "flat": _calibrated(tracks, motion, options),
                "still": _filmed_still(options, seed, drone(flight.first_s)),
            },
        )
        driven = () if found is None else flight.drive(found, truth, goals, seed)
        rows = tracks.rows(ROBOT.name)
        height = None if found is None else found.camera_height_m
        return MovingRun(
            seed,
            n,
            driven,
            placed_share=flight.placed / flight.frames,
            moved_m=flight.moved_m,
            height_m=float(drone(flight.first_s).position[2]),
            found_height_m=height,
            uv=raw[rows],
            stable_uv=(tracks if found is None else found.tracks).uv[rows],
        )


def _errors(truth: Survey, found: dict[str, Calibration | None]) -> dict[str, float]:
    return {
        name: float(n_error(truth.g, align_rotation(truth.g, one.model)[0]))
        for name, one in found.items()
        if one is not None
    }


def _filmed_still(options: World3dOptions, seed: int, pose: CameraPose) -> Calibration | None:
    """The same drive, from where the first picture was taken."""
    with World3d(options, seed, camera_pose=lambda _: pose) as world:
        return _calibrated(*filmed_still(world, seed), options)


def _calibrated(tracks: Tracks, motion: Motion, options: World3dOptions) -> Calibration | None:
    size = options.camera.image_size_px
    try:
        return calibrate(tracks, motion, image_size_px=size, **METHOD)  # type: ignore[arg-type]
    except UndeterminedError:
        return None
