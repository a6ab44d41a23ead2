"""The whole-drive model as a recursive estimator whose cost for one sighting does not grow with the robots.

Globals x are g, in normalised pixels, and, if asked for, the clock offset. Given them the robots are independent, so
the joint Gaussian is kept as that of x, by its information matrix, and for each robot its own state given x::

    l_m | x  ~  N(mean_m + slope_m (x - at_m),  S_m)

at_m is where x stood when robot m was last seen: when other robots move x, a robot's implied mean moves with it and
costs nothing. l holds the base of the robot's position, ``P(t) = base + odometry(t + offset)``, and the bias of its
headings, if asked for. A sighting ``r = H_x dx + H dl + e`` then splits into what it says about x and about l::

    A = H_x + H slope,   W = H S H' + R,   information += A' W^-1 A,   l | x by the gain S H' W^-1

which is exact for the linearised model, for any number of robots in one frame at once. A robot that comes in anew, or
whose readings had a gap, has a flat prior on its position: its sighting fixes it given x, and says nothing about x.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.online_model import inverse_2x2, sighting_gradients, unproject
from airground.calibration.online_rows import GATE, HUBER, Frame, Outcome, RobotRows
from airground.calibration.online_single import follow_one

if TYPE_CHECKING:
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["DriveFilter"]

SMALLEST = 1e-300
FRESH = 200  # rank-two updates of the covariance before it is inverted again, for the rounding


class DriveFilter:
    """Gaussian over the globals and over each robot's state given them.

    Parameters
    ----------
    x : (6,) or (7,) array
        Where to linearise first: g in normalised pixels, and the clock offset if it is unknown.
    information : (K, K) array
        Of the prior about `x`; positive definite unless held.
    bias_sigma : float [rad]
        Prior deviation of a robot's heading bias, but that of robot 0; with no drift and 0 there is no such state.
    bias_drift : float [rad/sqrt(s)]
        Random walk of the biases, of all robots.
    gate_covariance : (K, K) array, optional
        If given, `x` stays where it is until `release`: one step of Gauss-Newton over a whole recording. The gate then
        takes this for the globals' covariance, as their own is wide at first.
    """

    def __init__(
        self,
        x: FloatArray,
        information: FloatArray,
        *,
        bias_sigma: float = 0.0,
        bias_drift: float = 0.0,
        gate_covariance: FloatArray | None = None,
    ) -> None:
        self.x = np.array(x, dtype=np.float64)
        self.information = np.array(information, dtype=np.float64)
        self.rows = RobotRows(len(self.x), bias_sigma, bias_drift)
        self._moment = np.zeros_like(self.x)  # information times the step, while held
        self._gate_covariance = gate_covariance
        self._covariance: FloatArray | None = None
        self._updates = 0

    @property
    def held(self) -> bool:
        """Whether the globals stay where they are."""
        return self._gate_covariance is not None

    @property
    def covariance(self) -> FloatArray:
        """(K, K). Of the globals; needs information about all of them."""
        covariance = self._covariance
        if covariance is None:
            covariance = np.asarray(np.linalg.inv(self.information), dtype=np.float64)
            self._covariance, self._updates = covariance, 0
        return covariance

    def bias(self, robot: int) -> tuple[float, float]:
        """Heading bias of a robot.

        Parameters
        ----------
        robot : int
            Its number.

        Returns
        -------
        bias : float [rad]
            Estimate.
        sigma : float [rad]
            Standard deviation.
        """
        rows = self.rows
        if rows.width == 2 or robot >= len(rows):
            return 0.0, 0.0
        slope = rows.slope[robot, 2]
        variance = float(rows.S[robot, 2, 2] + slope @ self.covariance @ slope)
        bias = float(rows.mean[robot, 2] + slope @ (self.x - rows.at[robot]))
        return bias, max(variance, 0.0) ** 0.5

    def forget(self, factor: float) -> None:
        """Let the information about the globals fade.

        Parameters
        ----------
        factor : float
            What remains of it.
        """
        self.information *= factor
        if self._covariance is not None:
            self._covariance = self._covariance / factor

    def disturb(self, variance: FloatArray) -> None:
        """Let the globals have moved.

        Parameters
        ----------
        variance : (K,) array
            By so much, independently.
        """
        moved = self.covariance + np.diag(variance)
        self.information = np.asarray(np.linalg.inv(moved), dtype=np.float64)
        self._covariance = None

    def pull(self, towards: FloatArray) -> None:
        """Let the prior's information, which is all there is yet, be about another point than `x`; while held.

        Parameters
        ----------
        towards : (K,) array
            Mean of the prior.
        """
        self._moment += self.information @ (towards - self.x)

    def lose(self, robots: IntArray | int) -> None:
        """Forget where robots are; their next sightings tell.

        Parameters
        ----------
        robots : int or (N,) array of int
            Numbers.
        """
        self.rows.before[robots, 7] = -1.0

    def release(self) -> FloatArray:
        """Take the step that was held back.

        Returns
        -------
        step : (K,) array
            Of the globals.
        """
        step = np.linalg.solve(self.information, self._moment)
        self.x = self.x + step
        self._moment = np.zeros_like(self.x)
        self._gate_covariance = None
        return np.asarray(step)

    def update(self, frame: Frame) -> Outcome:
        """Take the sightings of one frame.

        Parameters
        ----------
        frame : Frame
            Of different robots.

        Returns
        -------
        outcome : Outcome
            About the robots whose positions were known before.
        """
        robots = frame.robots
        self.rows.grow(int(robots.max()) + 1)
        known = self.rows.before[robots, 7] == frame.path[:, 7]
        if known.all():
            return self._follow(frame)
        self._enter(frame.take(np.flatnonzero(~known)))
        return self._follow(frame.take(np.flatnonzero(known)))

    def _enter(self, frame: Frame) -> None:
        """Put robots where they are seen: a flat prior, so that the globals learn nothing."""
        rows, K = self.rows, len(self.x)
        P = unproject(self.x[:6], frame.c)
        ground = np.isfinite(P).all(axis=1)
        if not ground.all():
            frame, P = frame.take(np.flatnonzero(ground)), P[ground]
        robots = frame.robots
        if len(robots) == 0:
            return
        _, by_g, by_point, _ = sighting_gradients(self.x[:6], P)
        back = inverse_2x2(by_point)
        if rows.width == 3:  # the bias stays known, and goes with the globals as before
            if not self.held:
                rows.mean[robots, 2] += (rows.slope[robots, 2] * (self.x - rows.at[robots])).sum(1)
            rows.S[robots, :2, 2] = rows.S[robots, 2, :2] = 0.0
            rows.S[robots, 2, 2] += rows.drift * frame.dt
        rows.mean[robots, :2] = P - frame.path[:, :2]
        rows.slope[robots, :2, :6] = -(back @ by_g)
        if K == 7:
            rows.slope[robots, :2, 6] = -rows.turned(robots, frame.path[:, 2:4])
        rows.S[robots, :2, :2] = frame.variance[:, None, None] * (back @ back.swapaxes(1, 2))
        rows.at[robots] = self.x
        rows.before[robots] = frame.path

    def _follow(self, frame: Frame) -> Outcome:
        """Predict robots by their readings and correct by their sightings."""
        rows, robots, path = self.rows, frame.robots, frame.path
        if len(robots) == 1 and rows.width == 2:
            return self._follow_one(frame)
        x, K = self.x, len(self.x)
        mean, slope, S = self._predict(frame)
        velocity = rows.turned(robots, path[:, 2:4])

        c, by_g, H, nearer = sighting_gradients(x[:6], mean[:, :2] + path[:, :2])
        r = frame.c - c
        A = H @ slope[:, :2]
        A[:, :, :6] += by_g
        if K == 7:
            A[:, :, 6] += (H @ velocity[:, :, None])[:, :, 0]
        SH = S[:, :, :2] @ H.swapaxes(1, 2)
        W = H @ SH[:, :2]
        W[:, 0, 0] += frame.variance
        W[:, 1, 1] += frame.variance
        At = A.swapaxes(1, 2)
        N = W + A @ self._gate() @ At
        nis = (r[:, None, :] @ inverse_2x2(N) @ r[:, :, None])[:, 0, 0]
        good = (nis < GATE) & (nearer > 0)
        weight = np.where(good, np.sqrt(np.minimum(1.0, HUBER / np.maximum(nis, SMALLEST))), 0.0)

        innovation, r = r, np.where(good[:, None], r, 0.0)
        V = inverse_2x2(W) * weight[:, None, None]
        AtV = At @ V
        score = (AtV @ r[:, :, None])[:, :, 0]
        self.information += (AtV @ A).sum(axis=0)
        self._covariance = None
        gain = SH @ V
        rows.mean[robots] = mean + (gain @ r[:, :, None])[:, :, 0]
        rows.slope[robots] = slope - gain @ A
        S -= gain @ SH.swapaxes(1, 2)
        rows.S[robots] = (S + S.swapaxes(1, 2)) * 0.5
        rows.before[robots] = path
        rows.at[robots] = x
        self._move(score.sum(axis=0))
        return Outcome(robots, nis, weight, score, AtV @ N @ AtV.swapaxes(1, 2), innovation)

    def _predict(self, frame: Frame) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Carry robots' states on to the sightings' times, given where the globals stand now."""
        rows, robots = self.rows, frame.robots
        mean, slope, S = rows.mean[robots], rows.slope[robots], rows.S[robots]
        if not self.held:
            mean = mean + (slope @ (self.x - rows.at[robots])[:, :, None])[:, :, 0]
        moved = frame.path - rows.before[robots]
        if rows.width == 3:
            # base = P - odometry moves, as the odometry turned back by the bias is what was driven.
            rows.mean[robots] = mean
            driven = rows.turned(robots, moved[:, :2])
            mean[:, :2] += driven - moved[:, :2]
            by_bias = np.stack([driven[:, 1], -driven[:, 0]], axis=1)
            slope[:, :2] += by_bias[:, :, None] * slope[:, 2:]
            S[:, :2] += by_bias[:, :, None] * S[:, 2:]
            S[:, :, :2] += S[:, :, 2:] * by_bias[:, None, :]
            S[:, 2, 2] += rows.drift * frame.dt
        S[:, 0, 0] += moved[:, 4]
        S[:, 0, 1] += moved[:, 5]
        S[:, 1, 0] += moved[:, 5]
        S[:, 1, 1] += moved[:, 6]
        return mean, slope, S

    def _follow_one(self, frame: Frame) -> Outcome:
        """Do the same for a single robot, where NumPy's calls on batches would cost more than the work."""
        one = follow_one(self.rows, self.x, frame, self._gate(), held=self.held)
        AtV, A = one.AtV, one.A
        self.information += AtV.dot(A)
        score = AtV.dot(one.r)
        if self.held:
            self._moment += score
        else:
            # Rank-two downdate: with the weight w, W / w + A C A' is what it has to be divided by.
            step = one.CA.dot(one.gain)
            self.x = self.x + step.dot(one.r)
            self._covariance = self.covariance - step.dot(one.CA.T)
            self._updates += 1
            if self._updates > FRESH:
                self._covariance = None
        spread = AtV.dot(one.N).dot(AtV.T)
        return Outcome(frame.robots, one.nis, one.weight, score[None], spread[None], one.innovation)

    def _move(self, score: FloatArray) -> None:
        if self.held:
            self._moment += score
        else:
            self.x = self.x + self.covariance @ score

    def _gate(self) -> FloatArray:
        """Covariance of the globals as the gate sees it."""
        return self.covariance if self._gate_covariance is None else self._gate_covariance
