"""Where tracks are and how they move: several Kalman filters for each, one for each way to move, that interact.

A coordinate of a track has a position p, a velocity v and an acceleration a that forgets itself (R. A. Singer,
Estimating optimal tracking filter performance for manned maneuvering targets, IEEE AES 1970)::

    dp = v dt,   dv = a dt,   da = -a/T dt + sqrt(2/T) A dw

with the time constant T shared by all ways to move and a root mean square acceleration A for each. Being continuous in
time it holds for any step, however uneven. The filters interact as in H. Blom and Y. Bar-Shalom, The interacting
multiple model algorithm, IEEE TAC 1988. All arrays hold all tracks; a track's state is [u, v, their rates, theirs].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.polynomial.legendre import leggauss

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray
    from airground.vision.tracker.options import TrackerOptions

__all__ = ["Beliefs", "MotionModel", "log_normal_2", "transition"]

LOG_2PI = float(np.log(2 * np.pi))
NODES, WEIGHTS = leggauss(8)  # exact to rounding for steps up to some T, and never not positive
TIMES = np.concatenate([[1.0], 0.5 * (NODES + 1)])


@dataclass(frozen=True, slots=True, eq=False)
class Beliefs:
    """What is believed of R tracks under each of M ways to move."""

    x: FloatArray
    """(R, M, 6) [px, px/s, px/s2]. Means."""

    covariance: FloatArray
    """(R, M, 6, 6). Covariances."""

    mode: FloatArray
    """(R, M). How probable each way to move is."""

    def __len__(self) -> int:
        return len(self.x)

    def take(self, rows: IntArray) -> Self:
        """Some of the tracks.

        Parameters
        ----------
        rows : (K,) array of int
            Which, in the order wanted.

        Returns
        -------
        beliefs : Beliefs
            Theirs.
        """
        return type(self)(self.x[rows], self.covariance[rows], self.mode[rows])

    def put(self, rows: IntArray, other: Beliefs) -> Self:
        """Replace some of the tracks.

        Parameters
        ----------
        rows : (K,) array of int
            Which.
        other : Beliefs
            K others.

        Returns
        -------
        beliefs : Beliefs
            As many as before.
        """
        x, covariance, mode = self.x.copy(), self.covariance.copy(), self.mode.copy()
        x[rows], covariance[rows], mode[rows] = other.x, other.covariance, other.mode
        return type(self)(x, covariance, mode)

    def join(self, *others: Beliefs) -> Self:
        """Append tracks.

        Parameters
        ----------
        *others : Beliefs
            What to append.

        Returns
        -------
        beliefs : Beliefs
            These, then those.
        """
        every: tuple[Beliefs, ...] = (self, *others)
        return type(self)(
            np.concatenate([beliefs.x for beliefs in every]),
            np.concatenate([beliefs.covariance for beliefs in every]),
            np.concatenate([beliefs.mode for beliefs in every]),
        )

    def combined(self, size: int = 4) -> tuple[FloatArray, FloatArray]:
        """Mean and covariance whatever the way to move.

        Parameters
        ----------
        size : int
            How many entries D of the state: 2 for positions alone, 4 with velocities, 6 for all.

        Returns
        -------
        x : (R, D) array
            Means.
        covariance : (R, D, D) array
            Covariances, with what the ways to move differ by.
        """
        part = self.x[..., :size]
        x = (self.mode[:, None, :] @ part)[:, 0]
        off = part - x[:, None]
        cover = self.covariance[..., :size, :size].reshape(*self.mode.shape, size * size)
        within = self.mode[:, None, :] @ cover
        between = (off * self.mode[..., None]).swapaxes(1, 2) @ off
        return x, _symmetric(within.reshape(-1, size, size) + between)


@dataclass(frozen=True, slots=True, eq=False)
class MotionModel:
    """The ways to move."""

    accelerations: FloatArray
    """(M,) [px/s2]. Root mean square acceleration of each."""

    manoeuvre_s: float
    """How long an acceleration lasts [s]."""

    switch_s: float
    """How long a way to move lasts [s]."""

    speed_pxps: float
    """Usual speed [px/s]."""

    @classmethod
    def from_options(cls, options: TrackerOptions) -> Self:
        """Take the model from a tracker's options.

        Parameters
        ----------
        options : TrackerOptions
            Those.

        Returns
        -------
        model : MotionModel
            Its ways to move.
        """
        levels = np.sort(np.array(options.accelerations_pxps2))
        return cls(levels, options.manoeuvre_s, options.switch_s, options.speed_pxps)

    @property
    def shares(self) -> FloatArray:
        """(M,). Share of time spent in each way to move: the fiercest is rare."""
        shares = np.ones(len(self.accelerations))
        if len(shares) > 1:
            shares[-1] = 0.2
        normalised: FloatArray = shares / shares.sum()
        return normalised

    def begin(self, uv: FloatArray, covariance: FloatArray) -> Beliefs:
        """Beliefs about things seen once.

        Parameters
        ----------
        uv : (R, 2) array [px]
            Where.
        covariance : (R, 2, 2) array [px2]
            Of that.

        Returns
        -------
        beliefs : Beliefs
            At rest on average, with the usual speed as standard deviation.
        """
        rows, modes = len(uv), len(self.accelerations)
        x = np.zeros((rows, modes, 6))
        x[:, :, :2] = uv[:, None]
        spread = np.zeros((rows, modes, 6, 6))
        spread[:, :, :2, :2] = covariance[:, None]
        for k in (0, 1):
            spread[:, :, 2 + k, 2 + k] = self.speed_pxps**2
            spread[:, :, 4 + k, 4 + k] = self.accelerations**2
        return Beliefs(x, spread, np.tile(self.shares, (rows, 1)))

    def predict(self, beliefs: Beliefs, dt: float) -> Beliefs:
        """Beliefs some time later, with nothing seen in between.

        Parameters
        ----------
        beliefs : Beliefs
            Now.
        dt : float [s]
            How much later; zero or more.

        Returns
        -------
        beliefs : Beliefs
            Then.
        """
        if len(beliefs) == 0 or dt == 0:
            return beliefs
        mixed = self._mix(beliefs, dt)
        step, noise = transition(dt, self.manoeuvre_s)
        # One product of large matrices each, as the step is the same for all.
        rows = mixed.covariance.reshape(-1, 6) @ step.T
        rows = rows.reshape(mixed.covariance.shape).swapaxes(-1, -2).reshape(-1, 6) @ step.T
        covariance = _symmetric(rows.reshape(mixed.covariance.shape))
        covariance += self.accelerations[:, None, None] ** 2 * noise
        return Beliefs(mixed.x @ step.T, covariance, mixed.mode)

    def _mix(self, beliefs: Beliefs, dt: float) -> Beliefs:
        """Interaction: each way to move begins from what led to it."""
        stay = float(np.exp(-dt / self.switch_s))
        chain = stay * np.eye(len(self.accelerations)) + (1 - stay) * self.shares
        joint = beliefs.mode[:, :, None] * chain  # from way i to way j
        mode = joint.sum(axis=1)
        weight = (joint / mode[:, None]).swapaxes(1, 2)  # (R, j, i)
        centre = (beliefs.mode[:, None, :] @ beliefs.x)[:, 0]
        off = beliefs.x - centre[:, None]
        mean = weight @ off
        moment = beliefs.covariance + off[..., :, None] * off[..., None, :]
        moment = (weight @ moment.reshape(*beliefs.mode.shape, 36)).reshape(moment.shape)
        moment -= mean[..., :, None] * mean[..., None, :]
        return Beliefs(centre[:, None] + mean, moment, mode)

    def update(
        self, beliefs: Beliefs, uv: FloatArray, covariance: FloatArray
    ) -> tuple[Beliefs, FloatArray]:
        """Beliefs after a sighting of each track.

        Parameters
        ----------
        beliefs : Beliefs
            Predicted for the time of the sightings.
        uv : (R, 2) array [px]
            Sightings.
        covariance : (R, 2, 2) array [px2]
            Of those.

        Returns
        -------
        beliefs : Beliefs
            With them.
        log_likelihood : (R,) array
            Logarithm of the density [1/px2] of each sighting before it was known.
        """
        if len(beliefs) == 0:
            return beliefs, np.empty(0)
        prior = beliefs.covariance
        noise = covariance[:, None]
        off = uv[:, None] - beliefs.x[..., :2]
        seen = prior[..., :2, :2] + noise
        gain = prior[..., :2] @ _inverse_2(seen)
        x = beliefs.x + (gain @ off[..., None])[..., 0]
        # Joseph's form, written out for a measurement that is a part of the state.
        left = prior - gain @ prior[..., :2, :]
        turned = gain.swapaxes(-1, -2)
        posterior = left - left[..., :2] @ turned + gain @ noise @ turned
        log = log_normal_2(off, seen) + np.log(np.maximum(beliefs.mode, 1e-300))
        top = log.max(axis=1, keepdims=True)
        likely = np.exp(log - top)
        total = likely.sum(axis=1, keepdims=True)
        mode = np.maximum(likely / total, 1e-6)  # a way to move never becomes impossible
        mode /= mode.sum(axis=1, keepdims=True)
        return Beliefs(x, _symmetric(posterior), mode), (top + np.log(total))[:, 0]


def transition(dt: float, manoeuvre_s: float) -> tuple[FloatArray, FloatArray]:
    """Step of the state over a time, and its noise for a unit acceleration.

    Parameters
    ----------
    dt : float [s]
        The time.
    manoeuvre_s : float [s]
        Time constant T of the acceleration.

    Returns
    -------
    step : (6, 6) array
        Transition matrix.
    noise : (6, 6) array
        Covariance of what is added, for A = 1.
    """
    response = _response(dt * TIMES, manoeuvre_s)
    kicks = response[:, 1:]  # what a kick that long ago has become
    step, noise = np.zeros((6, 6)), np.zeros((6, 6))
    step.ravel()[::7] = 1.0
    step[[0, 1], [2, 3]] = dt
    noise[::2, ::2] = (kicks * (WEIGHTS * (dt / manoeuvre_s))) @ kicks.T
    for axis in (0, 1):
        step[axis::2, 4 + axis] = response[:, 0]
    noise[1::2, 1::2] = noise[::2, ::2]
    return step, noise


def _response(t: FloatArray, manoeuvre_s: float) -> FloatArray:
    """Position, velocity and acceleration some time after a unit of acceleration."""
    s = t / manoeuvre_s
    gone = np.expm1(-s)
    return np.array([manoeuvre_s**2 * (s + gone), -manoeuvre_s * gone, 1 + gone])


def log_normal_2(off: FloatArray, covariance: FloatArray) -> FloatArray:
    """Logarithm of the normal density in the plane.

    Parameters
    ----------
    off : (..., 2) array [px]
        Offset from the mean.
    covariance : (..., 2, 2) array [px2]
        Covariance.

    Returns
    -------
    log : (...) array
        Of the density [1/px2].
    """
    a, b, c = covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]
    determinant = a * c - b * b
    u, v = off[..., 0], off[..., 1]
    square = (c * u * u - 2 * b * u * v + a * v * v) / determinant
    log: FloatArray = -0.5 * (square + np.log(determinant)) - LOG_2PI
    return log


def _inverse_2(matrix: FloatArray) -> FloatArray:
    a, b, c = matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 1, 1]
    inverse = np.empty_like(matrix)
    inverse[..., 0, 0], inverse[..., 1, 1] = c, a
    inverse[..., 0, 1] = inverse[..., 1, 0] = -b
    inverse /= (a * c - b * b)[..., None, None]
    return inverse


def _symmetric(matrix: FloatArray) -> FloatArray:
    return 0.5 * (matrix + matrix.swapaxes(-1, -2))
