"""What a straight leg would tell about g: its Fisher information, with the positions eliminated.

The leg is seen at a few places, each standing for the sightings around it, and the odometry carries a random walk from
one to the next. Given g the robot's position P_k has the slope M_k and covariance S_k of the recursive estimator, so::

    A_k = H_g + H_P M_k,   W_k = H_P S_k H_P' + R,   information = sum_k A_k' W_k^-1 A_k

Where the position beforehand is not known, the first place tells nothing. Many legs are computed at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.calibration.online_model import inverse_2x2, sighting_gradients
from airground.geometry.velocity import ground_velocity, image_velocity_gradient

if TYPE_CHECKING:
    from airground.geometry.arrays import FloatArray

__all__ = ["Position", "leg_information", "velocity_weight"]

PLACES = 7


class Position(NamedTuple):
    """How well the robot's position is known, given g: ``P | x ~ N(P + slope dx, S)``."""

    slope: FloatArray
    """(N, 2, 6) [m]."""

    S: FloatArray
    """(N, 2, 2) [m^2]."""


def leg_information(
    x: FloatArray,
    start: FloatArray,
    steps: FloatArray,
    *,
    sigma: float,
    spacing_m: float,
    walk: float,
    position: Position | None = None,
    places: int = PLACES,
) -> tuple[FloatArray, Position]:
    """Information about g that straight legs would give.

    Parameters
    ----------
    x : (6,) array
        g in an `ImageFrame`, row by row.
    start : (2,) or (N, 2) array [m]
        Where the legs begin, from the point under c_ref.
    steps : (N, 2) array [m]
        From there to the end of each.
    sigma : float
        Standard deviation of each coordinate of a sighting, in normalised pixels.
    spacing_m : float [m]
        Way from one sighting to the next.
    walk : float [sqrt(m)]
        Standard deviation of the odometry after one metre, in each direction; it grows with the root of the way.
    position : Position, optional
        What is known of the start, of one row or N; nothing where not given.
    places : int
        Into how many places the sightings of a leg are put together.

    Returns
    -------
    information : (N, 6, 6) array
        About `x`.
    position : Position
        What is known of the ends.
    """
    count = len(steps)
    length = np.linalg.norm(steps, axis=1)
    # A place cannot stand for less than one sighting.
    each = np.maximum((length / spacing_m + 1.0) / places, 1.0)
    noise = sigma**2 / each
    walked = walk**2 * length / (places - 1)
    information = np.zeros((count, 6, 6))
    if position is not None:
        slope = np.broadcast_to(position.slope, (count, 2, 6))
        S = np.array(np.broadcast_to(position.S, (count, 2, 2)))
    for k in range(places):
        _, by_g, H, _ = sighting_gradients(x, start + steps * (k / (places - 1)))
        if k == 0 and position is not None:
            continue  # seen before
        if k == 0:
            back = inverse_2x2(H)
            slope = -(back @ by_g)
            S = noise[:, None, None] * (back @ back.swapaxes(1, 2))
            continue
        S[:, 0, 0] += walked
        S[:, 1, 1] += walked
        A = by_g + H @ slope
        SH = S @ H.swapaxes(1, 2)
        W = H @ SH
        W[:, 0, 0] += noise
        W[:, 1, 1] += noise
        V = inverse_2x2(W)
        information += A.swapaxes(1, 2) @ V @ A
        gain = SH @ V
        slope = slope - gain @ A
        S = S - gain @ SH.swapaxes(1, 2)
    return information, Position(slope, S)


def velocity_weight(g: FloatArray, uv: FloatArray) -> FloatArray:
    """What a covariance of g has to be multiplied by for the variance of ground velocities.

    Parameters
    ----------
    g : (3, 2) array
        Limited homography.
    uv : (N, 2) array [px]
        Places.

    Returns
    -------
    weight : (N, 6, 6) array
        ``trace(weight @ covariance)`` is the squared relative deviation of a ground velocity there, over all headings.
    """
    unit = np.broadcast_to(np.eye(2)[:, None, :], (2, len(uv), 2))
    D = np.moveaxis(image_velocity_gradient(g, uv, unit), -1, -2)  # (2, N, 6, 2)
    back = ground_velocity(g, uv[:, None, :], D)
    return np.asarray(np.einsum("hnik,hnjk->nij", back, back) / 2)  # two headings stand for all
