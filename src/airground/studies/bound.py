"""How well g can be known from the paper's data at all: the Cramer-Rao bound of the whole drive.

What is unknown: g (6 numbers), the image point c0 of the drive's start (2), and the displacement d_k of each segment
(2 each). What is measured: the end points in pixels, by the finite form of eq. 15,

    c_j ~ c0 / (n.c0) + g (d_1 + ... + d_j),    n = G1 x G2

and each displacement as duration times measured velocity. The start is put at ground zero, which g does not see. The
bound is that of normal noise with the standard deviations of the paper's uniform noise, b / sqrt(3) for +-b: it is what
the best weighting of all data by their standard deviations can reach. (Uniform noise has no Cramer-Rao bound of its
own, as its edges say more than its spread; an estimator that used the edges could come lower.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from airground.geometry.arrays import FloatArray
from airground.studies.simulation import PAPER, PaperSimulation

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["Bound", "drive_bound"]

COMPLEX_STEP = 1e-30  # exact to rounding: nothing is subtracted


@dataclass(frozen=True, slots=True, eq=False)
class Bound:
    """The smallest covariance that an unbiased estimate of g can have."""

    g: FloatArray
    """(3, 2). Truth."""

    covariance: FloatArray
    """(6, 6). Of g, row by row."""

    @property
    def n_rms(self) -> float:
        """Root mean square of n (eq. 22)."""
        return float(np.sqrt(np.trace(self.covariance)) / np.linalg.norm(self.g))


def drive_bound(simulation: PaperSimulation = PAPER) -> Bound:
    """Cramer-Rao bound of g, given all that a trial of the simulation measures.

    Parameters
    ----------
    simulation : PaperSimulation
        Drive and noise, both noises positive.

    Returns
    -------
    bound : Bound
        By the inverse of the Fisher information; no trials.
    """
    camera, drive = simulation.camera(), simulation.drive
    corners = drive.corners
    steps = np.diff(corners, axis=0)
    truth = np.concatenate([camera.g.ravel(), camera.project(corners[0]), steps.ravel()])
    sigma_px = simulation.pixel_bound_px / np.sqrt(3)
    sigma_m = drive.duration_s * simulation.speed_bound_mps / np.sqrt(3)

    def whitened(unknowns: NDArray[Any]) -> NDArray[Any]:
        pixels = _end_points(unknowns) / sigma_px
        return np.concatenate([pixels.ravel(), unknowns[8:] / sigma_m])

    J = np.empty((2 * len(corners) + steps.size, truth.size))
    for k in range(truth.size):
        nudged = truth.astype(np.complex128)
        nudged[k] += 1j * COMPLEX_STEP
        J[:, k] = whitened(nudged).imag / COMPLEX_STEP
    # Pixels, metres and the perspective row differ by 1e5 in size: scale columns before inverting.
    size = np.linalg.norm(J, axis=0)
    R = np.linalg.qr(J / size, mode="r")
    root = np.linalg.inv(R) / size[:, None]
    return Bound(camera.g, root[:6] @ root[:6].T)


def _end_points(unknowns: ArrayLike) -> NDArray[Any]:
    """Image points of all corners; takes complex numbers."""
    x = np.asarray(unknowns)
    g, c0 = x[:6].reshape(3, 2), np.append(x[6:8], 1.0)
    n = np.cross(g[:, 0], g[:, 1])
    ground = np.concatenate([np.zeros((1, 2)), np.cumsum(x[8:].reshape(-1, 2), axis=0)])
    w = c0 / (n @ c0) + ground @ g.T
    return np.asarray(w[:, :2] / w[:, 2:])
