"""A vehicle that lags behind its commands, seen and read late: truth for filters, by `sim.arc` and `sim.SimCamera`."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.control import Floor, RobotState, VelocityCommand
from airground.control.estimation.state_filter import StateFilter
from airground.geometry import LimitedHomography
from airground.sim import demo_world
from airground.sim.unicycle import arc

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from airground.control.estimation.options import StateOptions
    from airground.geometry.arrays import FloatArray

CAMERA = demo_world().camera
ORIGIN = np.array([640.0, 400.0])
FLOOR = Floor(LimitedHomography(CAMERA.g), ORIGIN)
START = np.array([0.7, 4.1])
STEP = 0.01  # s
TICK = 1 / 30  # s

Event = tuple[float, str, dict[str, Any]]


def round_and_round(t: float) -> VelocityCommand:
    """Loops of changing speed and curvature, with a short stop."""
    if 7.0 < t < 8.0:
        return VelocityCommand(0.0, 0.0)
    return VelocityCommand(0.3 + 0.1 * sin(2 * pi * t / 5), 0.45 + 0.6 * sin(2 * pi * t / 7))


@dataclass(slots=True)
class LateDrive:
    """What happens, from chance and a program of commands. Times are the camera's clock."""

    rng: np.random.Generator
    program: Callable[[float], VelocityCommand] = round_and_round
    latency_s: float = 0.1
    jitter_s: float = 0.01
    actuation_s: float = 0.05
    speed_lag_s: float = 0.15
    turn_lag_s: float = 0.1
    sigma_px: float = 1.0
    share: float = 0.1
    scale_sigma: float = 0.1
    bias_sigma: float = 0.05
    stray: float = 0.08
    duration_s: float = 14.0
    sources: tuple[str, ...] = ("compass", "odometry")
    arm_m: tuple[float, float] = (0.0, 0.0)
    dark: tuple[tuple[float, float], ...] = ()
    theta: float | None = None
    truth: FloatArray = field(init=False)
    scales: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        rng, count = self.rng, round(self.duration_s / STEP) + 200
        self.scales = 1 + np.clip(rng.normal(0, self.scale_sigma, 2), -0.25, 0.25)
        theta = rng.uniform(-pi, pi) if self.theta is None else self.theta
        xy, v, w, stray = START.copy(), 0.0, 0.0, np.zeros(2)
        rows = np.empty((count, 5))
        for k in range(count):
            rows[k] = (*xy, theta, v, w)
            tick = np.floor((k * STEP - self.actuation_s) / TICK + 1e-9)
            command = self.program(tick * TICK) if tick >= 0 else VelocityCommand(0.0, 0.0)
            stray += -stray * STEP / 0.3 + self.stray * np.sqrt(2 * STEP / 0.3) * rng.normal(
                0, 1, 2
            )
            wanted = self.scales * (1 + stray) * (command.v, command.omega)
            xy = xy + arc(theta, v, w, STEP)
            theta += w * STEP
            v += (wanted[0] - v) * (1 - np.exp(-STEP / self.speed_lag_s))
            w += (wanted[1] - w) * (1 - np.exp(-STEP / self.turn_lag_s))
        self.truth = rows

    def at(self, t: float) -> FloatArray:
        """x, y, theta, v, omega at a time; the ground's origin is the floor's."""
        grid = np.arange(len(self.truth)) * STEP
        row = np.array([np.interp(t, grid, column) for column in self.truth.T])
        row[:2] -= CAMERA.unproject(ORIGIN)
        return row

    def mark(self, t: float) -> FloatArray:
        """Where the mark is in the image, without noise."""
        x, y, theta, *_ = self.at(t)
        c, s = np.cos(theta), np.sin(theta)
        forward, left = self.arm_m
        place = np.array([x + forward * c - left * s, y + forward * s + left * c])
        return CAMERA.project(place + CAMERA.unproject(ORIGIN))

    def events(self) -> list[Event]:
        """Data in the order of arrival: when they arrive, what they are, what `StateFilter` is to be told."""
        rng, found = self.rng, []
        bias = rng.normal(0, self.bias_sigma)
        for k in range(round(self.duration_s / TICK)):
            t = k * TICK + 0.004
            if not any(a <= t < b for a, b in self.dark):
                uv = self.mark(t) + rng.normal(0, self.sigma_px, 2)
                late = self.latency_s + self.jitter_s * rng.uniform()
                found.append((t + late, "see", {"t": t, "uv": uv}))
            t = k * TICK + 0.017
            _, _, theta, v, w = self.at(t)
            told: dict[str, Any] = {"t": t}
            if "compass" in self.sources:
                told["heading"] = theta + bias + rng.normal(0, 0.05)
            if "odometry" in self.sources:
                read = np.array([v, w]) / self.scales
                sigma = np.hypot(self.share * read, (0.01, 0.03))
                told["speed"], told["turn_rate"] = (read + sigma * rng.normal(0, 1, 2)).tolist()
            if len(told) > 1:
                found.append((t + 0.01, "read", told))
        return sorted(found, key=lambda event: event[0])

    def driven(
        self, options: StateOptions, *, events: list[Event] | None = None, told: bool = True
    ) -> Iterator[tuple[float, StateFilter, RobotState]]:
        """Run a filter as a pilot does; what it says at each tick about when the command takes effect."""
        state_filter = StateFilter(FLOOR, options)
        waiting = self.events() if events is None else events
        done = 0
        for k in range(round(self.duration_s / TICK)):
            now = k * TICK
            while done < len(waiting) and waiting[done][0] <= now:
                _, what, arguments = waiting[done]
                getattr(state_filter, what)(**arguments)
                done += 1
            state = state_filter.predict(now + self.actuation_s)
            yield now, state_filter, state
            if told:
                state_filter.sent(now, self.program(now))


def steady(v: float, omega: float = 0.0) -> Callable[[float], VelocityCommand]:
    """Half a second of rest, then always the same."""
    return lambda t: VelocityCommand(v if t > 0.5 else 0.0, omega if t > 0.5 else 0.0)


def position_error(state: RobotState, truth: FloatArray) -> float:
    """Distance on the ground from where it is [m]."""
    xy = CAMERA.unproject(state.uv) - CAMERA.unproject(ORIGIN)
    return float(np.hypot(*(xy - truth[:2])))


def nees(state: RobotState, truth: FloatArray) -> float:
    """Squared error in units of the stated covariance, over its 5 entries; 1 on average where that is right."""
    xy = CAMERA.unproject(state.uv) - CAMERA.unproject(ORIGIN)
    error = np.array([*xy, state.theta, state.v, state.omega]) - truth
    error[2] = np.angle(np.exp(1j * error[2]))
    assert state.covariance is not None
    return float(error @ np.linalg.solve(state.covariance, error)) / 5
