"""A unicycle that moves exactly: arcs for steady turns, and the paper's straight segments (section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["SegmentDrive", "arc", "roll_out"]


def arc(theta: ArrayLike, v: ArrayLike, omega: ArrayLike, dt: ArrayLike) -> FloatArray:
    """Displacement of a unicycle at steady speed and turn rate: a chord of its circle.

    The chord of a turn by a has length ``v dt sin(a/2) / (a/2)`` and the mean heading; no case for straight motion.

    Parameters
    ----------
    theta : (...) array_like [rad]
        Heading at the start.
    v : (...) array_like [m/s]
        Speed along the heading.
    omega : (...) array_like [rad/s]
        Turn rate, counter-clockwise.
    dt : (...) array_like [s]
        Duration.

    Returns
    -------
    step : (..., 2) array [m]
        Displacement.
    """
    theta, v, omega, dt = (np.asarray(a, dtype=np.float64) for a in (theta, v, omega, dt))
    turn = omega * dt
    chord = v * dt * np.sinc(turn / (2 * np.pi))  # np.sinc(x) is sin(pi x) / (pi x)
    middle = theta + turn / 2
    return np.stack(np.broadcast_arrays(chord * np.cos(middle), chord * np.sin(middle)), axis=-1)


def roll_out(
    xy: ArrayLike, theta: float, v: ArrayLike, omega: ArrayLike, dt: float
) -> tuple[FloatArray, FloatArray]:
    """Drive a unicycle through commands that hold for one step each.

    Parameters
    ----------
    xy : (2,) array_like [m]
        Where it starts.
    theta : float [rad]
        Heading at the start.
    v : (N,) array_like [m/s]
        Speed in each step.
    omega : (N,) array_like [rad/s]
        Turn rate in each step.
    dt : float [s]
        Duration of a step.

    Returns
    -------
    xy : (N + 1, 2) array [m]
        Positions at the start and after each step.
    theta : (N + 1,) array [rad]
        Headings there; they do not wrap.
    """
    v, omega = (np.asarray(a, dtype=np.float64) for a in np.broadcast_arrays(v, omega))
    headings = theta + np.concatenate([[0.0], np.cumsum(omega * dt)])
    steps = arc(headings[:-1], v, omega, dt)
    start = readonly(xy, (2,), "xy")
    return start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), headings


@dataclass(frozen=True, slots=True, eq=False)
class SegmentDrive:
    """Straight segments of one length, with a turn on the spot between them: the paper's calibration drive."""

    segments: int = 8
    """How many."""

    duration_s: float = 5.0
    """Of each segment [s]; turns take no time."""

    speed_mps: float = 0.12
    """Forward speed [m/s]."""

    turn_rad: float = np.pi / 6
    """Between segments [rad], counter-clockwise."""

    heading_rad: float = 0.0
    """Of the first segment [rad], counter-clockwise from x."""

    start_m: tuple[float, float] = (0.0, 0.0)
    """Ground position at the start [m]."""

    def __post_init__(self) -> None:
        if not (self.segments >= 1 and self.duration_s > 0):
            raise InputError("a drive needs one segment or more, of positive duration")

    @property
    def total_s(self) -> float:
        """Duration of the whole drive [s]."""
        return self.segments * self.duration_s

    @property
    def headings(self) -> FloatArray:
        """(segments,) [rad]. Heading of each segment."""
        return np.asarray(self.heading_rad + self.turn_rad * np.arange(self.segments))

    @property
    def xy_dot(self) -> FloatArray:
        """(segments, 2) [m/s]. Ground velocity in each segment."""
        theta = self.headings
        return np.asarray(self.speed_mps * np.column_stack([np.cos(theta), np.sin(theta)]))

    @property
    def corners(self) -> FloatArray:
        """(segments + 1, 2) [m]. End points of the segments, in order."""
        steps = self.duration_s * self.xy_dot
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]) + self.start_m

    def at(self, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Where the robot is, and where it heads.

        Parameters
        ----------
        t : (...) array_like [s]
            Times in 0..total_s.

        Returns
        -------
        xy : (..., 2) array [m]
            Ground positions.
        theta : (...) array [rad]
            Headings; at a corner, that of the segment that starts there.
        """
        t = np.asarray(t, dtype=np.float64)
        if not ((t >= 0) & (t <= self.total_s * (1 + 1e-12))).all():
            raise InputError(f"times must lie in 0..{self.total_s} s")
        k = np.minimum((t / self.duration_s).astype(np.intp), self.segments - 1)
        into = (t - k * self.duration_s)[..., None]
        return np.asarray(self.corners[k] + into * self.xy_dot[k]), np.asarray(self.headings[k])
