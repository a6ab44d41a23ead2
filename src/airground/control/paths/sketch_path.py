"""From smooth lines on the ground to a path with speeds and times."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, remainder
from typing import TYPE_CHECKING

import numpy as np

from airground.control.paths.image_path import ImagePath
from airground.control.paths.sketch_spline import evaluate, slopes
from airground.control.paths.speed_profile import speed_profile, travel_times, turn_time
from airground.errors import InputError
from airground.geometry.arrays import FloatArray, points, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.control.floor import Floor
    from airground.control.limits import Limits

__all__ = ["Run", "bends", "path_of_runs", "path_through", "wishes"]

_TURN = 0.1
"""Change of direction from sample to sample [rad], about, that shows a curve well enough to plan speeds."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A smooth line to be driven one way."""

    xy: FloatArray
    """(M, 2) [m]. Points on the ground, four or more, whose third differences are small."""

    wish: FloatArray
    """(M,) [m/s]. Speeds asked for; infinite where none is."""

    direction: int = 1
    """1 forwards, -1 in reverse."""


def bends(xy: FloatArray, *, closed: bool = False) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Steps, turns and curvatures of a cubic spline through points.

    Parameters
    ----------
    xy : (M, 2) array [m]
        Points; of a closed line with the first again at the end.
    closed : bool
        Whether it goes round.

    Returns
    -------
    step : (M,) array [m]
        Length of the derivative by the index.
    turn : (M - 1,) array [rad]
        Twice the larger angle between the chord and the curve at its ends: the change of direction on an arc, and
        more where the curve winds in between.
    curvature : (M,) array [1/m]
        At the points.
    """
    _, one, two = evaluate(xy, slopes(xy, closed=closed), np.arange(float(len(xy))))
    step = np.hypot(one[:, 0], one[:, 1])
    chord = np.diff(xy, axis=0)
    turn = 2 * np.maximum(_angles(one[:-1], chord), _angles(chord, one[1:]))
    cross = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    return step, turn, cross / np.maximum(step, 1e-12) ** 3


def _angles(a: FloatArray, b: FloatArray) -> FloatArray:
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, (a * b).sum(axis=1))))


def wishes(speed_mps: ArrayLike | None, count: int) -> FloatArray:
    """Speeds asked for at points, infinite where none is.

    Parameters
    ----------
    speed_mps : () or (N,) array_like, optional [m/s]
        One for all or one for each; NaN where none is asked for.
    count : int
        How many points there are.

    Returns
    -------
    wish : (N,) array [m/s]
        Positive.

    Raises
    ------
    InputError
        If the shape does not fit, or one is not positive.
    """
    wish = np.asarray(np.inf if speed_mps is None else speed_mps, dtype=np.float64)
    if wish.shape not in ((), (count,)):
        raise InputError(f"speed_mps must be one number or one for each of {count} points")
    if (wish <= 0).any():
        raise InputError("speed_mps must be positive; leave it out where there is no wish")
    return np.broadcast_to(np.where(np.isnan(wish), np.inf, wish), (count,)).copy()


def path_through(
    floor: Floor,
    uv: ArrayLike,
    limits: Limits,
    *,
    closed: bool = False,
    speed_mps: ArrayLike | None = None,
) -> ImagePath:
    """Path exactly through points of the image, along a cubic spline on the ground: for what is smooth already.

    Parameters
    ----------
    floor : Floor
        The ground.
    uv : (N, 2) array_like [px]
        Four points or more, in order and at about even distances.
    limits : Limits
        Of the robot.
    closed : bool
        Whether the last point is followed by the first, which stands there once.
    speed_mps : () or (N,) array_like, optional [m/s]
        Upper bounds of the speed by wish; NaN where there is none.

    Returns
    -------
    path : ImagePath
        One run, forwards.

    Raises
    ------
    InputError
        If there are too few points, two in a row are the same, or one is not ground.
    """
    uv = points(uv, "uv")
    xy = floor.position(readonly(uv, (None, 2), "uv"))
    if len(xy) < 4:
        raise InputError(f"uv must have four points or more, not {len(xy)}")
    if not np.isfinite(xy).all():
        bad = int(np.argmin(np.isfinite(xy).all(axis=1)))
        raise InputError(f"uv[{bad}] is on or beyond the horizon; give points of the ground")
    wish = wishes(speed_mps, len(xy))
    if closed:
        xy, wish = np.concatenate([xy, xy[:1]]), np.append(wish, wish[0])
    if not (np.hypot(*np.diff(xy, axis=0).T) > 1e-9).all():
        raise InputError("two points of uv in a row are the same; leave one out")
    return path_of_runs(floor, [Run(xy, wish)], limits, closed=closed)


def path_of_runs(
    floor: Floor, runs: list[Run], limits: Limits, *, closed: bool = False
) -> ImagePath:
    """Sample runs where they bend, plan their speeds, and join them.

    Parameters
    ----------
    floor : Floor
        The ground.
    runs : list of Run
        Each ends where the next begins; one only, with its first point again at the end, for a closed path.
    limits : Limits
        Of the robot.
    closed : bool
        Whether the path goes round.

    Returns
    -------
    path : ImagePath
        At rest at its ends and where runs meet; a closed one at speed.
    """
    parts = []
    length = clock = 0.0
    heading: float | None = None
    for run in runs:
        xy, s, theta, kappa, wish = _sampled(run, closed=closed)
        speed = speed_profile(
            s, kappa, limits, wanted_mps=wish, closed=closed, direction=run.direction
        )
        faces = theta + (pi if run.direction < 0 else 0.0)
        if heading is not None:
            clock += turn_time(remainder(float(faces[0]) - heading, 2 * pi), limits)
        time = clock + travel_times(s, speed)
        parts.append((xy, length + s, theta, kappa, speed, time, wish))
        length, clock, heading = length + float(s[-1]), float(time[-1]), float(faces[-1])
    sizes = np.cumsum([len(part[1]) for part in parts])
    joined = [np.concatenate(column) for column in zip(*parts, strict=True)]
    xy, s, theta, kappa, speed, time, wish = joined
    return ImagePath(
        floor,
        xy,
        s,
        theta,
        kappa,
        speed,
        time,
        wish=wish,
        breaks=tuple(int(k) for k in sizes[:-1]),
        directions=tuple(run.direction for run in runs),
        closed=closed,
    )


def _sampled(run: Run, *, closed: bool) -> tuple[FloatArray, ...]:
    """Points, arc length, direction, curvature and wished speed, denser where the line turns."""
    turn = bends(run.xy, closed=closed)[1]
    parts = np.clip(np.ceil(turn / _TURN), 1, 12).astype(np.intp)
    before = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(before)) - np.repeat(np.cumsum(parts) - parts, parts)
    t = np.append(before + within / parts[before], float(len(parts)))
    slope = slopes(run.xy, closed=closed)
    xy, one, two = evaluate(run.xy, slope, t)
    middle = np.concatenate([t[:-1] + np.diff(t) * (0.5 + f) for f in (-_GAUSS, 0.0, _GAUSS)])
    pace = np.hypot(*evaluate(run.xy, slope, middle)[1].T).reshape(3, -1)
    steps = np.diff(t) * (5 * pace[0] + 8 * pace[1] + 5 * pace[2]) / 18
    s = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-12))])
    theta = np.unwrap(np.arctan2(one[:, 1], one[:, 0]))
    speed = np.maximum(np.hypot(one[:, 0], one[:, 1]), 1e-12)
    kappa = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / speed**3
    if closed:
        xy[-1], kappa[-1] = xy[0], kappa[0]
    after = np.minimum(before + 1, len(run.wish) - 1)
    low = np.minimum(run.wish[before], run.wish[after])
    on_point = within == 0
    wish = np.append(np.where(on_point, run.wish[before], low), run.wish[-1])
    return xy, s, theta, kappa, wish


_GAUSS = 0.5 * (3 / 5) ** 0.5
"""Outer nodes of the quadrature that measures lengths, from the middle of an interval."""
