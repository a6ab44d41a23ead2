"""How motion on the ground looks in the image, near a place: a 2x2 map, learned from the drive so far.

    uv_dot = M xy_dot,    M = (sum of w uv_dot xy_dot') (sum of w xy_dot xy_dot')^-1

with the weight w falling with the distance in the image. It knows no horizon and no perspective beyond those weights;
it is for the time before there is a calibration, when a robot must not leave the image.
"""

from __future__ import annotations

from math import atan2, cos, hypot, sin, sqrt
from typing import NamedTuple

import numpy as np

from airground.geometry.arrays import FloatArray

__all__ = ["LocalMap"]

Pair = tuple[float, float]

BINS = 128  # places that are remembered
BIN_PX = 25.0  # the extent of one
NEAR_PX = 150.0  # of the weights
FAR_WEIGHT = 0.02  # what was seen anywhere tells something
SLOW_MPS = 0.04  # below, noise tells more than the motion
TURNING_RADPS = 0.3  # above, a mark beside the axle moves by the turn
ENOUGH = 0.15  # [m2/s2] per picture: 7 of them at 0.15 m/s
FLAT = 0.06  # of the larger eigenvalue: below, one heading is all that is known
LARGEST = 1e6  # of anything that is believed
ALIGNED = 0.94  # cosine of the angle within which a direction counts as driven


class _Local(NamedTuple):
    """What is known at a place."""

    rank: int
    M: tuple[float, float, float, float]
    along: Pair
    """Unit vector on the ground that is known best."""


UNKNOWN = _Local(0, (0.0, 0.0, 0.0, 0.0), (1.0, 0.0))


