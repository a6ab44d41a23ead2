"""Where the robots were, to begin with: odometry, moved by what the sightings say in the median over some seconds."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.trajectory.state import Robot
from airground.geometry.limited import LimitedHomography

if TYPE_CHECKING:
    from airground.calibration.trajectory.chain import Chain
    from airground.calibration.trajectory.view import View
    from airground.geometry.arrays import FloatArray

__all__ = ["first_robot", "resampled"]

HALF = 15  # sightings on each side that the median is over


def first_robot(
    view: View, model: LimitedHomography, chain: Chain, offset: float, turn: float
) -> Robot:
    """Positions at the sightings, unmoved by gross errors among them.

    Parameters
    ----------
    view : View
        The ground's origin lies under its middle.
    model : LimitedHomography
        First estimate.
    chain : Chain
        Sightings and readings.
    offset : float [s]
        Clock offset.
    turn : float [rad]
        What to add to the headings.

    Returns
    -------
    robot : Robot
        Without drift and slip.
    """
    odometry = chain.odometry(offset)
    cos, sin = np.cos(turn), np.sin(turn)
    read = odometry.xy @ np.array([[cos, sin], [-sin, cos]])
    seen = model.ground_position(chain.uv, view.middle)
    moved = np.empty_like(seen)
    bounds = np.flatnonzero(np.concatenate([[True], ~chain.link, [True]]))
    for first, last in pairwise(bounds):
        moved[first:last] = _running_median((seen - read)[first:last])
    zero = np.zeros(len(chain))
    return Robot(xy=read + moved, drift=zero, slip=zero, turn=turn)


def resampled(robot: Robot, few: Chain, many: Chain, offset: float) -> Robot:
    """Unknowns at more sightings, from those at some of them.

    Parameters
    ----------
    robot : Robot
        At the few.
    few : Chain
        Some sightings.
    many : Chain
        All of the same robot.
    offset : float [s]
        Clock offset.

    Returns
    -------
    robot : Robot
        At all: the odometry carries positions from the few to those between them.
    """

    def between(values: FloatArray) -> FloatArray:
        return np.interp(many.t, few.t, values)

    cos, sin = np.cos(robot.turn), np.sin(robot.turn)
    turn = np.exp(robot.scale) * np.array([[cos, sin], [-sin, cos]])
    off = robot.xy - few.odometry(offset).xy @ turn
    xy = many.odometry(offset).xy @ turn + np.column_stack([between(off[:, 0]), between(off[:, 1])])
    return Robot(
        xy, between(robot.drift), between(robot.slip), robot.turn, robot.scale, robot.lever
    )


def _running_median(values: FloatArray) -> FloatArray:
    """Median over neighbours, NaN not counted; of all there are where there are few."""
    count = len(values)
    size = min(2 * HALF + 1, count)
    windows = np.lib.stride_tricks.sliding_window_view(values, size, axis=0)
    step = max(1, size // 4)  # as smooth as the median is, every so many of them are enough
    places = np.arange(0, len(windows), step)
    if places[-1] != len(windows) - 1:
        places = np.append(places, len(windows) - 1)
    known = np.isfinite(windows[places]).any(axis=-1).all(axis=-1)
    if not known.any():
        return np.zeros_like(values)
    medians = np.nanmedian(windows[places[known]], axis=-1)
    middle = places[known] + (size - 1) / 2
    rows = np.arange(count)
    return np.column_stack([np.interp(rows, middle, medians[:, k]) for k in (0, 1)])
