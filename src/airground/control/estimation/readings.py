"""What a reading of compass, odometer or gyroscope does to a belief: weighed one by one, taken together.

A reading is ``heading = theta + bias``, ``speed = v / (1 + a)``, ``turn rate = omega / (1 + b)``. All three go through
one update of three rows; what was not read has an empty one.
"""

from __future__ import annotations

from math import inf, pi, remainder
from typing import TYPE_CHECKING

import numpy as np

from airground.control.estimation.model import (
    BIAS,
    OMEGA,
    SIZE,
    SPEED_SCALE,
    THETA,
    TURN_SCALE,
    Gaussian,
    V,
    added,
)

if TYPE_CHECKING:
    from airground.control.estimation.options import StateOptions
    from airground.geometry.arrays import FloatArray

__all__ = ["correct"]

_LEAST_SCALE = 0.2


def correct(
    belief: Gaussian, read: tuple[float, ...], options: StateOptions
) -> tuple[Gaussian, int]:
    """Belief after readings at one time.

    Parameters
    ----------
    belief : Gaussian
        Before.
    read : (3,) tuple of float
        Heading [rad], speed [m/s] and turn rate [rad/s]; infinite where there is none.
    options : StateOptions
        Of the vehicle.

    Returns
    -------
    belief : Gaussian
        Afterwards.
    doubted : int
        How many of them lay beyond the gate. Such a one counts as if its noise put it just there: the further off, the
        less it pulls. Wheels that slip are outvoted by the sightings, and wheels that are held are believed in time.
    """
    H, residual, noise = _expected(belief.mean, read, options)
    P = belief.covariance
    HP = H.dot(P)
    S = HP.dot(H.T).tolist()
    doubted = 0
    for k in range(3):
        least = (residual[k] / options.gate_sigma) ** 2
        S[k][k] += noise[k]
        if S[k][k] < least:
            S[k][k], doubted = least, doubted + 1
    K = HP.T.dot(_inverse(S))
    return Gaussian(added(belief.mean, K.dot(residual).tolist()), P - K.dot(HP)), doubted


def _expected(
    mean: tuple[float, ...], read: tuple[float, ...], options: StateOptions
) -> tuple[FloatArray, list[float], list[float]]:
    """Derivatives of the readings by the state (3, 8), residuals and variances; empty rows for what was not read."""
    heading, speed, turn_rate = read
    H, residual, noise = np.zeros((3, SIZE)), [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]
    if heading < inf:
        H[0, THETA] = H[0, BIAS] = 1.0
        residual[0] = remainder(heading - mean[THETA] - mean[BIAS], 2 * pi)
        noise[0] = options.heading_sigma_rad**2
    if speed < inf:
        unit = 1 / max(_LEAST_SCALE, 1 + mean[SPEED_SCALE])
        expected = mean[V] * unit
        H[1, V], H[1, SPEED_SCALE] = unit, -expected * unit
        residual[1] = speed - expected
        share = options.speed_noise * max(abs(speed), abs(expected))
        noise[1] = options.speed_sigma_mps**2 + share * share
    if turn_rate < inf:
        unit = 1 / max(_LEAST_SCALE, 1 + mean[TURN_SCALE])
        expected = mean[OMEGA] * unit
        H[2, OMEGA], H[2, TURN_SCALE] = unit, -expected * unit
        residual[2] = turn_rate - expected
        share = options.turn_rate_noise * max(abs(turn_rate), abs(expected))
        noise[2] = options.turn_rate_sigma_radps**2 + share * share
    return H, residual, noise


def _inverse(S: list[list[float]]) -> FloatArray:
    """Inverse of a symmetric 3x3 matrix by its adjugate: NumPy's takes three times as long."""
    (a, b, c), (_, d, e), (_, _, f) = S
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    D, E, F = a * f - c * c, b * c - a * e, a * d - b * b
    det = a * A + b * B + c * C
    A, B, C, D, E, F = A / det, B / det, C / det, D / det, E / det, F / det
    return np.array((A, B, C, B, D, E, C, E, F)).reshape(3, 3)
