"""Through image points at given times, with a continuous acceleration."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray, readonly

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.control.floor import Floor

__all__ = ["SplineTrajectory", "times_at_speed"]


@dataclass(frozen=True, slots=True, eq=False)
class SplineTrajectory:
    """A cubic spline in the image: from rest to rest, or round for ever where it is closed.

    Its points are passed at their times, so that uneven times make it swing: `times_at_speed` gives even ones.
    """

    uv: FloatArray
    """(N, 2) [px]. Points; of a closed one, the first is not repeated."""

    times_s: FloatArray
    """(N,) [s]. When it is there, from 0 on and rising; of a closed one (N + 1,), the last when it is back."""

    closed: bool = False
    """Whether it comes back to its first point and goes on for ever."""

    _knots: tuple[float, ...] = field(init=False, repr=False)
    """Times [s]."""

    _pieces: tuple[tuple[float, ...], ...] = field(init=False, repr=False)
    """Of each piece, the polynomial of u, then that of v, from the cube down."""

    def __post_init__(self) -> None:
        uv = readonly(self.uv, (None, 2), "uv")
        times = readonly(self.times_s, (len(uv) + self.closed,), "times_s")
        if len(uv) < 2 + self.closed:
            raise InputError(f"uv has {len(uv)} points, expected {2 + self.closed} or more")
        if times[0] != 0 or not (np.diff(times) > 0).all():
            raise InputError("times_s must begin with 0 and rise")
        knots = np.vstack([uv, uv[:1]]) if self.closed else uv
        pieces = _pieces(np.diff(times), knots, closed=self.closed)
        object.__setattr__(self, "uv", uv)
        object.__setattr__(self, "times_s", times)
        object.__setattr__(self, "_knots", tuple(times.tolist()))
        object.__setattr__(self, "_pieces", tuple(map(tuple, pieces.tolist())))

    @property
    def duration(self) -> float:
        """Of the motion [s]; infinite where it goes round."""
        return inf if self.closed else self._knots[-1]

    @property
    def period(self) -> float:
        """After which it repeats [s]; infinite where it does not."""
        return self._knots[-1] if self.closed else inf

    def at(self, t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Where it is.

        Parameters
        ----------
        t : float [s]
            Since its start.

        Returns
        -------
        uv : (2,) array [px]
            Point; before and after the motion, its ends.
        uv_dot : (2,) array [px/s]
            Its velocity; zero before and after the motion.
        uv_ddot : (2,) array [px/s^2]
            Its acceleration; zero before and after the motion.
        """
        inside = self.closed or 0 <= t <= self._knots[-1]
        t = t % self._knots[-1] if self.closed else min(max(t, 0.0), self._knots[-1])
        k = min(max(bisect_right(self._knots, t) - 1, 0), len(self._pieces) - 1)
        s = t - self._knots[k]
        a3, a2, a1, a0, b3, b2, b1, b0 = self._pieces[k]
        uv = np.array([((a3 * s + a2) * s + a1) * s + a0, ((b3 * s + b2) * s + b1) * s + b0])
        if not inside:
            return uv, np.zeros(2), np.zeros(2)
        uv_dot = np.array([(3 * a3 * s + 2 * a2) * s + a1, (3 * b3 * s + 2 * b2) * s + b1])
        return uv, uv_dot, np.array([6 * a3 * s + 2 * a2, 6 * b3 * s + 2 * b2])


def _pieces(h: FloatArray, knots: FloatArray, *, closed: bool) -> FloatArray:
    """Cubics from slopes m that make the second derivative continuous: each is an equation in three of them.

    ``h_k m_(k-1) + 2 (h_(k-1) + h_k) m_k + h_(k-1) m_(k+1) = 3 (h_k d_(k-1) + h_(k-1) d_k)``, d the chords' slopes.
    """
    count = len(h)
    d = np.diff(knots, axis=0) / h[:, None]
    A, b = np.eye(count + 1), np.zeros((count + 1, 2))
    for k in range(0 if closed else 1, count):  # at rest, the slopes of the ends are zero
        before, after = h[k - 1], h[k]
        A[k, k] = 2 * (before + after)
        A[k, (k - 1) % count] += after
        A[k, k + 1 if k + 1 < count or not closed else 0] += before
        b[k] = 3 * (after * d[k - 1] + before * d[k])
    m = np.linalg.solve(A, b)
    if closed:
        m[-1] = m[0]
    span = h[:, None]
    cube = (m[:-1] + m[1:] - 2 * d) / span**2
    square = (3 * d - 2 * m[:-1] - m[1:]) / span
    rows = np.stack([cube, square, m[:-1], knots[:-1]], axis=-1)  # (pieces, 2, 4)
    return rows.reshape(count, 8)


def times_at_speed(
    floor: Floor, uv: ArrayLike, speed_mps: float, *, closed: bool = False
) -> FloatArray:
    """When to be at image points, so that the ground is driven at about one speed.

    Parameters
    ----------
    floor : Floor
        What is known of image and ground.
    uv : (N, 2) array_like [px]
        Points on the ground, no two running alike.
    speed_mps : float [m/s]
        Mean speed; between rest and rest it is a half more in the middle.
    closed : bool
        Whether it comes back to the first point.

    Returns
    -------
    times_s : (N,) or (N + 1,) array [s]
        For `SplineTrajectory`.

    Raises
    ------
    InputError
        If a point is not visible ground, two running are one, or the speed is not positive.
    """
    points = readonly(uv, (None, 2), "uv")
    if not 0 < speed_mps < inf:
        raise InputError(f"speed_mps must be positive, not {speed_mps}")
    ends = np.roll(points, -1, axis=0) if closed else points[1:]
    legs = floor.distance(points[: len(ends)], ends)
    if not (legs > 0).all():
        bad = int(np.flatnonzero(~(legs > 0))[0])
        raise InputError(
            f"uv: points {bad} and {bad + 1} are one, or not on visible ground: leave one out"
        )
    return np.concatenate([[0.0], np.cumsum(legs / speed_mps)])
