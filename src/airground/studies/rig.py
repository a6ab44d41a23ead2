"""A robot, a camera and a pilot in the embedded world: the closed loop in simulated time, with all its delays."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.control import Floor, Limits
from airground.control.pilot import Pilot
from airground.control.safety import SafetyLayer
from airground.control.safety_bounds import SafetyBounds
from airground.control.state_filter import StateFilter
from airground.control.state_filter_options import StateOptions
from airground.geometry.arrays import FloatArray
from airground.sim.point_eye import EyeOptions, PointEye
from airground.sim.vehicle_odometry import Odometer, OdometryNoise
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant
from airground.studies.rendered_eye import RenderedEye

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.control import Controller
    from airground.control.pilot import PilotTick
    from airground.geometry import LimitedHomography
    from airground.studies.driving_world import DrivingWorld
    from airground.vision.eyes import Look

__all__ = ["LAG_S", "Drive", "Rig", "RigOptions", "limits_for"]

LAG_S = 0.15
"""What controllers are told of how slowly the robot's speed follows its commands [s]; in truth 0.12."""

USUAL_MPS = 0.3  # the speed that the defaults of limits and noise are meant for


def limits_for(speed_mps: float) -> Limits:
    """Limits of a robot that drives at a speed: the defaults, for one that is larger or smaller.

    Parameters
    ----------
    speed_mps : float [m/s]
        To be held.

    Returns
    -------
    limits : Limits
        Accelerations grow with the speed: it is reached within the same time.
    """
    usual, scale = Limits(), speed_mps / USUAL_MPS
    return Limits(
        speed_mps=speed_mps,
        reverse_mps=0.5 * speed_mps,
        acceleration_mps2=usual.acceleration_mps2 * scale,
        deceleration_mps2=usual.deceleration_mps2 * scale,
        lateral_acceleration_mps2=usual.lateral_acceleration_mps2 * scale,
    )


@dataclass(frozen=True, slots=True)
class RigOptions:
    """How late, how often and how well."""

    latency_s: float = 0.1
    """From a picture's exposure to the arrival of what was seen in it [s]."""

    actuation_s: float = 0.05
    """From a command's sending to its effect [s]."""

    camera_hz: float = 20.0
    """Pictures per second."""

    control_hz: float = 40.0
    """Commands per second."""

    sigma_px: float = 0.3
    """Noise of sightings, where nothing is rendered [px]."""

    odometry: OdometryNoise = field(default_factory=OdometryNoise)
    """Noise of the robot's own readings."""

    images: bool = False
    """Whether pictures are rendered, and the robot's tag is found in them."""

    predict: bool = True
    """Whether the pilot allows for what is late; without, it takes what it saw last for now."""


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """What happened while one controller had the robot."""

    t: FloatArray
    """(N,) [s]. Times of the ticks."""

    xy: FloatArray
    """(N, 2) [m]. True positions."""

    theta: FloatArray
    """(N,) [rad]. True headings."""

    uv: FloatArray
    """(N, 2) [px]. True image points of the robot's mark, in raw pixels."""

    v: FloatArray
    """(N,) [m/s]. True speeds along the heading."""

    omega: FloatArray
    """(N,) [rad/s]. True turn rates."""

    commands: FloatArray
    """(N, 2) [m/s, rad/s]. As sent."""

    progress: FloatArray
    """(N,). Of the controller."""

    done: bool
    """Whether the controller had arrived."""

    trouble: str
    """Why it went no further; empty where it arrived."""

    stops: tuple[str, ...]
    """Stops for safety on the way, a line each; that before the first command is none."""

    @property
    def duration(self) -> float:
        """Of it [s]."""
        return float(self.t[-1] - self.t[0])


