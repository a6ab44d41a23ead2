"""A robot that drives legs under a camera of which nothing is known: truth, delays and noise."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, hypot, inf, pi, remainder
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.guidance import next_leg
from airground.calibration.guidance_types import LegOptions
from airground.calibration.online import OnlineCalibrator
from airground.calibration.online_state import OnlineOptions
from airground.control import STOP, Limits, SafetyMemory
from airground.control.legs import DriveLeg, LegDriver, LegInput, LegTick, scripted_leg
from airground.control.safety.blind import BlindSafety
from airground.control.safety.blind_types import BlindSituation
from airground.control.safety.bounds import SafetyBounds
from airground.errors import UndeterminedError
from airground.sim import SimCamera, demo_world
from airground.sim.point_eye import EyeOptions, PointEye
from airground.sim.vehicle_odometry import Odometer, OdometryNoise
from airground.sim.vehicle_options import PlantOptions
from airground.sim.vehicle_plant import VehiclePlant

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray
    from airground.sim.vehicle_drives import VehicleKind

HZ = 50.0
READINGS = OdometryNoise(speed_share=0.02, turn_share=0.02, latency_s=0.05)


def tilted() -> SimCamera:
    return demo_world().camera


def ceiling() -> SimCamera:
    return SimCamera.looking_down(
        focal_length_px=600.0,
        tilt_rad=0.0,
        height_m=3.2,
        image_size_px=(1280, 720),
        heading_rad=0.7,
    )


def mirrored(camera: SimCamera) -> SimCamera:
    """The same for a compass that counts clockwise: y of the ground is the other way."""
    return SimCamera(camera.image_from_ground @ np.diag([1.0, -1.0, 1.0]), camera.image_size_px)


class Velocity:
    """A mark's velocity by a line through its last sightings, as a tracker would tell it."""

    def __init__(self, count: int = 8) -> None:
        self.count = count
        self.rows: list[tuple[float, float, float]] = []

    def take(self, t: float, u: float, v: float) -> tuple[float, float] | None:
        self.rows = [*self.rows[1 - self.count :], (t, u, v)]
        if len(self.rows) < 3:
            return None
        rows = np.array(self.rows)
        s = rows[:, 0] - rows[:, 0].mean()
        a, b = (s @ rows[:, 1:] / (s @ s)).tolist()
        return a, b


@dataclass(slots=True)
class Ended:
    """One leg, as it was in truth."""

    wanted: DriveLeg
    length_m: float
    heading_error_rad: float
    whole: bool
    line: str


@dataclass(slots=True)
class World:
    """How it is set up."""

    camera: SimCamera
    xy: FloatArray
    theta: float
    seed: int
    kind: VehicleKind = "differential"
    limits: Limits = field(default_factory=Limits)
    readings: OdometryNoise = READINGS
    plant: PlantOptions = field(default_factory=PlantOptions)
    sigma_px: float = 1.0
    margin_px: float = 40.0
    hidden_latency_s: float = 0.05
    others: tuple[tuple[float, float, float], ...] = ()


