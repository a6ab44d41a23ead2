"""What the recursive estimator knows about each robot, given the globals."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["GATE", "HUBER", "Frame", "Outcome", "RobotRows"]

GATE = 20.0  # squared innovation, two degrees of freedom: one good sighting in 20,000 is beyond
HUBER = 9.0  # beyond it a sighting counts less; one good one in 90 is


class Frame(NamedTuple):
    """Sightings of different robots, with what their readings say at the same times."""

    robots: IntArray
    """(N,). Numbers, each once."""

    c: FloatArray
    """(N, 2). Normalised image points."""

    variance: FloatArray
    """(N,). Of each coordinate, in normalised pixels."""

    path: FloatArray
    """(N, 8). Columns of `PathPoint`."""

    dt: FloatArray
    """(N,) [s]. Since the robot's last sighting; 0 for the first."""

    def take(self, rows: IntArray) -> Frame:
        """Some of the sightings.

        Parameters
        ----------
        rows : (M,) array of int
            Which.

        Returns
        -------
        frame : Frame
            Those.
        """
        return Frame(
            self.robots[rows], self.c[rows], self.variance[rows], self.path[rows], self.dt[rows]
        )


class Outcome(NamedTuple):
    """What a frame's sightings of robots already known said. Rows are those of `robots`."""

    robots: IntArray
    """(M,). Those that were predicted."""

    nis: FloatArray
    """(M,). Normalised innovation squared: chi-square with two degrees of freedom."""

    weight: FloatArray
    """(M,). What the sighting counted; 0 if it was refused."""

    score: FloatArray
    """(M, K). Gradient of the log-likelihood by the globals."""

    spread: FloatArray
    """(M, K, K). Covariance of the score, if the model holds."""

    residual: FloatArray
    """(M, 2). Innovations in normalised pixels."""


class RobotRows:
    """States of all robots: ``l | x ~ N(mean + slope (x - at), S)``.

    Parameters
    ----------
    unknowns : int
        Globals, K.
    bias_sigma : float [rad]
        Prior deviation of a robot's heading bias, but that of robot 0.
    bias_drift : float [rad/sqrt(s)]
        Random walk of the biases; with neither there is no such state.
    """

    def __init__(self, unknowns: int, bias_sigma: float, bias_drift: float) -> None:
        self.width = 3 if bias_sigma > 0 or bias_drift > 0 else 2
        self.drift = bias_drift**2
        self._bias = bias_sigma**2
        self._unknowns = unknowns
        self.mean = np.zeros((0, self.width))
        self.slope = np.zeros((0, self.width, unknowns))
        self.S = np.zeros((0, self.width, self.width))
        self.at = np.zeros((0, unknowns))
        self.before = np.zeros((0, 8))

    def __len__(self) -> int:
        return len(self.mean)

    def grow(self, count: int) -> None:
        """Make room for robots.

        Parameters
        ----------
        count : int
            How many there are now.
        """
        old = len(self)
        if count <= old:
            return
        added, L, K = max(count, 2 * old, 8) - old, self.width, self._unknowns
        self.mean = np.concatenate([self.mean, np.zeros((added, L))])
        self.slope = np.concatenate([self.slope, np.zeros((added, L, K))])
        S = np.zeros((added, L, L))
        if L == 3:
            S[:, 2, 2] = self._bias
            if old == 0:
                S[0, 2, 2] = 0.0  # the ground frame is that of the first robot's headings
        self.S = np.concatenate([self.S, S])
        self.at = np.concatenate([self.at, np.zeros((added, K))])
        before = np.zeros((added, 8))
        before[:, 7] = -1.0  # in no stretch of readings: not known
        self.before = np.concatenate([self.before, before])

    def turned(self, robots: IntArray, d: FloatArray) -> FloatArray:
        """Take the readings' vectors into the ground frame.

        Parameters
        ----------
        robots : (N,) array of int
            Whose.
        d : (N, 2) array
            Vectors as read.

        Returns
        -------
        d : (N, 2) array
            Turned back by the heading biases.
        """
        if self.width == 2:
            return d
        bias = self.mean[robots, 2]
        cos, sin = np.cos(bias), np.sin(bias)
        return np.stack([cos * d[:, 0] + sin * d[:, 1], cos * d[:, 1] - sin * d[:, 0]], axis=1)