class Rig:
    """The closed loop. What steers sees the camera's sightings and the robot's readings, and a floor that is estimated.

    Parameters
    ----------
    world : DrivingWorld
        The truth.
    model : LimitedHomography
        The relation between image and ground that the pilot is given.
    covariance : (6, 6) array or None
        Of that, for the safety layer.
    limits : Limits
        Of the robot.
    options : RigOptions
        How late, how often and how well.
    seed : int
        Of all noise.
    undistorted : callable, optional
        From raw pixels to those of `model`; none where not given.
    time_offset_s : float [s]
        What the pilot takes the robot's clock to be ahead of the camera's.
    each : callable, optional
        Told of every picture, where they are rendered.
    """

    def __init__(
        self,
        world: DrivingWorld,
        model: LimitedHomography,
        covariance: FloatArray | None,
        *,
        limits: Limits,
        options: RigOptions,
        seed: int,
        undistorted: Callable[[FloatArray], FloatArray] | None = None,
        time_offset_s: float = 0.0,
        each: Callable[[Look], None] | None = None,
    ) -> None:
        self.world, self.limits, self.options = world, limits, options
        scale = limits.speed_mps / USUAL_MPS
        wheels, sight, odometry = np.random.default_rng([seed, 0xD1]).spawn(3)
        self.plant = VehiclePlant(
            world.start_m,
            world.heading_rad,
            "differential",
            _plant_options(options, scale),
            rng=wheels,
        )
        self._eye = (
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
        raw_ground = world.distorted(world.ground_uv)
        self._undistorted = undistorted or (lambda uv: uv)
        self.floor = Floor(model, self._undistorted(raw_ground))
        self.pilot = Pilot(
            StateFilter(self.floor, _state_options(options, scale, time_offset_s)),
            SafetyLayer(
                self.floor,
                limits,
                covariance,
                _safety_bounds(scale),
                # The safety layer knows undistorted pixels only, whose image has no straight border.
                image_size_px=None if world.lens is not None else world.camera.image_size_px,
            ),
        )
        self._tick = 0

    @property
    def t(self) -> float:
        """Now [s]."""
        return self._tick / self.options.control_hz

    def settle(self) -> None:
        """Look and listen until the pilot knows where the robot is, at most for 3 s."""
        self.pilot.assign(None)
        for _ in range(round(3 * self.options.control_hz)):
            self._step()
            if self.pilot.memory.going and self.pilot.state_filter.ready:
                break

    def drive(self, controller: Controller, *, most_s: float) -> Drive:
        """Let a controller have the robot until it has arrived.

        Parameters
        ----------
        controller : Controller
            Built on `floor`.
        most_s : float [s]
            Give up after so long.

        Returns
        -------
        drive : Drive
            What happened.
        """
        self.pilot.assign(controller)
        ticks: list[PilotTick] = []
        moving: list[tuple[float, float]] = []
        known = len(self.pilot.memory.stops)
        for _ in range(max(2, round(most_s * self.options.control_hz))):
            tick = self._step()
            ticks.append(tick)
            moving.append((self.plant.v, self.plant.omega))
            if tick.done:
                break
        t = np.array([tick.t for tick in ticks])
        xy, theta = self.plant.pose(t)
        last = ticks[-1]
        guidance = last.guidance
        assert guidance is not None
        trouble = guidance.trouble
        if not (last.done or trouble):
            trouble = "" if last.sent.stop is None else last.sent.stop.line
            trouble = trouble or f"not there after {most_s:.0f} s"
        return Drive(
            t=t,
            xy=xy,
            theta=theta,
            uv=self.world.distorted(self.world.camera.project(xy)),
            v=np.array([v for v, _ in moving]),
            omega=np.array([omega for _, omega in moving]),
            commands=np.array([(k.sent.command.v, k.sent.command.omega) for k in ticks]),
            progress=np.array([k.guidance.progress for k in ticks if k.guidance is not None]),
            done=last.done,
            trouble="" if last.done else trouble,
            stops=tuple(
                f"{stop.t:.2f} s: {stop.reason.value}: {stop.line}"
                for stop in self.pilot.memory.stops[known:]
            ),
        )

    def rest(self, seconds: float) -> tuple[FloatArray, FloatArray]:
        """Stand, so that all that is on its way has had its effect.

        Parameters
        ----------
        seconds : float [s]
            How long.

        Returns
        -------
        xy : (2,) array [m]
            Where the robot stands, in truth.
        uv : (2,) array [px]
            Where its mark is in the image, in truth, in raw pixels.
        """
        self.pilot.assign(None)
        for _ in range(round(seconds * self.options.control_hz)):
            self._step()
        xy = self.plant.xy
        return xy, self.world.distorted(self.world.camera.project(xy))

    def _step(self) -> PilotTick:
        t, rate = self.t, self.options.control_hz
        self.plant.advance(t)
        state_filter = self.pilot.state_filter
        late = 0.0 if self.options.predict else self.options.latency_s
        for seen in self._eye.sightings(t):
            covariance = getattr(seen, "covariance", None)
            state_filter.see(seen.t + late, self._undistorted(seen.uv), covariance)
        for reading in self._odometer.readings(t):
            heading = reading.theta if np.isfinite(reading.theta) else None
            state_filter.read(
                reading.t + self.world.clock_offset_s,
                heading=heading,
                speed=reading.v,
                turn_rate=reading.omega,
            )
        frames = self._eye.frames
        frame_t = (frames - 1) / self.options.camera_hz if frames else None
        tick = self.pilot.tick(t, 1 / rate, frame_t=frame_t)
        self.plant.command(t, tick.sent.command)
        self._tick += 1
        return tick


def _plant_options(options: RigOptions, scale: float) -> PlantOptions:
    usual = PlantOptions()
    return PlantOptions(
        latency_s=options.actuation_s,
        speed_mps=usual.speed_mps * scale,
        reverse_mps=usual.reverse_mps * scale,
        acceleration_mps2=usual.acceleration_mps2 * scale,
        track_width_m=usual.track_width_m * scale,
        slip=0.02,
        turn_slip=0.02,
    )


def _state_options(options: RigOptions, scale: float, time_offset_s: float) -> StateOptions:
    usual = StateOptions()
    return StateOptions(
        actuation_delay_s=options.actuation_s if options.predict else 0.0,
        speed_lag_s=0.12,
        turn_lag_s=0.1,
        time_offset_s=time_offset_s,
        sighting_sigma_px=max(options.sigma_px, 0.05),
        heading_sigma_rad=0.02,
        heading_bias_sigma_rad=0.03,
        speed_sigma_mps=usual.speed_sigma_mps * scale,
        speed_stray_mps=usual.speed_stray_mps * scale,
        free_speed_mps=usual.free_speed_mps * scale,
        path_walk_m=usual.path_walk_m * scale,
        fastest_mps=usual.fastest_mps * scale,
        lost_m=usual.lost_m * scale,
    )


def _safety_bounds(scale: float) -> SafetyBounds:
    usual = SafetyBounds()
    return SafetyBounds(
        jump_m=usual.jump_m * scale,
        position_sigma_m=usual.position_sigma_m * scale,
        speed_error_mps=usual.speed_error_mps * scale,
    )
