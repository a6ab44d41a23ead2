"""What a simulated vehicle tells about itself: compass, speed and turn rate, each a little wrong and a little late."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, inf, isfinite, nan, sin
from typing import TYPE_CHECKING, Protocol

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.vehicle_history import SlowNoise

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["MovingBody", "Odometer", "OdometryNoise", "Reading"]


class MovingBody(Protocol):
    """What an odometer is built into; `VehiclePlant` is one."""

    @property
    def now(self) -> float:
        """Time up to which it can be asked [s]."""
        ...

    def pose(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where it was.

        Parameters
        ----------
        t : (N,) array [s]
            Times.

        Returns
        -------
        xy : (N, 2) array [m]
            Positions.
        theta : (N,) array [rad]
            Headings.
        """
        ...

    def motion(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How it moved, and how its wheels did.

        Parameters
        ----------
        t : (N,) array [s]
            Times.

        Returns
        -------
        ground : (N, 3) array [m/s, rad/s, m/s]
            Speed, turn rate and sideways speed.
        wheels : (N, 3) array [m/s, rad/s, m/s]
            The same of the wheels.
        """
        ...


@dataclass(frozen=True, slots=True)
class OdometryNoise:
    """How badly a vehicle knows its own motion, how often it tells it, and how late that arrives."""

    rate_hz: float = 50.0
    """Readings per second."""

    latency_s: float = 0.02
    """From a reading to its arrival [s]."""

    compass: bool = True
    """Whether it knows its heading; NaN otherwise."""

    heading_rad: float = 0.01
    """Standard deviation of the heading [rad]; white."""

    heading_bias_rad: float = 0.0
    """What the heading reads too much [rad]."""

    heading_swing_rad: float = 0.0
    """Standard deviation of an error of the heading that changes slowly [rad]: iron nearby, a gyroscope's drift."""

    speed_share: float = 0.1
    """Standard deviation of a relative error of speed and sideways speed that changes slowly."""

    speed_mps: float = 0.01
    """Standard deviation of the speeds [m/s]; white."""

    turn_share: float = 0.1
    """Standard deviation of a relative error of the turn rate that changes slowly."""

    turn_rate_radps: float = 0.02
    """Standard deviation of the turn rate [rad/s]; white."""

    slow_s: float = 4.0
    """Correlation time of what changes slowly [s]."""

    def __post_init__(self) -> None:
        for name in ("rate_hz", "slow_s"):
            if not 0 < getattr(self, name) < inf:
                raise InputError(f"{name} must be positive, not {getattr(self, name)}")
        for name in (
            "latency_s",
            "heading_rad",
            "heading_swing_rad",
            "speed_share",
            "speed_mps",
            "turn_share",
            "turn_rate_radps",
        ):
            if not 0 <= getattr(self, name) < inf:
                raise InputError(f"{name} must be 0 or more, not {getattr(self, name)}")
        if not isfinite(self.heading_bias_rad):
            raise InputError(f"heading_bias_rad must be finite, not {self.heading_bias_rad}")


@dataclass(frozen=True, slots=True)
class Reading:
    """One message of a vehicle about itself."""

    t: float
    """Time that it is about [s]."""

    arrives_t: float
    """When it is heard [s]."""

    theta: float
    """Heading [rad], within -pi..pi; NaN without a compass."""

    v: float
    """Speed along the heading [m/s], as the wheels tell it."""

    omega: float
    """Turn rate [rad/s]."""

    lateral: float = 0.0
    """Speed along the heading plus 90 degrees [m/s]."""


class Odometer:
    """Readings of a vehicle, each given once.

    Parameters
    ----------
    body : MovingBody
        The vehicle.
    noise : OdometryNoise
        How badly.
    rng : Generator
        Where all noise comes from.
    """

    def __init__(self, body: MovingBody, noise: OdometryNoise, rng: np.random.Generator) -> None:
        self.body = body
        self.noise = noise
        self._start = body.now
        self._next = 0
        white, *slow = rng.spawn(4)
        self._white = white
        self._slow = tuple(SlowNoise(one, noise.slow_s, self._start) for one in slow)

    def readings(self, t: float) -> list[Reading]:
        """Give what has arrived since one last asked.

        Parameters
        ----------
        t : float [s]
            Now; the vehicle must have been driven to here, less the latency.

        Returns
        -------
        readings : list of Reading
            In order.

        Raises
        ------
        InputError
            If the vehicle has not been driven so far yet.
        """
        last = int(np.floor((t - self.noise.latency_s - self._start) * self.noise.rate_hz + 1e-6))
        due = self._start + np.arange(self._next, last + 1) / self.noise.rate_hz
        if not len(due):
            return []
        found = list(self._read(due))
        self._next = last + 1
        return found

    def _read(self, due: FloatArray) -> Iterable[Reading]:
        noise = self.noise
        headings = self.body.pose(due)[1]
        wheels = self.body.motion(due)[1]
        white = self._white.normal(size=(len(due), 4))
        swing, share, turn_share = self._slow
        for t, theta, (v, omega, lateral), e in zip(
            due.tolist(), headings.tolist(), wheels.tolist(), white.tolist(), strict=True
        ):
            read = theta + noise.heading_bias_rad + noise.heading_rad * e[0]
            read += noise.heading_swing_rad * swing.at(t)
            scale = 1 + noise.speed_share * share.at(t)
            yield Reading(
                t=t,
                arrives_t=t + noise.latency_s,
                theta=atan2(sin(read), cos(read)) if noise.compass else nan,
                v=v * scale + noise.speed_mps * e[1],
                omega=omega * (1 + noise.turn_share * turn_share.at(t))
                + noise.turn_rate_radps * e[2],
                lateral=lateral * scale + noise.speed_mps * e[3] * (lateral != 0),
            )
