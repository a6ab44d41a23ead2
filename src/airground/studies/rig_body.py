"""What a closed loop drives: a robot with a camera above it, in the embedded world or in another one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from airground.sim.point_eye import EyeOptions, PointEye
from airground.sim.vehicle_odometry import Odometer
from airground.sim.vehicle_plant import VehiclePlant
from airground.studies.rendered_eye import RenderedEye
from airground.studies.rig_options import plant_options

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.control.command import VelocityCommand
    from airground.geometry.arrays import FloatArray
    from airground.studies.driving_world import DrivingWorld
    from airground.studies.rig_options import RigOptions
    from airground.vision.eyes import Look

__all__ = ["BodyPose", "EmbeddedBody", "RigBody", "Sight", "Told"]


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Where the robot's mark was in a picture."""

    t: float
    """Stamp of the picture [s]."""

    uv: FloatArray
    """(2,) [px]. In raw pixels."""

    covariance: FloatArray | None = None
    """(2, 2) [px2]. Of the position, where that is known."""


class Told(NamedTuple):
    """What the robot says of its own motion."""

    t: float
    """Stamp, on the robot's clock [s]."""

    heading: float | None
    """By its compass [rad]; None where it has none to tell."""

    speed: float | None
    """By its wheels [m/s]."""

    turn_rate: float | None
    """By its wheels [rad/s]."""


class BodyPose(NamedTuple):
    """Where the robot is, in truth."""

    xy: FloatArray
    """(2,) [m]. Of its mark, or of its axle where the mark is above it."""

    theta: float
    """Heading [rad]."""

    v: float
    """Speed along it [m/s]."""

    omega: float
    """Turn rate [rad/s]."""


class RigBody(Protocol):
    """A robot, a camera and all that is late in them. Times are those of the loop, which begins at 0."""

    @property
    def frame_t(self) -> float | None:
        """Stamp of the newest picture that has arrived [s]; None before the first."""
        ...

    @property
    def pose(self) -> BodyPose:
        """Of now."""
        ...

    def advance(self, t: float) -> None:
        """Let time pass.

        Parameters
        ----------
        t : float [s]
            Until when.
        """
        ...

    def sightings(self) -> list[Sight]:
        """Give what has arrived from the camera since one last asked.

        Returns
        -------
        sightings : list of Sight
            In order; none for pictures in which the mark was not found.
        """
        ...

    def readings(self) -> list[Told]:
        """Give what has arrived from the robot since one last asked.

        Returns
        -------
        readings : list of Told
            In order.
        """
        ...

    def command(self, command: VelocityCommand) -> None:
        """Send a command, now.

        Parameters
        ----------
        command : VelocityCommand
            To the robot.
        """
        ...


class EmbeddedBody:
    """The robot and the camera of the embedded world.

    Parameters
    ----------
    world : DrivingWorld
        The truth.
    options : RigOptions
        How late, how often and how well.
    scale : float
        Its speed over the usual one.
    seed : int
        Of all noise.
    each : callable, optional
        Told of every picture, where they are rendered.
    """

    def __init__(
        self,
        world: DrivingWorld,
        options: RigOptions,
        scale: float,
        seed: int,
        each: Callable[[Look], None] | None = None,
    ) -> None:
        wheels, sight, odometry = np.random.default_rng([seed, 0xD1]).spawn(3)
        self.plant = VehiclePlant(
            world.start_m,
            world.heading_rad,
            "differential",
            plant_options(options, scale),
            rng=wheels,
        )
        self.eye = (
            RenderedEye(
                world.scene,
                world.robot,
                self.plant.pose,
                label="0",
                rate_hz=options.camera_hz,
                latency_s=options.latency_s,
                seed=seed,
                each=each,
            )
            if options.images and world.scene is not None
            else PointEye(
                world.camera,
                self.plant.pose,
                EyeOptions(
                    rate_hz=options.camera_hz,
                    latency_s=options.latency_s,
                    sigma_px=options.sigma_px,
                ),
                sight,
                lens=world.lens,
            )
        )
        noise = replace(options.odometry, heading_bias_rad=world.compass_bias_rad)
        self._odometer = Odometer(self.plant, noise, odometry)
        self._ahead_s = world.clock_offset_s
        self._camera_hz = options.camera_hz
        self._now = 0.0

    @property
    def frame_t(self) -> float | None:
        """Exposure of the newest picture that has arrived [s]."""
        frames = self.eye.frames
        return (frames - 1) / self._camera_hz if frames else None

    @property
    def pose(self) -> BodyPose:
        """Of now."""
        xy, theta = self.plant.pose(np.array([self._now]))
        return BodyPose(xy[0], float(theta[0]), self.plant.v, self.plant.omega)

    def advance(self, t: float) -> None:
        """Let time pass.

        Parameters
        ----------
        t : float [s]
            Until when.
        """
        self.plant.advance(t)
        self._now = t

    def sightings(self) -> list[Sight]:
        """Give what has arrived from the camera since one last asked.

        Returns
        -------
        sightings : list of Sight
            In order.
        """
        seen = self.eye.sightings(self._now)
        return [Sight(one.t, one.uv, getattr(one, "covariance", None)) for one in seen]

    def readings(self) -> list[Told]:
        """Give what has arrived from the robot since one last asked.

        Returns
        -------
        readings : list of Told
            In order.
        """
        return [
            Told(
                one.t + self._ahead_s,
                one.theta if np.isfinite(one.theta) else None,
                one.v,
                one.omega,
            )
            for one in self._odometer.readings(self._now)
        ]

    def command(self, command: VelocityCommand) -> None:
        """Send a command, now.

        Parameters
        ----------
        command : VelocityCommand
            To the robot.
        """
        self.plant.command(self._now, command)
