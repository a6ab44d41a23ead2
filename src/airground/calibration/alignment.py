"""The linear fit when every robot's heading counts from a zero of its own.

A heading that differs by a constant turns the ground frame of one robot against the others'. With g from
the robot whose own drive determines it best, the turn of each other robot is linear least squares in its
cosine and sine::

    uv_dot = J(c) (cos w + sin w_perp),      w its ground velocity, w_perp the same turned by 90 degrees

Then g is fitted again to all, and so on. Where no robot alone determines g, their headings are taken as
counted from one zero, as compasses do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.linear import (
    RANK_TOL,
    denormalized,
    linear_system,
    null_vector,
    scale_by_speed,
)
from airground.calibration.samples import MotionSamples
from airground.geometry.arrays import FloatArray
from airground.geometry.velocity import image_velocity

if TYPE_CHECKING:
    from airground.calibration.correspondences import Correspondences
    from airground.calibration.recordings import IntArray

__all__ = ["LinearFit", "fit_linear", "unexplained"]

ROUNDS = 3
MIN_SAMPLES = 12  # of a robot that the others are turned to
CLEAR = 0.35  # s6/s5 up to which a robot's own drive determines g: what it leaves open over what it fixes least


@dataclass(frozen=True, slots=True, eq=False)
class LinearFit:
    """g without a rank test, and the turns of the robots' headings."""

    g: FloatArray
    """(3, 2). Scaled as in eq. 21; some g also where the motion does not determine it."""

    singular: FloatArray
    """(6,). Singular values of eq. 16's system in normalised pixels, descending."""

    turns: FloatArray
    """(K,) [rad]. What to add to each target's headings; 0 for the reference."""

    reference: int
    """Target whose heading's zero is that of the ground frame; -1 where all are taken as one."""

    samples: MotionSamples
    """The samples with their ground velocities turned."""


def fit_linear(data: Correspondences, *, like: LinearFit | None = None) -> LinearFit:
    """Fit eqs. 16 and 17 to all targets, with their headings turned to one zero where need be.

    Parameters
    ----------
    data : Correspondences
        Of one or several targets.
    like : LinearFit, optional
        A fit to nearly the same data, to start from and to take the reference from.

    Returns
    -------
    fit : LinearFit
        No rank test is made here.

    Raises
    ------
    UnobservableMotionError
        If the image velocities do not follow the ground velocities at all.
    """
    turns = np.zeros(data.target_count)
    present = np.unique(data.target_index)
    apart = not data.one_frame and len(present) > 1  # headings may count from several zeros
    reference, g = -1, np.zeros((3, 2))
    if apart and like is None:
        reference, g = _reference(data, present)
    elif apart and like is not None:
        reference, turns, g = like.reference, np.array(like.turns), like.g
    if reference < 0:
        return LinearFit(*_fit(data.samples), turns, -1, data.samples)
    samples, singular = data.samples, np.zeros(6)
    for _ in range(ROUNDS if like is None else 1):
        for target in present:
            turns[target] = _turn(g, data.samples.take(data.target_index == target))
        turns -= turns[reference]
        samples = _turned(data.samples, turns[data.target_index])
        g, singular = _fit(samples)
    return LinearFit(g, singular, turns, reference, samples)


def unexplained(g: FloatArray, samples: MotionSamples) -> float:
    """Share of the image motion that eq. 15 leaves unexplained.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography.
    samples : MotionSamples
        Motion correspondences.

    Returns
    -------
    share : float
        Root mean square of the residual over that of the image velocity: 0 is perfect, 1 is nothing explained.
    """
    residual = samples.uv_dot - image_velocity(g, samples.uv, samples.xy_dot)
    power = float(np.sum(samples.uv_dot**2))
    return float(np.sqrt(np.sum(residual**2) / power)) if power > 0 else 1.0


def _fit(samples: MotionSamples) -> tuple[FloatArray, FloatArray]:
    """Scaled g and the system's singular values."""
    A, T = linear_system(samples)
    g_hat, singular = null_vector(A)
    return scale_by_speed(denormalized(g_hat, T), samples), singular


def _reference(data: Correspondences, present: IntArray) -> tuple[int, FloatArray]:
    """Target whose own drive determines g best, and that g; -1 if none does."""
    best, best_g, ratio = -1, np.zeros((3, 2)), CLEAR
    for target in present:
        mine = data.samples.take(data.target_index == target)
        if len(mine) < MIN_SAMPLES:
            continue
        g, singular = _fit(mine)
        if singular[4] > RANK_TOL * singular[0] and singular[5] < ratio * singular[4]:
            best, best_g, ratio = int(target), g, float(singular[5] / singular[4])
    return best, best_g


def _turn(g: FloatArray, samples: MotionSamples) -> float:
    along = image_velocity(g, samples.uv, samples.xy_dot)
    across = image_velocity(g, samples.uv, samples.xy_dot[:, ::-1] * (-1.0, 1.0))
    normal = np.array(
        [[np.sum(along**2), np.sum(along * across)], [np.sum(along * across), np.sum(across**2)]]
    )
    right = np.array([np.sum(along * samples.uv_dot), np.sum(across * samples.uv_dot)])
    cos, sin = np.linalg.lstsq(normal, right, rcond=None)[0]
    return float(np.arctan2(sin, cos))


def _turned(samples: MotionSamples, turn: FloatArray) -> MotionSamples:
    cos, sin = np.cos(turn), np.sin(turn)
    x, y = samples.xy_dot.T
    return MotionSamples(
        samples.uv, samples.uv_dot, np.column_stack([cos * x - sin * y, sin * x + cos * y])
    )