class LegLoop:
    """The closed loop: plant, odometer, eye, driver, safety, calibrator."""

    def __init__(
        self, world: World, *, wanted_sigma: float = 0.05, calibrates: bool = True
    ) -> None:
        self.world, self.wanted_sigma, self.calibrates = world, wanted_sigma, calibrates
        wheels, sight, odometry = np.random.default_rng([world.seed, 0x1E6]).spawn(3)
        self.body = VehiclePlant(world.xy, world.theta, world.kind, world.plant, rng=wheels)
        eye = EyeOptions(sigma_px=world.sigma_px)
        self.eye = PointEye(world.camera, self.body.pose, eye, sight)
        self.odometer = Odometer(self.body, world.readings, odometry)
        self.driver = LegDriver(world.limits)
        self.size = world.camera.image_size_px
        self.safety = BlindSafety(world.limits, self.size, SafetyBounds())
        self.memory = SafetyMemory()
        self.calibrator = OnlineCalibrator(
            OnlineOptions(
                sigma_px=world.sigma_px,
                speed_noise=0.06,  # 2 % that changes over 4 s
                time_offset_s=-world.hidden_latency_s,
                image_size_px=self.size,
            )
        )
        self.velocity = Velocity()
        self.tick = 0
        self.uv: tuple[float, float] | None = None
        self.uv_dot: tuple[float, float] | None = None
        self.seen_t = -inf
        self.read: tuple[float, float, float, float] | None = None
        self.closest_px = inf
        self.nearest_px = inf  # to others, over the distance to keep
        self.ended: list[Ended] = []
        self.path_m = 0.0
        self.lines: list[str] = []
        self.phase = ""
        self.said = LegTick(STOP, "wait", wants_leg=True, line="", aborted=False)
        self.log: list[tuple[LegInput, LegTick, BlindSituation]] = []
        self.image_sigma = inf  # of ground velocities, over the image
        self.choose = self.guided

    @property
    def t(self) -> float:
        return self.tick / HZ

    @property
    def stops(self) -> list[str]:
        """Why safety stopped it, but for the start."""
        return [f"{s.t:.2f} {s.reason.value}: {s.line}" for s in self.memory.stops if s.t > 0.5]

    def guided(self) -> DriveLeg:
        """As the session chooses legs."""
        assert self.uv is not None
        margin = self.world.margin_px
        known = self.calibrator.calibration() is not None
        if known and self.calibrator.state.relative_sigma < 0.3:
            try:
                leg = next_leg(
                    self.calibrator,
                    self.uv,
                    self.size,
                    margin_px=1.5 * margin,
                    options=LegOptions(
                        sigma_px=self.world.sigma_px, longest_m=2.0, turn_cost_m=1.0
                    ),
                )
                self.image_sigma = leg.relative_sigma
                return DriveLeg(leg.heading_rad, leg.length_m)
            except UndeterminedError:
                pass
        return scripted_leg(
            self.driver.map,
            self.uv,
            self.size,
            self.driver.driven,
            heading_rad=self.driver.gauge.heading_rad,
            margin_px=margin,
            others=self.world.others,
        )

    def step(self) -> None:
        world, t = self.world, self.t
        self.body.advance(t)
        for seen in self.eye.sightings(t):
            self.seen_t = seen.t + world.hidden_latency_s
            u, v = seen.uv.tolist()
            self.uv, self.uv_dot = (u, v), self.velocity.take(seen.t, u, v)
            if self.calibrates:
                self.calibrator.sighting(self.seen_t, "robot", (u, v))
        for one in self.odometer.readings(t):
            self.read = (one.theta, one.v, one.t, one.omega)
            if self.calibrates:
                self.calibrator.reading(one.t, "robot", heading=one.theta, speed=one.v)
        heading, speed, read_t, _ = self.read or (None, None, None, None)
        driver = self.driver
        told = LegInput(
            t,
            1 / HZ,
            self.size,
            heading,
            speed,
            read_t,
            None,
            self.uv,
            self.uv_dot,
            self.seen_t,
            world.margin_px,
            world.others,
            held=not self.memory.going,
        )
        said = driver.tick(told)
        self.said, self.phase = said, said.phase
        if not self.lines or said.line != self.lines[-1]:
            self.lines.append(said.line)
        step_px = None
        if self.uv is not None and driver.gauge.known:
            step_px = driver.map.px_per_m(self.uv, driver.gauge.heading_rad)
        situation = BlindSituation(
            t,
            self.uv,
            self.seen_t,
            self.uv_dot,
            step_px,
            speed,
            driver.gauge.turn_rate if driver.gauge.known else None,
            frame_t=self.seen_t,
            robot_t=read_t,
        )
        self.log.append((told, said, situation))
        sent = self.safety.check(said.command, situation, self.memory)
        self.memory = sent.memory
        self.body.command(t, sent.command)
        uv = world.camera.project(self.body.xy)
        width, height = self.size
        u, v = uv.tolist()
        self.closest_px = min(self.closest_px, u + 0.5, width - 0.5 - u, v + 0.5, height - 0.5 - v)
        for a, b, clearance in world.others:
            self.nearest_px = min(self.nearest_px, hypot(u - a, v - b) - clearance)
        self.path_m += abs(self.body.v) / HZ
        self.tick += 1

    def leg(self, leg: DriveLeg | None = None, most_s: float = 60.0) -> Ended | None:
        """Drive one leg to its end or until it is given up; None where that takes too long."""
        driver = self.driver
        end = self.tick + round(most_s * HZ)
        while not (driver.wants_leg and self.memory.going and self.uv and driver.gauge.known):
            self.step()
            if self.tick >= end:
                return None
        leg = leg or self.choose()
        driver.give(leg)
        start_xy, before = None, "turn"
        while True:
            self.step()
            if self.said.wants_leg:
                break
            if self.phase == "drive" and before != "drive":
                start_xy = self.body.xy
            before = self.phase
            if self.tick >= end:
                return None
        for _ in range(15):
            self.step()
        moved = np.zeros(2) if start_xy is None else self.body.xy - start_xy
        course = atan2(moved[1], moved[0])
        ended = Ended(
            leg,
            float(hypot(*moved)),
            remainder(course - leg.heading_rad, 2 * pi),
            not self.said.aborted,
            self.said.line,
        )
        self.ended.append(ended)
        return ended

    def calibrate(self, most: int = 12, *, everywhere: bool = False) -> bool:
        """Drive legs until the calibrator is content: where the robot was, or everywhere in the image."""
        for _ in range(most):
            if self.leg() is None:
                return False
            if everywhere:
                self.guided()
            if everywhere and self.image_sigma <= self.wanted_sigma:
                return True
            if not everywhere and self.calibrator.good_enough(self.wanted_sigma):
                return True
        return False


def start_in(
    camera: SimCamera, rng: np.random.Generator, *, margin_px: float = 60.0, edge: bool = False
) -> tuple[FloatArray, float]:
    """A place that is seen, and a heading; at the edge of it, heading out."""
    width, height = camera.image_size_px
    while True:
        uv = rng.uniform(margin_px, [width - margin_px, height - margin_px])
        if edge:
            side = rng.integers(4)
            uv[side // 2] = margin_px if side % 2 == 0 else [width, height][side // 2] - margin_px
        xy = camera.unproject(uv)
        if not np.isfinite(xy).all():
            continue
        scale = np.linalg.svd(jacobian(camera, xy), compute_uv=False)[-1]
        if scale < 40:  # so far away that nobody would put a robot there
            continue
        theta = rng.uniform(-pi, pi)
        if edge:
            out = uv - np.array([width, height]) / 2
            x, y = np.linalg.solve(jacobian(camera, xy), out)
            theta = atan2(y, x) + rng.uniform(-0.6, 0.6)
        return xy, float(theta)


def jacobian(camera: SimCamera, xy: FloatArray) -> FloatArray:
    return np.stack([camera.project_velocity(xy, e) for e in np.eye(2)], axis=-1)
