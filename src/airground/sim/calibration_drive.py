"""A calibration drive in the embedded world: what a tracker and a robot's odometry would have written down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.recordings import Motion, Tracks
from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.unicycle import roll_out

if TYPE_CHECKING:
    from airground.sim.world import FigureEight, World

__all__ = ["CalibrationDrive", "DriveNoise", "Path", "calibration_drive", "drive_eight"]

STEP_S = 0.005  # of the truth; tracks and odometry interpolate it


@dataclass(frozen=True, slots=True)
class DriveNoise:
    """How badly things are measured, and how often."""

    tracks_hz: float = 30.0
    """Sightings per second."""

    motion_hz: float = 20.0
    """Readings per second."""

    pixel_px: float = 1.0
    """Standard deviation of a sighting, in u and in v [px]; white."""

    heading_rad: float = 0.01
    """Standard deviation of the compass [rad]; white."""

    speed_mps: float = 0.01
    """Standard deviation of the speed reading [m/s]; white."""

    slip: float = 0.02
    """Standard deviation of the relative error of speed and distance that changes slowly."""

    slip_s: float = 4.0
    """Correlation time of the slip [s]."""

    distance_m_per_sqrt_m: float = 0.002
    """Random walk of the odometer, per square root of the way [m/sqrt(m)]."""

    time_offset_s: float = 0.0
    """What to add to a time of the tracks for the time of the motion [s]."""

    def __post_init__(self) -> None:
        if not (self.tracks_hz > 0 and self.motion_hz > 0 and self.slip_s > 0):
            raise InputError("tracks_hz, motion_hz and slip_s must be positive")


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """The truth, at equal steps of time."""

    t: FloatArray
    """(N,) [s]. From 0."""

    xy: FloatArray
    """(N, 2) [m]. Ground position."""

    theta: FloatArray
    """(N,) [rad]. Heading; does not wrap."""

    way: FloatArray
    """(N,) [m]. Distance driven so far."""

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Interpolate; the steps are so short that the error is below 1e-5 m.

        Parameters
        ----------
        t : (M,) array [s]
            Times.

        Returns
        -------
        xy : (M, 2) array [m]
            Positions.
        theta : (M,) array [rad]
            Headings.
        way : (M,) array [m]
            Distance driven.
        """
        x, y, theta, way = (np.interp(t, self.t, a) for a in (*self.xy.T, self.theta, self.way))
        return np.column_stack([x, y]), theta, way


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationDrive:
    """Recordings, and the truth behind them."""

    tracks: Tracks
    """Sightings of the robot and of the cart while it is in view."""

    motion: Motion
    """Readings of the robot: heading, speed and distance."""

    path: Path
    """Where the robot was, on the clock of the tracks."""

    cart: str
    """Name of the target that is in the tracks only."""

    cart_xy_dot: FloatArray
    """(2,) [m/s]. The cart's true ground velocity."""


def drive_eight(eight: FigureEight, duration_s: float) -> Path:
    """Drive a unicycle along a figure eight at steady speed.

    The turn rate is fed forward from the curve's tangent; the truth is what the unicycle then does, and stays within
    1 mm of the curve for minutes.

    Parameters
    ----------
    eight : FigureEight
        What to follow, again and again.
    duration_s : float [s]
        How long.

    Returns
    -------
    path : Path
        Every 5 ms.
    """
    phi = np.linspace(0, 2 * np.pi, 100_001)
    curve = np.column_stack([np.sin(phi), np.sin(2 * phi)]) * eight.half_size_m
    steps = np.diff(curve, axis=0)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
    tangent = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    middle = (length[:-1] + length[1:]) / 2

    t: FloatArray = np.arange(round(duration_s / STEP_S) + 1, dtype=np.float64) * STEP_S
    way = eight.speed_mps * t
    # An eight turns as far left as right, so the heading repeats with the rounds.
    theta = np.interp(way, middle, tangent, period=length[-1])
    omega = np.diff(theta) / STEP_S
    xy, theta = roll_out(eight.centre_m, float(theta[0]), eight.speed_mps, omega, STEP_S)
    return Path(t, xy, theta, way)


