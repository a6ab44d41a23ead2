"""What the MuJoCo world is made of: robots like the paper's ER-1, vehicles of others, a camera, and how late all is."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, isfinite, pi
from typing import Literal

from airground.errors import InputError

__all__ = [
    "FAMILY",
    "CameraOptions3d",
    "Other3d",
    "Robot3d",
    "RobotOptions3d",
    "World3dOptions",
]

FAMILY = "4x4_50"
"""Of all tags in this world."""


def _positive(options: object, *names: str) -> None:
    for name in names:
        if not 0 < getattr(options, name) < inf:
            raise InputError(f"{name} must be positive, not {getattr(options, name)}")


def _not_negative(options: object, *names: str) -> None:
    for name in names:
        if not 0 <= getattr(options, name) < inf:
            raise InputError(f"{name} must be 0 or more, not {getattr(options, name)}")


@dataclass(frozen=True, slots=True)
class RobotOptions3d:
    """A robot with two driven wheels and a caster behind, and what it knows of itself."""

    wheel_radius_m: float = 0.05
    """Of the driven wheels, as built [m]."""

    track_m: float = 0.33
    """Between the middles of the driven wheels, as built [m]."""

    mass_kg: float = 9.0
    """Of the body, without wheels [kg]."""

    body_m: tuple[float, float, float] = (0.40, 0.30, 0.12)
    """Length, width and height of the body [m]."""

    tag_m: float = 0.24
    """Side of the tag's black square [m]."""

    tag_height_m: float = 0.30
    """Of the tag's face above the floor [m]."""

    tag_ahead_m: float = 0.0
    """Of the tag's middle, ahead of the axle [m]."""

    wheel_friction: float = 0.8
    """Coefficient of friction of the driven wheels on the floor."""

    caster_friction: float = 0.08
    """The same of the caster, which is dragged along."""

    motor_lag_s: float = 0.12
    """Time constant from a wheel's command to the servo's goal [s]."""

    motor_torque_nm: float = 2.0
    """Most that a motor gives [N m]."""

    most_speed_mps: float = 0.5
    """Most that a wheel is told [m/s], along its rim."""

    command_latency_s: float = 0.04
    """From a command's sending until the motors have it [s]."""

    watchdog_s: float = 0.5
    """Without a command for so long, it stops [s]."""

    ticks: int = 1200
    """Of an encoder in one turn of its wheel."""

    wheel_share: float = 0.005
    """Standard deviation, relative, by which each wheel's radius and the track differ from what its software takes
    them for."""

    readings_hz: float = 20.0
    """Readings per second."""

    latency_s: float = 0.05
    """From a measurement to its stamp and its arrival [s]."""

    compass_rad: float = 0.01
    """Standard deviation of the compass [rad]; white."""

    compass_bias_rad: float = 0.06
    """By how much its north is off everywhere [rad]."""

    compass_iron: float = 0.02
    """Iron on the robot: its field, across the compass, over the earth's; makes the heading swing once per turn."""

    turn_rate: Literal["encoders", "gyro"] = "encoders"
    """What a reading's turn rate comes from: both wheels' ticks, which slip, or the gyro, which drifts."""

    gyro_radps: float = 0.004
    """Standard deviation of the gyro [rad/s]; white."""

    gyro_bias_radps: float = 0.005
    """Standard deviation of its error at the start [rad/s]."""

    gyro_drift: float = 0.0005
    """How that error walks [rad/s per square root of a second]."""

    def __post_init__(self) -> None:
        _positive(
            self,
            "wheel_radius_m",
            "track_m",
            "mass_kg",
            "tag_m",
            "wheel_friction",
            "motor_lag_s",
            "motor_torque_nm",
            "most_speed_mps",
            "watchdog_s",
            "ticks",
            "readings_hz",
        )
        _not_negative(
            self,
            "caster_friction",
            "command_latency_s",
            "wheel_share",
            "latency_s",
            "compass_rad",
            "compass_iron",
            "gyro_radps",
            "gyro_bias_radps",
            "gyro_drift",
        )
        if not all(0 < side < inf for side in self.body_m):
            raise InputError(f"body_m must be positive, not {self.body_m}")
        if not (isfinite(self.tag_ahead_m) and isfinite(self.compass_bias_rad)):
            raise InputError("tag_ahead_m and compass_bias_rad must be finite")
        if self.turn_rate not in ("encoders", "gyro"):
            raise InputError(f"turn_rate must be 'encoders' or 'gyro', not {self.turn_rate!r}")
        least = self.body_m[2] + self.wheel_radius_m / 2
        if not least <= self.tag_height_m < inf:
            raise InputError(
                f"tag_height_m must be {least:g} or more, above the body, not {self.tag_height_m}"
            )


