"""A robot drives a route: where it is at any time, in closed form, and how large the route may be in an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.unicycle import arc

if TYPE_CHECKING:
    from airground.sim.camera import SimCamera
    from airground.sim.routes import Route

__all__ = ["Pose", "RouteDrive", "lap_time", "place_route", "speed_for"]

DEEPEST = 5.0  # a robot beyond is a few pixels, and no tracker finds it
PLACES = 31  # tried for the middle of a route, from the top to the bottom of the image


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where the robot's axle is, at N times."""

    xy: FloatArray
    """(N, 2) [m]. Ground position."""

    theta: FloatArray
    """(N,) [rad]. Heading, counter-clockwise from x; does not wrap."""

    speed: FloatArray
    """(N,) [m/s]. Along the heading."""

    way: FloatArray
    """(N,) [m]. Distance driven."""


@dataclass(frozen=True, slots=True, eq=False)
class RouteDrive:
    """A route driven at steady speed, from rest to rest, with stops for the turns on the spot."""

    route: Route
    """What to drive, all laps of it, of its own size."""

    start_m: tuple[float, float]
    """Ground position at time 0 [m]."""

    scale_m: float
    """Length of one unit of the route [m]."""

    speed_mps: float
    """Between the ramps [m/s]."""

    ramp_s: float = 0.5
    """Time to reach the speed from rest, and to brake [s]; 0 for a step."""

    turn_rate_radps: float = 1.0
    """Of the turns on the spot [rad/s]; may be infinite."""

    def __post_init__(self) -> None:
        if not (self.scale_m > 0 and self.speed_mps > 0 and self.turn_rate_radps > 0):
            raise InputError("scale_m, speed_mps and turn_rate_radps must be positive")
        if not self.ramp_s >= 0:
            raise InputError(f"ramp_s must not be negative, not {self.ramp_s}")

    @property
    def total_s(self) -> float:
        """Duration of the drive [s]."""
        run, _, spot = _timing(self)
        return float(run.sum() + spot.sum())

    def at(self, t: FloatArray) -> Pose:
        """Where the robot is.

        Parameters
        ----------
        t : (N,) array [s]
            Times; before 0 it stands at the start, after `total_s` at the end.

        Returns
        -------
        pose : Pose
            Exact, apart from rounding.
        """
        lengths, turns = self.route.lengths * self.scale_m, self.route.turns
        corner, heading = self.route.corners()
        way = np.concatenate([[0.0], np.cumsum(lengths)])
        spots = np.flatnonzero(lengths == 0)
        run_s, ramp, spot_s = _timing(self)
        starts = np.concatenate([[0.0], np.cumsum(run_s + spot_s)[:-1]])

        t = np.asarray(t, dtype=np.float64)
        k = np.clip(np.searchsorted(starts, t, side="right") - 1, 0, len(starts) - 1)
        into = np.maximum(t - starts[k], 0.0)  # since the run began; the turn follows the run
        first = np.concatenate([[0], spots + 1])
        last = np.concatenate([spots, [len(lengths)]])  # one past the run's pieces
        along, speed = _along(into, run_s[k], ramp[k], self.speed_mps)
        along = np.minimum(way[first[k]] + along, way[last[k]])
        piece = np.clip(
            np.searchsorted(way, along, side="right") - 1,
            first[k],
            np.maximum(last[k] - 1, first[k]),
        )
        piece = np.minimum(piece, len(lengths) - 1)
        share = (along - way[piece]) / np.where(lengths[piece] > 0, lengths[piece], 1.0)
        bend = share * np.where(lengths[piece] > 0, turns[piece], 0.0)
        # A share of an arc is an arc: its length over a time of 1 is its speed.
        xy = corner[piece] * self.scale_m + arc(heading[piece], share * lengths[piece], bend, 1.0)
        turned = np.clip((into - run_s[k]) / np.maximum(spot_s[k], 1e-12), 0.0, 1.0)
        spot_turn = np.append(turns[spots], 0.0)[k] * turned
        speed = np.where((t < 0) | (into >= run_s[k]), 0.0, speed)
        return Pose(xy + self.start_m, heading[piece] + bend + spot_turn, speed, along)


def _timing(drive: RouteDrive) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of each run between two stops: its duration, its ramps' duration, and the duration of the turn after it."""
    lengths = drive.route.lengths
    spot = lengths == 0
    count = int(spot.sum()) + 1
    cruise = np.bincount(np.cumsum(spot), lengths, count) * drive.scale_m / drive.speed_mps
    ramp = np.minimum(drive.ramp_s, cruise)
    turn = np.append(np.abs(drive.route.turns[spot]) / drive.turn_rate_radps, 0.0)
    return cruise + ramp, ramp, turn


def _along(
    into: FloatArray, run_s: FloatArray, ramp: FloatArray, speed: float
) -> tuple[FloatArray, FloatArray]:
    """Way and speed a time into a run: up a ramp, steady, down a ramp."""
    size = np.maximum(ramp, 1e-12)
    up = np.minimum(into, ramp)
    steady = np.clip(into - ramp, 0.0, run_s - 2 * ramp)
    down = np.clip(into - (run_s - ramp), 0.0, ramp)
    way = speed * (up**2 / (2 * size) + steady + down - down**2 / (2 * size))
    share = np.where(ramp > 0, np.minimum(up / size, 1 - down / size), 1.0)
    return way, speed * share


