"""How likely an image motion is: of a vehicle that nobody knows, and of one that does what a robot's readings say.

Neighbouring windows tell the same; each counts by its share of the time after which the robot's velocity is a new one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.recordings import IntArray

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["RELATIVE", "follows", "level_prior", "noise", "on_its_own", "spans_of"]

RELATIVE = np.array([0.03, 0.045, 0.065, 0.09, 0.12])
"""Levels of noise that are tried: deviation of an image velocity from what the readings say, over its size."""

USUAL_LEVEL, LEVEL_FACTOR = 0.05, 1.7
"""Median of that level in recordings of real cars (0.02 to 0.12), and its scatter, a factor."""

SLOW = 0.2
"""Speed, over the usual one, at which the noise stops to shrink with it."""

TAIL = 5.0
"""Degrees of freedom of Student's distribution: a wrong sighting now and then does not decide."""

REST_SHARE = 0.5
"""Probability that a vehicle that nobody knows rests."""


def noise(uv_dot: FloatArray, gain: FloatArray, usual: float, relative: float) -> FloatArray:
    """Deviation of each component of velocities at a level of noise.

    Parameters
    ----------
    uv_dot : (K, 2) array [px/s]
        Velocities.
    gain : (K,) array [px/s]
        What the noise of the sightings makes of a component.
    usual : float [px/s]
        Usual speed.
    relative : float
        Level: deviation over speed.

    Returns
    -------
    sigma : (K,) array [px/s]
        With what the sightings' noise makes.
    """
    speed = np.maximum(np.hypot(uv_dot[:, 0], uv_dot[:, 1]), SLOW * usual)
    return np.asarray(np.hypot(gain, relative * speed))


def on_its_own(uv_dot: FloatArray, gain: FloatArray, usual: float) -> FloatArray:
    """Log density of each velocity, for a vehicle that drives as this one usually does, or rests.

    Parameters
    ----------
    uv_dot : (K, 2) array [px/s]
        Velocities of one fragment.
    gain : (K,) array [px/s]
        What the noise of the sightings makes of a component.
    usual : float [px/s]
        Usual speed.

    Returns
    -------
    log_density : (K,) array
        Of [px/s] in two dimensions; zeros for what stands.
    """
    if not usual > 0 or len(uv_dot) == 0:
        return np.zeros(len(uv_dot))
    level = float(RELATIVE[2])
    sigma = noise(uv_dot, gain, usual, level)
    rest2 = np.hypot(gain, level * SLOW * usual) ** 2
    moving = np.hypot(uv_dot[:, 0], uv_dot[:, 1]) > SLOW * usual
    some = uv_dot[moving] if moving.sum() >= 2 else uv_dot
    off = some - some.mean(axis=0)
    C = off.T @ off / len(off) + np.eye(2) * ((level * usual) ** 2 + float(np.median(sigma)) ** 2)
    d = uv_dot - some.mean(axis=0)
    driving = -0.5 * np.einsum("ki,ij,kj->k", d, np.linalg.inv(C), d) - 0.5 * np.log(
        (2 * np.pi) ** 2 * np.linalg.det(C)
    )
    resting = -0.5 * np.sum(uv_dot**2, axis=1) / rest2 - np.log(2 * np.pi * rest2)
    return np.asarray(np.logaddexp(np.log(1 - REST_SHARE) + driving, np.log(REST_SHARE) + resting))


def follows(residual: FloatArray, sigma: FloatArray) -> FloatArray:
    """Log density of velocities that follow the readings.

    Parameters
    ----------
    residual : (..., 2) array [px/s]
        Velocity minus what the readings say (eq. 15).
    sigma : (...) array [px/s]
        Its deviation.

    Returns
    -------
    log_density : (...) array
        Of Student's distribution in two dimensions.
    """
    z2 = np.sum(residual**2, axis=-1) / sigma**2
    return np.asarray(-np.log(2 * np.pi * sigma**2) - (TAIL + 2) / 2 * np.log1p(z2 / TAIL))


def level_prior(relative: float | FloatArray) -> FloatArray:
    """Log prior of a level of noise, up to a constant.

    Parameters
    ----------
    relative : float or array
        Deviation over speed.

    Returns
    -------
    log_prior : array
        Log-normal.
    """
    size = np.maximum(np.asarray(relative, dtype=np.float64), USUAL_LEVEL / LEVEL_FACTOR)
    return np.asarray(-0.5 * (np.log(size / USUAL_LEVEL) / np.log(LEVEL_FACTOR)) ** 2)


def spans_of(gain: FloatArray, *, switch: float) -> list[tuple[int, int, float]]:
    """Stretches in which something follows: the best sequence of two states (Viterbi).

    Parameters
    ----------
    gain : (K,) array
        Log likelihood ratio of each window, for following.
    switch : float
        What each change of state costs; the first and the last state are free.

    Returns
    -------
    spans : list of (first, stop, gain)
        Windows first..stop-1, and the sum of their gains less the changes of state.
    """
    if len(gain) == 0 or np.sum(np.maximum(gain, 0.0)) <= 0:
        return []
    count = len(gain)
    came: IntArray = np.zeros((count, 2), dtype=np.intp)
    own, follow = 0.0, float(gain[0])
    for k in range(1, count):
        g = float(gain[k])
        came[k, 0] = 1 if follow - switch > own else 0
        came[k, 1] = 1 if follow >= own - switch else 0
        own, follow = max(own, follow - switch), max(follow, own - switch) + g
    state = np.zeros(count, dtype=np.intp)
    state[-1] = 1 if follow > own else 0
    for k in range(count - 1, 0, -1):
        state[k - 1] = came[k, state[k]]
    edge = np.flatnonzero(np.diff(np.concatenate([[0], state, [0]])))
    found = []
    for first, stop in edge.reshape(-1, 2):
        cuts = int(first > 0) + int(stop < count)
        found.append((int(first), int(stop), float(np.sum(gain[first:stop])) - cuts * switch))
    return found