@dataclass(frozen=True, slots=True)
class Robot3d:
    """A robot of ours."""

    name: str = "red"
    """What it is called: letters, digits and underscores."""

    tag: int = 0
    """Number of its tag."""

    start_m: tuple[float, float] = (0.0, 0.0)
    """Of its axle's middle at first [m]."""

    heading_rad: float = 0.0
    """At first, counter-clockwise from x [rad]."""

    colour: tuple[float, float, float] = (0.75, 0.2, 0.2)
    """Red, green, blue; 0 to 1."""

    options: RobotOptions3d = field(default_factory=RobotOptions3d)
    """How it is built."""


def _round() -> tuple[tuple[float, float], ...]:
    return ((-1.2, 1.3), (1.2, 1.3), (1.2, 1.6), (-1.2, 1.6))


def _cart() -> RobotOptions3d:
    return RobotOptions3d(body_m=(0.50, 0.36, 0.14), track_m=0.39, mass_kg=14.0)


@dataclass(frozen=True, slots=True)
class Other3d:
    """A vehicle of somebody else, whose driver goes round by a route and tells us nothing."""

    name: str = "cart"
    """What we call it."""

    tag: int = 9
    """Number of its tag."""

    route_m: tuple[tuple[float, float], ...] = field(default_factory=_round)
    """Corners of the route [m]; it is driven round and round, from the first."""

    speed_mps: float = 0.2
    """Along it [m/s]."""

    colour: tuple[float, float, float] = (0.25, 0.35, 0.6)
    """Red, green, blue; 0 to 1."""

    options: RobotOptions3d = field(default_factory=_cart)
    """How it is built."""

    def __post_init__(self) -> None:
        if len(self.route_m) < 2 or self.route_m[0] == self.route_m[1]:
            raise InputError("route_m must have two different corners or more")
        _positive(self, "speed_mps")


@dataclass(frozen=True, slots=True)
class CameraOptions3d:
    """An overhead camera. Where it moves, position and target are not used."""

    position_m: tuple[float, float, float] = (0.0, -1.9, 3.3)
    """Centre of projection [m]."""

    target_m: tuple[float, float, float] = (0.0, 0.1, 0.3)
    """What is in the middle of the image [m]."""

    roll_rad: float = 0.0
    """About the optical axis, clockwise as the camera sees it [rad]."""

    fovy_rad: float = 50 * pi / 180
    """Angle from the top of the image to its bottom, through its middle, before the lens [rad]."""

    image_size_px: tuple[int, int] = (1280, 720)
    """Width and height [px]."""

    k1: float = -0.06
    """Division model, for radii over half of the diagonal: -0.06 pulls the corners inwards by about 6 %."""

    noise_dark: float = 1.5
    """Standard deviation of the sensor's noise everywhere [grey levels]."""

    noise_bright: float = 2.0
    """The same of what photons add in white [grey levels]."""

    rate_hz: float = 20.0
    """Pictures per second."""

    latency_s: float = 0.06
    """From a picture's exposure to its stamp and its arrival [s]."""

    samples: int = 4
    """Of a pixel, along edges: 0 is fast and jagged."""

    def __post_init__(self) -> None:
        _positive(self, "rate_hz")
        _not_negative(self, "noise_dark", "noise_bright", "latency_s", "samples")
        if not 0 < self.fovy_rad < 0.95 * pi:
            raise InputError(f"fovy_rad must lie between 0 and {0.95 * pi:.2f}")
        if min(self.image_size_px) < 16 or max(self.image_size_px) > 4096:
            raise InputError(f"image_size_px must be 16 to 4096, not {self.image_size_px}")
        if not abs(self.k1) <= 0.3:
            raise InputError(f"k1 must lie in -0.3 to 0.3, not {self.k1}")


def _robots() -> tuple[Robot3d, ...]:
    return (Robot3d(start_m=(-0.2, -0.95)),)


def _others() -> tuple[Other3d, ...]:
    return (Other3d(),)


@dataclass(frozen=True, slots=True)
class World3dOptions:
    """All of it."""

    robots: tuple[Robot3d, ...] = field(default_factory=_robots)
    """Ours."""

    others: tuple[Other3d, ...] = field(default_factory=_others)
    """Not ours."""

    camera: CameraOptions3d = field(default_factory=CameraOptions3d)
    """That looks down on them."""

    step_s: float = 0.002
    """Of the physics [s]."""

    floor: str = "warehouse"
    """Texture of the floor: a name that `airground.sim.ground_texture` knows."""

    def __post_init__(self) -> None:
        if not 1e-4 <= self.step_s <= 0.005:
            raise InputError(f"step_s must be 0.0001 to 0.005, not {self.step_s}")
        names = [one.name for one in self.vehicles]
        if not all(name.isidentifier() for name in names) or len(set(names)) < len(names):
            raise InputError(
                f"names must be different and of letters, digits and underscores, not {names}"
            )
        tags = [one.tag for one in self.vehicles]
        if len(set(tags)) < len(tags):
            raise InputError(f"tags must be different, not {tags}")

    @property
    def vehicles(self) -> tuple[Robot3d | Other3d, ...]:
        """All that drive: ours, then others."""
        return (*self.robots, *self.others)