def lap_time(route: Route, scale_m: float, speed_mps: float, ramp_s: float, rate: float) -> float:
    """Duration of a route, from rest to rest.

    Parameters
    ----------
    route : Route
        All of it.
    scale_m : float [m]
        Length of its unit.
    speed_mps : float [m/s]
        Between the ramps.
    ramp_s : float [s]
        Of each ramp.
    rate : float [rad/s]
        Of the turns on the spot.

    Returns
    -------
    duration_s : float [s]
        Ramps and turns on the spot included.
    """
    return RouteDrive(route, (0.0, 0.0), scale_m, speed_mps, ramp_s, rate).total_s


def speed_for(route: Route, scale_m: float, duration_s: float, ramp_s: float, rate: float) -> float:
    """Speed at which a route takes a given time.

    Parameters
    ----------
    route : Route
        All of it.
    scale_m : float [m]
        Length of its unit.
    duration_s : float [s]
        From rest to rest.
    ramp_s : float [s]
        Of each ramp.
    rate : float [rad/s]
        Of the turns on the spot.

    Returns
    -------
    speed_mps : float [m/s]
        Between the ramps.

    Raises
    ------
    InputError
        If the turns and the ramps alone take longer.
    """
    spot = route.lengths == 0
    runs = np.bincount(np.cumsum(spot), route.lengths) * scale_m
    turning = float(np.abs(route.turns[spot]).sum()) / rate

    def takes(speed: float) -> float:
        cruise = runs / speed
        return float((cruise + np.minimum(cruise, ramp_s)).sum()) + turning

    low, high = 0.0, float(runs.sum()) * 1e3 / duration_s
    if takes(high) > duration_s:
        raise InputError(
            f"{duration_s:.3g} s are too short for the drive's stops and turns; drive longer, or turn faster"
        )
    for _ in range(50):  # the time falls with the speed
        middle = (low + high) / 2
        low, high = (middle, high) if takes(middle) > duration_s else (low, middle)
    return high


def place_route(camera: SimCamera, outline: FloatArray, share: float) -> tuple[FloatArray, float]:
    """Scale and move a shape so that it covers as much of the image as it can.

    The ground seen in a window of the image is a convex polygon. For a given middle of the shape the largest scale is
    closed-form: each edge of the polygon bounds it. Of some middles down the image the one with the largest extent in
    pixels is taken; a shape as large as possible in metres would lie at the horizon. Ground more than `DEEPEST` times
    as deep as the nearest is not used.

    Parameters
    ----------
    camera : SimCamera
        What sees it.
    outline : (M, 2) array
        Points of the shape, in units.
    share : float
        Of the image's width and height that the window takes, around the middle; at most 1.

    Returns
    -------
    origin_m : (2,) array [m]
        Where the shape's (0, 0) goes.
    scale_m : float [m]
        Length of its unit.

    Raises
    ------
    InputError
        If `share` is not in 0..1, or the window shows no ground.
    """
    if not 0 < share <= 1:
        raise InputError(f"share must be above 0, at most 1, not {share}")
    size = np.array(camera.image_size_px, dtype=np.float64)
    low, high = (size - 1) / 2 - share * (size - 1) / 2, (size - 1) / 2 + share * (size - 1) / 2
    G = camera.image_from_ground
    # a.(x, y, 1) >= 0 inside: left, right, top and bottom of the window, and not too far.
    edges = np.stack(
        [G[0] - low[0] * G[2], high[0] * G[2] - G[0], G[1] - low[1] * G[2], high[1] * G[2] - G[1]]
    )
    near = camera.unproject(
        np.array([[low[0], high[1]], [high[0], high[1]], low, [high[0], low[1]]])
    )
    depth = float(np.nanmin(near @ G[2, :2] + G[2, 2]))
    edges = np.vstack([edges, np.append(0.0, [0.0, DEEPEST * depth]) - G[2]])
    edges = edges[np.linalg.norm(edges[:, :2], axis=1) > 0]  # at nadir all ground is equally deep
    edges = edges / np.linalg.norm(edges[:, :2], axis=1, keepdims=True)

    middle = (outline.max(axis=0) + outline.min(axis=0)) / 2
    shape = outline - middle
    reach = (-shape @ edges[:, :2].T).max(
        axis=0
    )  # how far a shape of scale 1 comes towards an edge
    v = np.linspace(low[1], high[1], PLACES + 2)[1:-1]
    centres = camera.unproject(np.column_stack([np.full(PLACES, (size[0] - 1) / 2), v]))
    scales = ((centres @ edges[:, :2].T + edges[:, 2]) / reach).min(axis=1)
    usable = scales > 0  # NaN, above the horizon, compares as False
    if not usable.any():
        raise InputError("the window of the image shows no ground")
    centres, scales = centres[usable], scales[usable]
    uv = camera.project(centres[:, None] + scales[:, None, None] * shape)
    best = int(np.argmax(np.prod(np.ptp(uv, axis=1) + 1, axis=-1)))
    place, size_m = centres[best], float(scales[best])
    return np.asarray(place - size_m * middle), size_m
