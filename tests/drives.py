"""Recordings of simulated drives, for tests of everything from tracks and motion on.

Positions, headings and way are given in closed form or by fine integration here; nothing of airground is used but the
types that hold the rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import Motion, Tracks

if TYPE_CHECKING:
    from scenes import Array, Scene

FINE = 1e-3  # s; step of the integration of headings and way


@dataclass(frozen=True)
class Drive:
    """A smooth drive: position on the ground as a function of time."""

    centre: tuple[float, float]
    """[m]."""

    size: tuple[float, float]
    """Half extents [m]."""

    period: float
    """Of the slower axis [s]."""

    ratio: int = 2
    """Of the two axes' frequencies; 2 is a figure eight."""

    def xy(self, t: Array) -> Array:
        """(..., 2) [m]."""
        w = 2 * np.pi / self.period
        x = self.size[0] * np.sin(w * t)
        y = self.size[1] * np.sin(self.ratio * w * t + 0.3)
        return np.stack([x, y], axis=-1) + self.centre

    def xy_dot(self, t: Array) -> Array:
        """(..., 2) [m/s]."""
        w = 2 * np.pi / self.period
        x = self.size[0] * w * np.cos(w * t)
        y = self.size[1] * self.ratio * w * np.cos(self.ratio * w * t + 0.3)
        return np.stack([x, y], axis=-1)


def fit_drive(scene: Scene, *, period: float = 40.0, ratio: int = 2) -> Drive:
    """A figure eight that stays in the scene's image."""
    a = np.linspace(0, 2 * np.pi, 400)
    unit = np.column_stack([np.sin(a), np.sin(ratio * a + 0.3)])
    centre, scale = scene.place(unit)
    return Drive(tuple(centre), (scale, scale), period, ratio)


def see(
    scene: Scene,
    drive: Drive,
    t: Array,
    *,
    target: str = "robot",
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Tracks:
    """What the camera sees at times `t`."""
    uv = np.asarray(scene.project(drive.xy(t)), dtype=np.float64)
    if noise:
        assert rng is not None
        uv = uv + rng.normal(0, noise, uv.shape)
    return Tracks.from_rows(t, [target] * len(t), uv)


def read(
    drive: Drive,
    t: Array,
    *,
    form: str = "velocity",
    target: str = "robot",
    offset: float = 0.0,
    speed_noise: float = 0.0,
    heading_noise: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Motion:
    """What the robot reads at times `t` of the camera's clock; its own clock is ahead by `offset`."""
    velocity = drive.xy_dot(t)
    speed = np.linalg.norm(velocity, axis=1)
    heading = np.arctan2(velocity[:, 1], velocity[:, 0])
    if speed_noise or heading_noise:
        assert rng is not None
        speed = speed * (1 + rng.normal(0, speed_noise, len(t)))
        heading = heading + rng.normal(0, heading_noise, len(t))
    names = [target] * len(t)
    if form == "velocity":
        xy_dot = speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
        return Motion.from_rows(t + offset, names, xy_dot=xy_dot)
    if form == "speed":
        return Motion.from_rows(t + offset, names, heading=heading, speed=speed)
    if form == "distance":
        fine = np.arange(t[0], t[-1] + FINE, FINE)
        way = np.concatenate(
            [[0.0], np.cumsum(np.linalg.norm(drive.xy_dot(fine[:-1] + FINE / 2), axis=1) * FINE)]
        )
        return Motion.from_rows(
            t + offset, names, heading=heading, distance=17.0 + np.interp(t, fine, way)
        )
    raise ValueError(form)
