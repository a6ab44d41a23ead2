"""Has the camera been moved? What all robots say together, against what each may get wrong by itself.

A camera that is knocked shows in two ways. Robots jump in the image, all at once, to where they go on consistently with
their readings. And the old g no longer explains the motion: the score, the gradient of the log-likelihood of the recent
innovations by the globals, leaves its distribution. The score sums up small errors that all point one way long before
single innovations stand out. Its sum over a window of driving time has a known covariance, so

    T = s' V^-1 s      is chi-square with as many degrees of freedom as globals, if the camera is where it was.

One robot that slips gives a large T too. So the robots that disagree most, a third of them and one at least, are left
out, and the rest must disagree as well; a robot alone has to be believed. What the readings' real noise makes of T in
usual times is learnt, and T is judged in its units.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.online_rows import Outcome
    from airground.calibration.recordings import IntArray
    from airground.geometry.arrays import FloatArray

__all__ = ["Bump", "BumpMonitor"]

WINDOWS_S = np.array([1.5, 6.0, 24.0])  # of driving: memories of the score
CHECK_S = 0.2  # between looks at jumps
TEST_S = 0.5  # between tests of the score
LIMIT = 65.0  # of T: chance 5e-12 with 6 degrees of freedom, for 22,000 looks an hour
TAIL = 35.0  # times its mean that chi-square with one degree of freedom exceeds by a chance of 3e-9
JUMP_S = 10.0  # memory of jumps
TOGETHER_S = 0.5  # jumps of several robots within it are one
ACTIVE_S = 1.0  # a robot counts as long after it was seen
LEVEL_S = 200.0  # memory of what T usually is
LEVEL_CAP = 4.0  # more is a bump not yet noticed
SLIP = 0.05  # deviation of the entries of E, over a short time
SLIP_S = 4.0  # for which it lasts
RIDGE = 1e-9
STILL = 1e-6  # m^2/s^2


@dataclass(frozen=True, slots=True)
class Bump:
    """The camera has moved."""

    t_s: float
    """From when on the data are of the new place, as far as can be told [s]."""

    noticed_s: float
    """When it was noticed [s]."""

    reason: str
    """What showed it: "jump" or "motion"."""


class BumpMonitor:
    """Windowed test of the innovations of all robots.

    Parameters
    ----------
    unknowns : int
        Globals, K.
    """

    def __init__(self, unknowns: int) -> None:
        count = len(WINDOWS_S)
        self._score = np.zeros((0, count, unknowns))
        self._spread = np.zeros((0, count, unknowns, unknowns))
        # What came in since the last test, not yet in the windows.
        self._new_score = np.zeros((0, unknowns))
        self._new_spread = np.zeros((0, unknowns, unknowns))
        self._driven = np.zeros(0)
        self._seen = np.zeros(0)
        self._checked = self._tested = -np.inf
        self._jumps: deque[tuple[float, int]] = deque()
        self._levels = np.ones(count)
        self.level = 1.0
        self._level_weight = 15.0  # s; how long the first guess counts

    @property
    def alone(self) -> bool:
        """Whether no more than one robot was seen of late."""
        return int(np.count_nonzero(self._seen > self._seen.max(initial=-np.inf) - ACTIVE_S)) <= 1

    def add(self, outcome: Outcome, dt: FloatArray, velocity: FloatArray, t: float) -> None:
        """Take what a frame said.

        Parameters
        ----------
        outcome : Outcome
            Of the filter.
        dt : (M,) array [s]
            Since each robot's last sighting.
        velocity : (M, 2) array [m/s]
            On the ground, as read.
        t : float [s]
            Time of the frame.
        """
        if len(outcome.robots) == 0:
            return
        highest = int(outcome.robots.max())
        if highest >= len(self._seen):
            self._grow(2 * highest + 8)
        if len(outcome.robots) == 1:
            vx, vy = velocity[0].tolist()
            self._new_score[highest] += outcome.score[0]
            self._new_spread[highest] += outcome.spread[0]
            self._seen[highest] = t
            if vx * vx + vy * vy > STILL:
                self._driven[highest] += dt[0]
            return
        k = outcome.robots
        self._new_score[k] += outcome.score
        self._new_spread[k] += outcome.spread
        self._seen[k] = t
        self._driven[k] += np.where((velocity * velocity).sum(axis=1) > STILL, dt, 0.0)

    def _grow(self, count: int) -> None:
        more = count - len(self._seen)
        for name in ("_score", "_spread", "_new_score", "_new_spread", "_driven", "_seen"):
            old = getattr(self, name)
            fill = -np.inf if name == "_seen" else 0.0
            setattr(self, name, np.concatenate([old, np.full((more, *old.shape[1:]), fill)]))

    def _fold(self) -> None:
        """Take what is new into the windows."""
        keep = np.exp(-self._driven[:, None] / WINDOWS_S)[:, :, None]
        self._score = keep * self._score + self._new_score[:, None]
        self._spread = (keep * keep)[:, :, :, None] * self._spread + self._new_spread[:, None]
        for new in (self._new_score, self._new_spread, self._driven):
            new[...] = 0.0

    def jumped(self, robot: int, t: float) -> None:
        """Note that a robot goes on elsewhere in the image, consistently.

        Parameters
        ----------
        robot : int
            Which.
        t : float [s]
            First time that it was there.
        """
        self._jumps.append((t, robot))

    def check(self, t: float, x: FloatArray) -> Bump | None:
        """Judge what came in so far.

        Parameters
        ----------
        t : float [s]
            Now.
        x : (K,) array
            The globals.

        Returns
        -------
        bump : Bump or None
            None while the camera seems to be where it was, and between looks.
        """
        if t - self._checked < CHECK_S:
            return None
        self._checked = t
        while self._jumps and self._jumps[0][0] < t - JUMP_S:
            self._jumps.popleft()
        active = np.flatnonzero(self._seen > t - ACTIVE_S)
        if len(active) == 0:
            return None
        when = self._common_jump(len(active))
        if when is not None:
            return Bump(when, t, "jump")
        if t - self._tested < TEST_S:
            return None
        elapsed = min(t - self._tested, 1.0)
        self._tested = t
        self._fold()
        T = self._statistic(active, x)
        K = self._score.shape[2]
        # Noise beyond the model's is mostly along one direction, where its square scatters much more than a sum's.
        found = np.flatnonzero(LIMIT + TAIL * K * (self._levels - 1.0) < T)
        if len(found):
            return Bump(t - float(WINDOWS_S[found[0]]), t, "motion")
        self._level_weight = min(self._level_weight + elapsed, LEVEL_S)
        share = elapsed / self._level_weight
        self._levels += (np.minimum(T / K, LEVEL_CAP) - self._levels) * share
        np.maximum(self._levels, 1.0, out=self._levels)
        plain = _squares(self._score[active, 1].sum(axis=0), self._spread[active, 1].sum(axis=0))
        self.level = max(1.0, self.level + (float(plain) / K - self.level) * share)
        return None

    def _common_jump(self, active: int) -> float | None:
        """First time of a jump that two thirds of the robots made together."""
        if active < 2:
            return None
        needed = max(2, -(-2 * active // 3))
        for start, _ in self._jumps:
            together = {robot for t, robot in self._jumps if 0 <= t - start <= TOGETHER_S}
            if len(together) >= needed:
                return start
        return None

    def _statistic(self, active: IntArray, x: FloatArray) -> FloatArray:
        """(W,). T of the robots that disagree least, in each window."""
        score, spread = self._score[active].swapaxes(0, 1), self._spread[active].swapaxes(0, 1)
        # The weights of a long exponential window sum to twice their squares, so its information is 2 V; a change dx of
        # the globals moves the score by that times dx.
        slipped = 2 * (spread @ _slips(x))
        sigma = SLIP / np.sqrt(1 + WINDOWS_S / SLIP_S)
        spread = spread + (sigma * sigma)[:, None, None, None] * (
            slipped @ slipped.swapaxes(-1, -2)
        )
        if len(active) > 1:
            out = max(1, len(active) // 3)
            # Leaving out the worst of good ones only lowers the sum.
            kept = np.argsort(_squares(score, spread), axis=1)[:, : len(active) - out]
            score = np.take_along_axis(score, kept[:, :, None], axis=1)
            spread = np.take_along_axis(spread, kept[:, :, None, None], axis=1)
        return _squares(score.sum(axis=1), spread.sum(axis=1))


def _slips(x: FloatArray) -> FloatArray:
    """(K, 4). How the globals would have to change to explain readings that slip or turn: dg = g E.

    The scale that keeps the determinant is left out: it only changes the sizes.
    """
    g = x[:6].reshape(3, 2)
    slips = np.zeros((len(x), 4))
    for k in range(4):
        E = np.zeros((2, 2))
        E.flat[k] = 1.0
        slips[:6, k] = (g @ E - g * (k in (0, 3)) / 3).ravel()  # det(G) stays one (eq. 21)
    return slips


def _squares(score: FloatArray, spread: FloatArray) -> FloatArray:
    """Give s' V^-1 s; directions without information count nothing."""
    size = np.sqrt(np.maximum(np.diagonal(spread, axis1=-2, axis2=-1), 1e-300))
    unit = spread / (size[..., :, None] * size[..., None, :])
    unit = unit + RIDGE * np.eye(score.shape[-1])
    s = score / size
    return np.asarray((s * np.linalg.solve(unit, s[..., None])[..., 0]).sum(axis=-1))
