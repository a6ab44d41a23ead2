"""Robots on circles, faster and faster, under a camera of `scenes`: whole drives whose truth is in closed form.

On an arc with a steadily growing speed the readings' integration has no error of its own, so that residuals at the
truth are zero to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration.recordings import Motion, Tracks
from airground.calibration.trajectory.chain import Chain, chains
from airground.calibration.trajectory.problem import Problem
from airground.calibration.trajectory.state import Free, Noise, Priors, Robot, State
from airground.calibration.trajectory.view import View
from scenes import Scene, circle, scene

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from scenes import Array


@dataclass(frozen=True)
class Arc:
    """A robot on a circle; all angles counter-clockwise."""

    centre: tuple[float, float]
    radius: float
    heading: float
    """At time 0 [rad]."""
    speed: float
    """At time 0 [m/s]."""
    gain: float = 0.0
    """Of the speed [m/s2]."""
    turn: float = 0.0
    """What to add to its readings' headings [rad]."""
    scale: float = 0.0
    """Logarithm of the way it goes over the way it reads."""
    lever: tuple[float, float] = (0.0, 0.0)

    def way(self, t: ArrayLike) -> Array:
        t = np.asarray(t, dtype=np.float64)
        return np.asarray(self.speed * t + self.gain * t**2 / 2)

    def rate(self, t: ArrayLike) -> Array:
        return np.asarray(self.speed + self.gain * np.asarray(t, dtype=np.float64))

    def angle(self, t: ArrayLike) -> Array:
        return np.asarray(self.heading + self.way(t) / self.radius)

    def xy(self, t: ArrayLike) -> Array:
        a = self.angle(t)
        return np.asarray(self.centre + self.radius * np.stack([np.sin(a), -np.cos(a)], axis=-1))

    def tracked(self, t: ArrayLike) -> Array:
        a = self.angle(t)
        ahead = np.stack([np.cos(a), np.sin(a)], axis=-1)
        left = np.stack([-np.sin(a), np.cos(a)], axis=-1)
        return np.asarray(self.xy(t) + self.lever[0] * ahead + self.lever[1] * left)


@dataclass(frozen=True)
class Drive:
    """Recordings, and the truth in the units of the estimate."""

    camera: Scene
    arcs: tuple[Arc, ...]
    tracks: Tracks
    motion: Motion
    view: View
    chains: tuple[Chain, ...]
    truth: State
    free: Free = field(default_factory=Free)

    def problem(self, free: Free, noise: Noise | None = None, **more: Any) -> Problem:
        priors = more.pop("priors", Priors())
        return Problem(
            view=self.view,
            chains=more.pop("chains", self.chains),
            noise=noise or Noise(),
            priors=priors,
            free=free,
            offset=self.truth.offset,
            **more,
        )


def arcs_under(camera: Scene, count: int = 1, **more: Any) -> tuple[Arc, ...]:
    """Circles that fill most of the image, one inside the other."""
    (x, y), size = camera.place(circle(40)[0] * 1.05)
    return tuple(
        Arc(
            centre=(float(x), float(y)),
            radius=float(size * (1 - 0.3 * k)),
            heading=0.4 + 1.3 * k,
            speed=float(size * (0.5 + 0.2 * k)),
            gain=float(size * 0.03),
            **{name: value[k] for name, value in more.items()},
        )
        for k in range(count)
    )


def drive(
    camera: Scene | None = None,
    arcs: tuple[Arc, ...] | None = None,
    *,
    count: int = 12,
    hz: float = 1.3,
    reading_hz: float = 50.0,
    reading: str = "speed",
    offset: float = 0.0,
    k1: float = 0.0,
    pixel: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Drive:
    """Watch robots on circles; `k1` is the division model's, in units of the normalised image."""
    camera = camera or scene(tilt_deg=40.0, heading_deg=25.0, roll_deg=4.0)
    arcs = arcs or arcs_under(camera)
    t = 1.0037 + np.arange(count) / hz  # between readings, where headings have a slope
    when = np.arange(int((t[-1] + 1.0) * reading_hz)) / reading_hz  # on the clock of the tracks
    pinhole = np.concatenate([camera.project(a.tracked(t)) for a in arcs])
    spread = float(np.sqrt(np.mean((pinhole - pinhole.mean(axis=0)) ** 2)))
    middle = np.array(camera.image_size) * 0.5 - 0.5
    uv = bent(pinhole, k1 / spread**2, middle)
    if pixel:
        assert rng is not None
        uv = uv + rng.normal(0.0, pixel, uv.shape)
    names = tuple(f"robot-{k + 1}" for k in range(len(arcs)))
    tracks = Tracks(names, np.repeat(np.arange(len(arcs)), count), np.tile(t, len(arcs)), uv)
    heading = np.concatenate([a.angle(when) - a.turn for a in arcs])
    speed = np.concatenate([a.rate(when) * np.exp(-a.scale) for a in arcs])
    way = np.concatenate([a.way(when) * np.exp(-a.scale) for a in arcs])
    ahead = np.column_stack([np.cos(heading), np.sin(heading)])
    motion = Motion(
        names,
        np.repeat(np.arange(len(arcs)), len(when)),
        np.tile(when, len(arcs)) + offset,
        xy_dot=speed[:, None] * ahead if reading == "xy_dot" else None,
        heading=None if reading == "xy_dot" else np.angle(np.exp(1j * heading)),
        speed=speed if reading == "speed" else None,
        distance=way if reading == "distance" else None,
    )
    view = View.around(uv, middle)
    T = np.array(
        [
            [view.scale, 0.0, -view.scale * view.middle[0]],
            [0.0, view.scale, -view.scale * view.middle[1]],
            [0.0, 0.0, 1.0],
        ]
    )
    origin = camera.unproject(view.middle)
    zero = np.zeros(count)
    truth = State(
        g=np.asarray(T @ camera.g / np.cbrt(np.linalg.det(T))),
        offset=offset,
        robots=tuple(Robot(a.xy(t) - origin, zero, zero, a.turn, a.scale, a.lever) for a in arcs),
        bend=k1 / (spread * view.scale) ** 2,
    )
    found = tuple(chains(tracks, motion, offset))
    return Drive(camera, arcs, tracks, motion, view, found, truth)


def bent(uv: ArrayLike, k1_per_px2: float, centre: Array) -> Any:
    """Where a lens shows points, ``r_u = r_d / (1 + k1 r_d^2)`` solved for r_d; takes complex numbers."""
    off = np.asarray(uv) - centre
    root = np.sqrt(1 - 4 * k1_per_px2 * np.sum(off**2, axis=-1, keepdims=True))
    return centre + 2 * off / (1 + root)


def pixels(g_T: ArrayLike, view: View, bend: ArrayLike, xy: ArrayLike) -> Any:
    """Projection by the full homography of normalised pixels and the lens after it; takes complex numbers."""
    g, xy = np.asarray(g_T), np.asarray(xy)
    horizon = g[0, 0] * g[1, 1] - g[1, 0] * g[0, 1]
    G = np.column_stack([g, np.array([0, 0, 1 / horizon])])
    p = np.concatenate([xy, np.ones((len(xy), 1))], axis=1) @ G.T
    uv = p[:, :2] / p[:, 2:] / view.scale + view.middle
    return bent(uv, np.asarray(bend) * view.scale**2, view.center)  # type: ignore[arg-type]
