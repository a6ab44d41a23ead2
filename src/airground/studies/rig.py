"""A robot, a camera and a pilot in the embedded world: the closed loop in simulated time, with all its delays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.control import Floor
from airground.control.estimation.state_filter import StateFilter
from airground.control.pilot import Links, Pilot
from airground.control.safety.layer import SafetyLayer
from airground.control.speed_hold import SpeedHold
from airground.geometry.arrays import FloatArray
from airground.studies.rig_body import EmbeddedBody
from airground.studies.rig_options import (
    USUAL_MPS,
    RigOptions,
    safety_bounds,
    state_options,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.control import Controller, Limits
    from airground.control.pilot import PilotTick
    from airground.control.separation import Fence
    from airground.geometry import LimitedHomography
    from airground.studies.driving_world import DrivingWorld
    from airground.studies.rig_body import BodyPose, RigBody
    from airground.vision.eyes import Look

__all__ = ["Drive", "Rig"]


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
    fenced : callable, optional
        From the pilot's floor to the fence that the safety layer holds; none where not given.
    body : RigBody, optional
        Robot and camera; those of the embedded world where not given.
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
        fenced: Callable[[Floor], Fence] | None = None,
        body: RigBody | None = None,
    ) -> None:
        self.world, self.limits, self.options = world, limits, options
        scale = limits.speed_mps / USUAL_MPS
        self.body: RigBody = body or EmbeddedBody(world, options, scale, seed, each)
        raw_ground = world.distorted(world.ground_uv)
        self._undistorted = undistorted or (lambda uv: uv)
        self.floor = Floor(model, self._undistorted(raw_ground))
        self.pilot = Pilot(
            StateFilter(self.floor, state_options(options, scale, time_offset_s)),
            SafetyLayer(
                self.floor,
                limits,
                covariance,
                safety_bounds(scale),
                fence=None if fenced is None else fenced(self.floor),
                # The safety layer knows undistorted pixels only, whose image has no straight border.
                image_size_px=None if world.lens is not None else world.camera.image_size_px,
            ),
            speed_hold=SpeedHold() if options.hold_speed else None,
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
        poses: list[BodyPose] = []
        known = len(self.pilot.memory.stops)
        for _ in range(max(2, round(most_s * self.options.control_hz))):
            tick, pose = self._step()
            ticks.append(tick)
            poses.append(pose)
            if tick.done:
                break
        xy = np.array([pose.xy for pose in poses])
        last = ticks[-1]
        guidance = last.guidance
        assert guidance is not None
        trouble = guidance.trouble
        if not (last.done or trouble):
            trouble = "" if last.sent.stop is None else last.sent.stop.line
            trouble = trouble or f"not there after {most_s:.0f} s"
        return Drive(
            t=np.array([tick.t for tick in ticks]),
            xy=xy,
            theta=np.array([pose.theta for pose in poses]),
            uv=self.world.distorted(self.world.camera.project(xy)),
            v=np.array([pose.v for pose in poses]),
            omega=np.array([pose.omega for pose in poses]),
            commands=np.array([(k.command.v, k.command.omega) for k in ticks]),
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
        xy = self.body.pose.xy
        return xy, self.world.distorted(self.world.camera.project(xy))

    def stands_off(self, goal_px: FloatArray, seconds: float = 0.5) -> tuple[float, float]:
        """Stand, and measure how far from a goal, in truth.

        Parameters
        ----------
        goal_px : (2,) array [px]
            Where the robot's mark should be, in raw pixels.
        seconds : float [s]
            How long it stands before it is measured.

        Returns
        -------
        off_px : float [px]
            Distance in the image.
        off_m : float [m]
            Distance on the ground.
        """
        xy, uv = self.rest(seconds)
        there = self.world.camera.unproject(self.world.undistorted(goal_px))
        return float(np.hypot(*(uv - goal_px))), float(np.hypot(*(xy - there)))

    def _step(self) -> tuple[PilotTick, BodyPose]:
        t, rate = self.t, self.options.control_hz
        self.body.advance(t)
        pose = self.body.pose
        state_filter = self.pilot.state_filter
        late = 0.0 if self.options.predict else self.options.latency_s
        for seen in self.body.sightings():
            state_filter.see(seen.t + late, self._undistorted(seen.uv), seen.covariance)
        for told in self.body.readings():
            state_filter.read(
                told.t, heading=told.heading, speed=told.speed, turn_rate=told.turn_rate
            )
        tick = self.pilot.tick(t, 1 / rate, Links(frame_t=self.body.frame_t))
        self.body.command(tick.command)
        self._tick += 1
        return tick, pose
