"""One robot's sightings with its odometry between them: the data of one chain of positions.

Everything that the readings say is taken at the sightings' times, shifted by the clock offset: where the odometry
was, how fast it moved, which way it headed. Any subset of the sightings is a chain again, with the odometry still
integrated exactly between neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.ground_path import GroundPath, ground_path
from airground.calibration.local_polynomial import MIN_PARABOLA, windows
from airground.calibration.recordings import IntArray
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.recordings import Motion, Tracks

__all__ = ["Chain", "Odometry", "chains"]

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

# Of the time between readings: mean lag of a piecewise linear series' autocorrelation.
SHARED = 7 / 15
SMOOTH_S = 0.5  # over which a heading is smoothed, for the lever
POWER_S, POWER_READINGS = 0.4, 7  # over which speeds are smoothed, for the noise's scale
MOVING = 0.1  # of the largest speed: below it a robot stands, for all that can be told
IDLE = 0.2  # of the usual speed: noise of a robot that stands, over that of one that drives


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """What the readings say at the sightings' times, at one clock offset."""

    xy: FloatArray
    """(N, 2) [m]. Odometry's position, up to a constant for each unbroken stretch."""

    xy_dot: FloatArray
    """(N, 2) [m/s]. Its derivative."""

    heading: FloatArray
    """(N,) [rad]. As read; the direction of motion where no heading is read."""

    turn_rate: FloatArray
    """(N,) [rad/s]. Its derivative."""

    power: FloatArray
    """(N,) [m2/s]. Integral of the squared speed: the scale of the odometry's noise."""

    stretch: IntArray
    """(N,). Number of the unbroken stretch of readings; -1 outside."""


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Sightings of one robot and its readings."""

    name: str
    """Which robot."""

    t: FloatArray
    """(N,) [s]. Times of the sightings, ascending."""

    uv: FloatArray
    """(N, 2) [px]. Where it was seen."""

    spread: FloatArray
    """(N,). Standard deviation of each sighting over the usual one; 1 where the detector does not say."""

    path: GroundPath
    """Its readings, integrated."""

    heading: FloatArray | None
    """(M,) [rad]. Headings of the readings, unwrapped and smoothed; None where ground velocities were read."""

    power: FloatArray
    """(M,) [m2/s]. Integral of the squared speed at the readings' times: the scale of the odometry's noise."""

    usual_speed: float
    """Median speed while moving [m/s]."""

    link: BoolArray
    """(N-1,). Whether the odometry says how a sighting and the next belong together."""

    shared: tuple[float, float] = (0.0, 0.0)
    """By how much an increment's noise falls short of white noise over its time, along and across [s]: a reading
    counts between its neighbours too, so that short increments share noise. 0 keeps long ways right."""

    def __len__(self) -> int:
        return len(self.t)

    def take(self, rows: object) -> Chain:
        """Some of the sightings; the odometry bridges those left out where no gap of the readings is between.

        Parameters
        ----------
        rows : index
            Integer or boolean array, or slice, ascending.

        Returns
        -------
        chain : Chain
            With those sightings.
        """
        index = np.arange(len(self.t))[rows]  # type: ignore[call-overload]
        broken = np.concatenate([[0], np.cumsum(~self.link)])
        return replace(
            self,
            t=self.t[index],
            uv=self.uv[index],
            spread=self.spread[index],
            link=np.diff(broken[index]) == 0,
        )

    def sharing(self, motion: Motion) -> Chain:
        """The same chain for judging noise levels: increments know that they share noise.

        Parameters
        ----------
        motion : Motion
            Readings.

        Returns
        -------
        chain : Chain
            With `shared` from the time between readings.
        """
        lag = SHARED * float(np.median(np.diff(self.path.t)))
        return replace(self, shared=(0.0 if motion.distance is not None else lag, lag))

    def odometry(self, offset: float) -> Odometry:
        """Evaluate the readings at the sightings.

        Parameters
        ----------
        offset : float [s]
            To be added to the sightings' times to get the readings' times.

        Returns
        -------
        odometry : Odometry
            Extrapolated with the last velocity for sightings that fall just outside.
        """
        path, when = self.path, self.t + offset
        xy, xy_dot, stretch = path.state(when)
        if self.heading is None:
            heading = np.unwrap(np.arctan2(xy_dot[:, 1], xy_dot[:, 0]))
            turn_rate = np.gradient(heading, when) if len(when) > 1 else np.zeros_like(when)
        else:
            k = np.clip(np.searchsorted(path.t, when, side="right") - 1, 0, len(path.t) - 2)
            turn_rate = (self.heading[k + 1] - self.heading[k]) / (path.t[k + 1] - path.t[k])
            heading = self.heading[k] + turn_rate * (when - path.t[k])
        return Odometry(
            xy, xy_dot, heading, turn_rate, np.interp(when, path.t, self.power), stretch
        )


def chains(
    tracks: Tracks,
    motion: Motion,
    offset: float,
    *,
    keep: BoolArray | None = None,
    reach: float = 0.0,
) -> list[Chain]:
    """Cut recordings into chains, one for each robot that is in both.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    offset : float [s]
        Clock offset, about.
    keep : (N,) array of bool, optional
        Rows of the tracks to use.
    reach : float [s]
        How much the offset may still change: so far inside the readings a sighting must lie.

    Returns
    -------
    chains : list of Chain
        Those with at least two sightings inside unbroken readings.
    """
    found = []
    usual = 1.0 if tracks.sigma is None else float(np.median(tracks.sigma))
    for name in tracks.targets:
        if name not in motion.targets or (path := ground_path(motion, name)) is None:
            continue
        rows = tracks.rows(name)
        t = tracks.t[rows]
        inside = np.ones(len(t), dtype=bool) if keep is None else keep[rows].copy()
        stretch = path.state(t + offset)[2]
        inside &= stretch >= 0
        for shift in (-reach, reach):
            inside &= path.state(t + offset + shift)[2] == stretch
        if inside.sum() < 2:
            continue
        spread = np.ones(len(t)) if tracks.sigma is None else tracks.sigma[rows] / usual
        read = motion.rows(name)
        usual_speed, power = _speed_and_power(path)
        found.append(
            Chain(
                name=name,
                t=t[inside],
                uv=tracks.uv[rows][inside],
                spread=spread[inside],
                path=path,
                heading=None
                if motion.heading is None
                else _smooth(path.t, np.unwrap(motion.heading[read])),
                power=power,
                usual_speed=usual_speed,
                link=np.diff(stretch[inside]) == 0,
            )
        )
    return found


def _smooth(t: FloatArray, heading: FloatArray) -> FloatArray:
    """Local parabolas: a lever swings with the heading, and would swing with its noise."""
    count = round(SMOOTH_S / float(np.median(np.diff(t)))) // 2 * 2 + 1
    if count < MIN_PARABOLA or len(t) < count:
        return heading
    laid = windows(t, np.arange(len(t) - count + 1), count)
    value, _ = laid.fit(t, np.column_stack([heading, heading]))
    half = count // 2
    when = np.concatenate([t[:half], laid.centre, t[-half:]])
    order = np.argsort(when)
    values = np.concatenate([heading[:half], value[:, 0], heading[-half:]])
    return np.asarray(np.interp(t, when[order], values[order]))


def _speed_and_power(path: GroundPath) -> tuple[float, FloatArray]:
    """Median speed while moving, and the integral of the squared speed."""
    dt = np.diff(path.t)
    speed = np.hypot(*np.diff(path.xy, axis=0).T) / dt
    moving = speed > MOVING * float(speed.max())
    usual = float(np.median(speed[moving])) if moving.any() else 0.0
    # Smoothed: weights by the very noise that they weigh would favour readings that are too low.
    count = max(POWER_READINGS, round(POWER_S / float(np.median(dt))))
    kernel = np.ones(min(count, len(speed)))
    smooth = np.convolve(speed, kernel, "same") / np.convolve(np.ones_like(speed), kernel, "same")
    rate = smooth**2 + (IDLE * usual) ** 2
    return usual, np.concatenate([[0.0], np.cumsum(rate * dt)])
