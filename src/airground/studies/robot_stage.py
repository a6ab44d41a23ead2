"""The MuJoCo world for the drives of figures 8 to 11: calibrated by a drive of the robot, then driven with that.

What pilots are told comes from encoders, compass and pictures; "oracle" is the survey, turned to the compass's north.
A picture is stamped when it arrives, so a command's effect is seen after both delays: the camera's and the command's.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import calibrate
from airground.errors import UndeterminedError
from airground.geometry import LimitedHomography, align_rotation, n_error
from airground.sim.camera import SimCamera
from airground.sim.lens import Lens
from airground.sim3d.world import World3d
from airground.studies.driving_world import DrivingWorld
from airground.studies.figure_drives import TOP_MPS
from airground.studies.figure_paths import SPEED_MPS
from airground.studies.rig import Rig
from airground.studies.rig_options import RigOptions, limits_for
from airground.studies.robot_driver import random_headings
from airground.studies.robot_run import CAMERA_HZ, calibration_run
from airground.studies.robot_runs import LENS, METHODS, OPTIONS
from airground.studies.stage import Known, Layout
from airground.studies.world_body import WorldBody

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from airground.geometry.arrays import FloatArray
    from airground.sim3d.options import Robot3d, World3dOptions
    from airground.studies.robot_run import RobotRun

__all__ = ["ROBOT", "RobotStage", "driving_world", "robot_stage", "world_rig_options"]

ROBOT = replace(OPTIONS.robots[0], start_m=(0.0, -0.25))
"""The one that is driven, in the middle of the image at first."""


def world_rig_options() -> RigOptions:
    """How the loop in MuJoCo is set up.

    Returns
    -------
    options : RigOptions
        The delay is that from a command to its effect in a picture's stamp.
    """
    late = ROBOT.options.command_latency_s + OPTIONS.camera.latency_s
    return RigOptions(actuation_s=late, control_hz=50.0, camera_hz=OPTIONS.camera.rate_hz)


def driving_world(image_from_ground: FloatArray, *, lens: bool = True) -> DrivingWorld:
    """The truth about a camera of the MuJoCo world, for the closed loop.

    Parameters
    ----------
    image_from_ground : (3, 3) array
        Of the tags' plane, surveyed.
    lens : bool
        Whether it has the lens of `OPTIONS`.

    Returns
    -------
    world : DrivingWorld
        The robot's place is told to MuJoCo, not to this.
    """
    width, height = size = OPTIONS.camera.image_size_px
    u, v = np.asarray(LENS.center).tolist()
    return DrivingWorld(
        "mujoco",
        camera=SimCamera(image_from_ground, size),
        lens=Lens(LENS.k1, (u, v)) if lens else None,
        ground_uv=np.array([(width - 1) / 2, (height - 1) / 2]),
        start_m=ROBOT.start_m,
        heading_rad=ROBOT.heading_rad,
        speed_mps=SPEED_MPS,
        robot=ROBOT.name,
    )


def _wave() -> FloatArray:
    """(N, 2) [px]. A little more than a period, from left to right."""
    u = np.linspace(430.0, 850.0, 15)
    return np.column_stack([u, 400.0 + 60.0 * np.sin((u - 430.0) / 420.0 * 2.4 * np.pi)])


class RobotStage:
    """The robot in MuJoCo, its calibration drive done.

    Parameters
    ----------
    seed : int
        Of the world: floor, wheels, compass and noise.
    camera_hz : float
        Pictures per second.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    UnreachableError
        If it cannot draw here.
    """

    layout = Layout(
        wave_uv=_wave(),
        wave_start_uv=np.array([480.0, 560.0]),
        wave_heading_rad=2.6,
        ellipse_centre_uv=np.array([640.0, 400.0]),
        ellipse_semi_m=(0.6, 0.4),
        ellipse_angle_rad=0.4,
        ellipse_start_uv=np.array([860.0, 540.0]),
        ellipse_heading_rad=2.2,
    )
    """Where things lie."""

    def __init__(self, seed: int, camera_hz: float = CAMERA_HZ) -> None:
        self.seed = seed
        self._camera = replace(OPTIONS.camera, rate_hz=camera_hz)
        headings = random_headings(np.random.default_rng([seed, 0x11]))
        self.run: RobotRun = calibration_run(seed, self._options(ROBOT), headings=headings)
        """The calibration drive."""
        run = self.run
        self.known: dict[str, Known] = {}
        """What pilots are told; an estimate is missing where its method refused."""
        for name, how in METHODS.items():
            try:
                found = calibrate(run.tracks, run.motion, image_size_px=run.image_size_px, **how)
            except UndeterminedError:
                continue
            self.known[name] = Known.of(found)
        truth = LimitedHomography(run.truth.g)
        turned = truth  # where nothing was found, nobody drives
        self.errors: dict[str, float] = {}
        """n of eq. 23 of the estimates."""
        for name, one in self.known.items():
            aligned, north = align_rotation(truth, one.model)
            self.errors[name] = float(n_error(truth, aligned))
            self.known[name] = replace(one, north_rad=north)
            turned = LimitedHomography(align_rotation(one.model, truth)[0])
        late = ROBOT.options.latency_s - OPTIONS.camera.latency_s
        north = align_rotation(truth, turned)[1]
        self.known["oracle"] = Known(turned, None, LENS, late, north)

    def world(self, start_uv: FloatArray, heading_rad: float) -> DrivingWorld:
        """Place the robot.

        Parameters
        ----------
        start_uv : (2,) array [px]
            Where its mark is seen, in raw pixels.
        heading_rad : float [rad]
            How it stands, from the world's x.

        Returns
        -------
        world : DrivingWorld
            The truth.
        """
        world = driving_world(self.run.truth.image_from_plane)
        return self.world_at(world.camera.unproject(world.undistorted(start_uv)), heading_rad)

    def world_at(self, xy: FloatArray, heading_rad: float) -> DrivingWorld:
        """Place the robot by the ground.

        Parameters
        ----------
        xy : (2,) array [m]
            Where its mark is.
        heading_rad : float [rad]
            How it stands, from the world's x.

        Returns
        -------
        world : DrivingWorld
            The truth.
        """
        world = driving_world(self.run.truth.image_from_plane)
        x, y = xy.tolist()
        return replace(world, start_m=(x, y), heading_rad=heading_rad)

    @property
    def seen(self) -> FloatArray:
        """(M, 2) [px]. Where the robot was seen during calibration."""
        return self.run.tracks.uv[self.run.tracks.rows(ROBOT.name)]

    def rig(
        self, name: str, start_uv: FloatArray, heading_rad: float
    ) -> AbstractContextManager[Rig]:
        """Set up the closed loop.

        Parameters
        ----------
        name : str
            Of what the pilot is told.
        start_uv : (2,) array [px]
            Where the robot's mark is seen, in raw pixels.
        heading_rad : float [rad]
            How it stands, from the world's x.

        Returns
        -------
        rig : context manager of Rig
            At rest, knowing where the robot is.
        """
        world = self.world(start_uv, heading_rad)
        return self.rig_at(name, np.array(world.start_m), heading_rad)

    @contextmanager
    def rig_at(self, name: str, xy: FloatArray, heading_rad: float) -> Iterator[Rig]:
        """Set up the closed loop, with the robot's place on the ground.

        Parameters
        ----------
        name : str
            Of what the pilot is told.
        xy : (2,) array [m]
            Where the robot's mark is.
        heading_rad : float [rad]
            How it stands, from the world's x.

        Yields
        ------
        rig : Rig
            At rest, knowing where the robot is.
        """
        truth, known = self.world_at(xy, heading_rad), self.known[name]
        robot = replace(ROBOT, start_m=truth.start_m, heading_rad=heading_rad)
        with World3d(self._options(robot), self.seed) as world:
            rig = Rig(
                truth,
                known.model,
                known.covariance,
                limits=limits_for(TOP_MPS),
                options=world_rig_options(),
                seed=self.seed,
                undistorted=known.undistort,
                time_offset_s=known.time_offset_s,
                body=WorldBody(world, robot.name, compass=self.run.compass),
            )
            rig.settle()
            yield rig

    def _options(self, robot: Robot3d) -> World3dOptions:
        return replace(OPTIONS, robots=(robot, *OPTIONS.robots[1:]), camera=self._camera)


@lru_cache(maxsize=2)
def robot_stage(seed: int, camera_hz: float = CAMERA_HZ) -> RobotStage:
    """Drive and calibrate once.

    Parameters
    ----------
    seed : int
        Of the world.
    camera_hz : float
        Pictures per second.

    Returns
    -------
    stage : RobotStage
        The same one for the same seed.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    UnreachableError
        If it cannot draw here.
    """
    return RobotStage(seed, camera_hz)