class LocalMap:
    """What a robot's own motion has told of the image."""

    def __init__(self) -> None:
        # u, v, xx, xy, yy, ux, uy, vx, vy
        self._bins = np.zeros((BINS, 9))
        self._count = self._next = 0
        self._bin: list[float] | None = None
        self._frames = 0
        self._answer: tuple[float, float, int, _Local] | None = None

    def take(
        self, uv: Pair, uv_dot: Pair, heading_rad: float, speed_mps: float, turn_radps: float = 0.0
    ) -> None:
        """Learn from one picture.

        Parameters
        ----------
        uv : (float, float) [px]
            Where the mark is.
        uv_dot : (float, float) [px/s]
            How it moves.
        heading_rad : float [rad]
            By compass.
        speed_mps : float [m/s]
            By odometer; negative in reverse. Nothing is learned from a robot that hardly moves.
        turn_radps : float [rad/s]
            Of the heading. Nothing is learned from one that turns.
        """
        told = (*uv, *uv_dot, heading_rad, speed_mps, turn_radps)
        if not all(abs(one) < LARGEST for one in told):  # NaN compares as False
            return
        if abs(speed_mps) < SLOW_MPS or abs(turn_radps) > TURNING_RADPS:
            return
        x, y = speed_mps * cos(heading_rad), speed_mps * sin(heading_rad)
        a, b = uv_dot
        new = (x * x, x * y, y * y, a * x, a * y, b * x, b * y)
        if self._bin is None or hypot(uv[0] - self._bin[0], uv[1] - self._bin[1]) > BIN_PX:
            self._bin = [*uv, *new]
            self._next = self._count % BINS
            self._count += 1
        else:
            for k, value in enumerate(new, 2):
                self._bin[k] += value
        self._bins[self._next] = self._bin
        self._frames += 1

    def rank(self, uv: Pair) -> int:
        """How many directions on the ground are known.

        Parameters
        ----------
        uv : (float, float) [px]
            Near which place.

        Returns
        -------
        rank : int
            0 to 2.
        """
        return self._at(uv).rank

    def matrix(self, uv: Pair) -> FloatArray | None:
        """The map itself.

        Parameters
        ----------
        uv : (float, float) [px]
            Near which place.

        Returns
        -------
        M : (2, 2) array or None [px/m]
            None where less than two directions are known.
        """
        found = self._at(uv)
        return np.array(found.M).reshape(2, 2) if found.rank == 2 else None

    def px_per_m(self, uv: Pair, heading_rad: float) -> Pair | None:
        """What a metre along a heading is in the image.

        Parameters
        ----------
        uv : (float, float) [px]
            Near which place.
        heading_rad : float [rad]
            By compass.

        Returns
        -------
        step : (float, float) or None [px/m]
            None where nobody has driven along that heading, nor along two others.
        """
        found = self._at(uv)
        c, s = cos(heading_rad), sin(heading_rad)
        if found.rank == 1:
            share = c * found.along[0] + s * found.along[1]
            if abs(share) < ALIGNED:
                return None
        elif found.rank == 0:
            return None
        a, b, d, e = found.M
        return (a * c + b * s, d * c + e * s)

    def guesses(self, uv: Pair) -> tuple[tuple[float, float, float, float], ...]:
        """Maps that may be, row by row.

        Parameters
        ----------
        uv : (float, float) [px]
            Near which place.

        Returns
        -------
        maps : tuple of (float, float, float, float) [px/m]
            One where two directions are known. Where one is, both maps that turn and scale only: headings may count
            either way round. None where nothing is known.
        """
        found = self._at(uv)
        if found.rank == 2:
            return (found.M,)
        if found.rank == 0:
            return ()
        (x, y), (a, b, d, e) = found.along, found.M
        p, q = a * x + b * y, d * x + e * y  # image of the known direction
        # Across it, the same length at a right angle, either way.
        return tuple(
            (p * x + k * q * y, p * y - k * q * x, q * x - k * p * y, q * y + k * p * x)
            for k in (1.0, -1.0)
        )

    @property
    def clockwise(self) -> bool | None:
        """Whether headings grow clockwise as seen in the image; None where that is not known."""
        if self._bin is None:
            return None
        found = self._at((self._bin[0], self._bin[1]))
        if found.rank < 2:
            return None
        a, b, d, e = found.M
        return a * e - b * d > 0

    def inward(self, uv: Pair, image_size_px: tuple[int, int]) -> float | None:
        """Heading that leads to the image's middle.

        Parameters
        ----------
        uv : (float, float) [px]
            From where.
        image_size_px : (int, int) [px]
            Width and height.

        Returns
        -------
        heading : float or None [rad]
            By compass; where one direction is known only, the one of both ways along it that leads nearer.
        """
        found = self._at(uv)
        to = ((image_size_px[0] - 1) / 2 - uv[0], (image_size_px[1] - 1) / 2 - uv[1])
        a, b, d, e = found.M
        if found.rank == 2:
            det = a * e - b * d
            if abs(det) < 1e-9 * (a * a + b * b + d * d + e * e):
                return None
            x, y = (e * to[0] - b * to[1]) / det, (a * to[1] - d * to[0]) / det
            return atan2(y, x)
        if found.rank == 1:
            x, y = found.along
            nearer = (a * x + b * y) * to[0] + (d * x + e * y) * to[1] >= 0
            return atan2(y, x) if nearer else atan2(-y, -x)
        return None

    def _at(self, uv: Pair) -> _Local:
        if self._count == 0 or not (abs(uv[0]) < LARGEST and abs(uv[1]) < LARGEST):
            return UNKNOWN
        answer = self._answer
        if answer is not None and answer[:3] == (*uv, self._frames):
            return answer[3]
        rows = self._bins[: min(self._count, BINS)]
        du, dv = rows[:, 0] - uv[0], rows[:, 1] - uv[1]
        far = du * du + dv * dv
        # The nearest place counts in full, as far as it may be: a poor map is better than none.
        weight = np.exp((far - far.min()) * (-0.5 / NEAR_PX**2)) + FAR_WEIGHT
        found = _solved((weight @ rows[:, 2:]).tolist())
        self._answer = (*uv, self._frames, found)
        return found


def _solved(sums: list[float]) -> _Local:
    xx, xy, yy, ux, uy, vx, vy = sums
    middle, spread = (xx + yy) / 2, hypot((xx - yy) / 2, xy)
    most, least = middle + spread, middle - spread
    if not most >= ENOUGH:
        return UNKNOWN
    angle = atan2(2 * xy, xx - yy) / 2
    c, s = cos(angle), sin(angle)
    if least < FLAT * most or least < 0.25 * ENOUGH:
        # Only what is along the known direction.
        p, q = (ux * c + uy * s) / most, (vx * c + vy * s) / most
        return _Local(1, (p * c, p * s, q * c, q * s), (c, s))
    det = xx * yy - xy * xy
    M = (
        (ux * yy - uy * xy) / det,
        (uy * xx - ux * xy) / det,
        (vx * yy - vy * xy) / det,
        (vy * xx - vx * xy) / det,
    )
    if not sqrt(sum(one * one for one in M)) > 0:
        return UNKNOWN
    return _Local(2, M, (c, s))