def calibration_drive(
    world: World,
    rng: np.random.Generator,
    *,
    duration_s: float = 75.0,
    noise: DriveNoise | None = None,
) -> CalibrationDrive:
    """Record a calibration drive.

    Parameters
    ----------
    world : World
        Camera, robot and cart.
    rng : Generator
        Where all noise comes from.
    duration_s : float [s]
        Of the recording.
    noise : DriveNoise, optional
        The defaults where not given.

    Returns
    -------
    drive : CalibrationDrive
        Tracks, motion and truth.

    Raises
    ------
    InputError
        If the recording is too short to hold a sighting and a reading, or nothing comes into view.
    """
    noise = noise or DriveNoise()
    if not duration_s >= 1.0:
        raise InputError(f"duration_s must be 1 or more, not {duration_s}")
    path = drive_eight(world.path, duration_s)
    tracks, cart_xy_dot = _sightings(world, path, noise, rng)
    return CalibrationDrive(
        tracks=tracks,
        motion=_readings(world.robot, path, noise, rng),
        path=path,
        cart=world.cart.target,
        cart_xy_dot=cart_xy_dot,
    )


def _sightings(
    world: World, path: Path, noise: DriveNoise, rng: np.random.Generator
) -> tuple[Tracks, FloatArray]:
    t = np.arange(0.0, path.t[-1] + 1e-9, 1 / noise.tracks_hz)
    cart = world.cart
    cart_xy_dot = cart.speed_mps * np.array([np.cos(cart.heading_rad), np.sin(cart.heading_rad)])
    late = t[t >= cart.start_s]
    rows = [
        (world.robot, t, path.at(t)[0]),
        (cart.target, late, cart.start_m + (late - cart.start_s)[:, None] * cart_xy_dot),
    ]
    names: list[str] = []
    times, points = [], []
    for name, when, xy in rows:
        uv = world.camera.project(xy) + rng.normal(0.0, noise.pixel_px, xy.shape)
        seen = world.camera.visible(xy)
        names += [name] * int(seen.sum())
        times.append(when[seen])
        points.append(uv[seen])
    if not names:
        raise InputError("nothing comes into the camera's view")
    sigma = None if noise.pixel_px == 0 else np.full(len(names), noise.pixel_px)
    tracks = Tracks.from_rows(np.concatenate(times), names, np.concatenate(points), sigma)
    return tracks, cart_xy_dot


def _readings(name: str, path: Path, noise: DriveNoise, rng: np.random.Generator) -> Motion:
    dt = 1 / noise.motion_hz
    t = np.arange(0.0, path.t[-1] + 1e-9, dt)
    _, theta, way = path.at(t)
    slip = noise.slip * _slow(len(t), dt / noise.slip_s, rng)
    steps = np.diff(way)
    # Between two readings the wheels slip by the mean of both; on top, a random walk with the way.
    counted = steps * (1 + (slip[:-1] + slip[1:]) / 2)
    counted += noise.distance_m_per_sqrt_m * np.sqrt(np.abs(steps)) * rng.normal(size=len(steps))
    speed = np.gradient(way, t) * (1 + slip)
    heading = theta + rng.normal(0.0, noise.heading_rad, len(t))
    return Motion.from_rows(
        t + noise.time_offset_s,
        [name] * len(t),
        heading=np.angle(np.exp(1j * heading)),  # a compass wraps
        speed=speed + rng.normal(0.0, noise.speed_mps, len(t)),
        distance=np.concatenate([[0.0], np.cumsum(counted)]),
    )


def _slow(count: int, step: float, rng: np.random.Generator) -> FloatArray:
    """Noise of unit variance that forgets by exp(-step) from one entry to the next."""
    keep = float(np.exp(-step))
    fresh = rng.normal(size=count) * np.sqrt(1 - keep**2)
    fresh[0] = rng.normal()  # starts in its steady state
    slow = np.empty(count)
    value = 0.0
    for k, kick in enumerate(fresh):
        value = keep * value + kick
        slow[k] = value
    return slow
