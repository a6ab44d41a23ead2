"""Residuals of one chain and their derivatives, in units of their noise levels.

A sighting at ground point Q = P + R(heading + turn + drift) lever gives two rows, divided by its spread::

    uv - project(g, Q)                                                        [px]

The odometry between neighbours gives two, along and across its own increment d, in the reading's own scale (so
that shrinking the ground does not shrink them), divided by the square root of the increment's noise power::

    F' (exp(-scale - slip) R(-turn - drift) (P_1 - P_0) - d)

The local unknowns of a sighting are its position, then its drift and slip where they are estimated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.trajectory.view import project, project_with_derivatives
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.calibration.trajectory.chain import Chain, Odometry
    from airground.calibration.trajectory.state import Layout, Robot, State
    from airground.calibration.trajectory.view import View

LEAST_PART = 0.3  # of the noise power, for increments shorter than the time between readings

__all__ = [
    "OdometryRows",
    "Residuals",
    "SightingRows",
    "odometry_rows",
    "residuals",
    "sighting_rows",
]


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """Residuals of one chain, without derivatives."""

    sighting: FloatArray
    """(N, 2) [px]. Over the spreads."""

    odometry: FloatArray
    """(L, 2) [sqrt(s)]. Along and across, over the root of the noise power."""


@dataclass(frozen=True, slots=True, eq=False)
class SightingRows:
    """Linearised sightings: measured minus predicted, and derivatives of the prediction."""

    residual: FloatArray
    """(N, 2) [px]."""

    local: FloatArray
    """(N, 2, W). By the local unknowns."""

    border: FloatArray
    """(N, 2, B). By the global unknowns of this chain."""


@dataclass(frozen=True, slots=True, eq=False)
class OdometryRows:
    """Linearised increments: the residual and its own derivatives."""

    first: np.ndarray[tuple[int, ...], np.dtype[np.intp]]
    """(L,). Sighting at the start of each link; the next one is at its end."""

    residual: FloatArray
    """(L, 2). Along and across."""

    start: FloatArray
    """(L, 2, W). By the local unknowns at the start."""

    end: FloatArray
    """(L, 2, 2). By the position at the end."""

    border: FloatArray
    """(L, 2, B). By the global unknowns of this chain."""

    active: tuple[int, ...] | None = None
    """Columns of `border` that are not zero; all where None."""


def residuals(
    view: View, chain: Chain, odometry: Odometry, state: State, robot: Robot
) -> Residuals:
    """Residuals of one chain.

    Parameters
    ----------
    view : View
        Normalisation of the image.
    chain : Chain
        Sightings.
    odometry : Odometry
        Readings at the state's offset.
    state : State
        Global unknowns.
    robot : Robot
        This chain's unknowns.

    Returns
    -------
    residuals : Residuals
        NaN for sightings that the camera could not have made.
    """
    tracked = robot.xy + _lever(odometry, robot)
    seen = project(view, state.g, state.bend, tracked)
    first, step, frame, _, shrink, unit = _increments(chain, odometry, robot)
    moved = robot.xy[first + 1] - robot.xy[first]
    local = _into(frame, moved) * shrink[:, None]
    local[:, 0] -= step
    return Residuals((chain.uv - seen) / chain.spread[:, None], local / unit)


def sighting_rows(
    view: View,
    chain: Chain,
    odometry: Odometry,
    state: State,
    robot: Robot,
    *,
    layout: Layout,
    number: int,
) -> SightingRows:
    """Linearise the sightings.

    Parameters
    ----------
    view : View
        Normalisation of the image.
    chain : Chain
        Sightings.
    odometry : Odometry
        Readings at the state's offset.
    state : State
        Global unknowns.
    robot : Robot
        This chain's unknowns.
    layout : Layout
        What is estimated.
    number : int
        Which robot it is.

    Returns
    -------
    rows : SightingRows
        Residuals and derivatives.
    """
    free = layout.free
    lever = _lever(odometry, robot)
    bend = layout.bend
    seen = project_with_derivatives(
        view, state.g, state.bend, robot.xy + lever, lens_too=bend is not None
    )
    count, width = len(chain), layout.shared + layout.own_size(number)
    local = np.zeros((count, 2, free.width))
    border = np.zeros((count, 2, width))
    local[:, :, :2] = seen.by_xy
    border[:, :, :6] = seen.by_g
    levered = robot.lever != (0.0, 0.0)
    if levered:
        swung = _apply(seen.by_xy, _left(lever))  # by a turn of the heading
        if free.drift:
            local[:, :, 2] = swung
        if layout.offset is not None:
            border[:, :, layout.offset] = swung * odometry.turn_rate[:, None]
        if (turn := layout.turn(number)) is not None:
            border[:, :, turn - layout.own(number) + layout.shared] = swung
    if bend is not None and seen.by_bend is not None:
        border[:, :, bend] = seen.by_bend
    if (place := layout.lever(number)) is not None:
        k = place - layout.own(number) + layout.shared
        forward = _unit(odometry.heading + robot.turn + robot.drift)
        border[:, :, k] = _apply(seen.by_xy, forward)
        border[:, :, k + 1] = _apply(seen.by_xy, _left(forward))
    over = (1 / chain.spread)[:, None, None]
    return SightingRows(
        (chain.uv - seen.uv) * over[:, :, 0],
        local if over.max() == over.min() == 1.0 else local * over,
        border if over.max() == over.min() == 1.0 else border * over,
    )


def odometry_rows(
    chain: Chain, odometry: Odometry, robot: Robot, *, layout: Layout, number: int
) -> OdometryRows:
    """Linearise the increments.

    Parameters
    ----------
    chain : Chain
        Sightings.
    odometry : Odometry
        Readings at the state's offset.
    robot : Robot
        This chain's unknowns.
    layout : Layout
        What is estimated.
    number : int
        Which robot it is.

    Returns
    -------
    rows : OdometryRows
        Residuals and derivatives.
    """
    free = layout.free
    first, step, frame, own_frame, shrink, unit = _increments(chain, odometry, robot)
    moved = robot.xy[first + 1] - robot.xy[first]
    went = _into(frame, moved) * shrink[:, None]  # what the readings should have said
    over = 1 / unit
    links = len(first)
    end = np.stack([frame, _left(frame)], axis=1) * (shrink[:, None] * over)[:, :, None]
    start = np.zeros((links, 2, free.width))
    start[:, :, :2] = -end
    turned = np.column_stack([went[:, 1], -went[:, 0]]) * over  # by a turn of the readings
    shrunk = -went * over  # by a scale of the readings
    if free.drift:
        start[:, :, 2] = turned
    if free.slip:
        start[:, :, free.width - 1] = shrunk
    border = np.zeros((links, 2, layout.shared + layout.own_size(number)))
    active = [layout.shared]
    if layout.offset is not None:
        active.append(layout.offset)
        faster = odometry.xy_dot[first + 1] - odometry.xy_dot[first]
        border[:, :, layout.offset] = -_into(own_frame, faster) * over
    border[:, :, layout.shared] = shrunk
    if (turn := layout.turn(number)) is not None:
        active.append(turn - layout.own(number) + layout.shared)
        border[:, :, active[-1]] = turned
    went[:, 0] -= step
    return OdometryRows(first, went * over, start, end, border, tuple(active))


def _increments(
    chain: Chain, odometry: Odometry, robot: Robot
) -> tuple[
    np.ndarray[tuple[int, ...], np.dtype[np.intp]],
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
]:
    """Links, lengths read, directions on the ground and as read, factor to the reading's scale, noise unit."""
    first = np.flatnonzero(chain.link)
    d = odometry.xy[first + 1] - odometry.xy[first]
    step = np.hypot(d[:, 0], d[:, 1])
    moving = step > 1e-12
    own_frame = np.where(
        moving[:, None], d / np.where(moving, step, 1.0)[:, None], np.array([1.0, 0.0])
    )
    frame = _turn(own_frame, robot.turn + robot.drift[first])
    shrink = np.exp(-robot.scale - robot.slip[first])
    power = odometry.power[first + 1] - odometry.power[first]
    dt = chain.t[first + 1] - chain.t[first]
    part = np.maximum(1 - np.array(chain.shared) / dt[:, None], LEAST_PART)
    unit = np.sqrt(np.maximum(power[:, None] * part, 1e-18))
    return first, step, frame, own_frame, shrink, unit


def _lever(odometry: Odometry, robot: Robot) -> FloatArray:
    """Tracked point from the odometry's, on the ground."""
    if robot.lever == (0.0, 0.0):
        return np.zeros_like(odometry.xy)
    forward = _unit(odometry.heading + robot.turn + robot.drift)
    return robot.lever[0] * forward + robot.lever[1] * _left(forward)


def _unit(angle: FloatArray) -> FloatArray:
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _left(v: FloatArray) -> FloatArray:
    return np.column_stack([-v[:, 1], v[:, 0]])


def _turn(v: FloatArray, angle: FloatArray) -> FloatArray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.column_stack([cos * v[:, 0] - sin * v[:, 1], sin * v[:, 0] + cos * v[:, 1]])


def _into(frame: FloatArray, v: FloatArray) -> FloatArray:
    """Components of v along the frame's direction and to its left."""
    x = frame[:, 0] * v[:, 0] + frame[:, 1] * v[:, 1]
    y = frame[:, 0] * v[:, 1] - frame[:, 1] * v[:, 0]
    return np.column_stack([x, y])


def _apply(matrix: FloatArray, v: FloatArray) -> FloatArray:
    return matrix[:, :, 0] * v[:, :1] + matrix[:, :, 1] * v[:, 1:]
