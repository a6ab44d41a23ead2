"""Which fragments may be which robot, at which offset of the clocks: cheaply, for hundreds of fragments at once.

Eq. 15 is linear in the ground velocity and quadratic in the place::

    uv_dot = (A0 + a A1 + b A2 + a^2 A3 + ab A4 + b^2 A5) w,      (a, b) the place over the extent of all tracks

With a normal prior on the entries, as if they were free, the evidence of a set of fragments is known in closed form
(Bayesian linear regression): it pays for what is fitted, and products add up over fragments, so that pieces that say
too little alone are put together. What is at rest when the robot drives, or turns when it does not, falls out here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.identify_windows import Fragment, RobotMotion
    from airground.geometry.arrays import FloatArray

__all__ = ["Seed", "find_seeds"]

LEVEL = 0.1
"""Noise over speed; generous, as the offset is on a coarse grid."""

BROAD = 3.0
"""Deviation of A0, over the usual speed in the image by that on the ground."""

PERSPECTIVE = 0.35
"""Deviation of A1 and A2, over that of A0."""

BEND = 0.1
"""Deviation of A3 to A5, over that of A0."""

MEMORY_S = 1.2
"""Here a velocity is a new one after this time at the latest: these are proposals, to be judged later."""

FEWEST = 6
"""Windows with readings that a fragment needs to be a start."""

STARTS = 10
"""Fragments from which sets are grown, by evidence, and as many more by how long they move."""

LAGS = 3
"""Best offsets of each of these."""

KEPT = 8
"""Sets of each robot that are looked at closely."""

HANDOVER_S = 0.5
"""Two fragments of one robot may overlap by so much: a tracker lets go of the old one late."""


@dataclass(frozen=True, slots=True, eq=False)
class Seed:
    """A set of fragments that may be one robot."""

    robot: int
    """Which robot."""

    members: tuple[int, ...]
    """Which fragments."""

    lag: float
    """[s] to be added to times of the tracks."""

    evidence: float
    """Logarithm of the likelihood ratio to vehicles that nobody knows."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """Products of one robot and all fragments; F fragments, G offsets."""

    normal: FloatArray
    """(F, G, 12, 12)."""

    right: FloatArray
    """(F, G, 12, 2)."""

    rest: FloatArray
    """(F, G). What does not depend on the entries, less the evidence of vehicles on their own."""

    count: FloatArray
    """(F, G). Windows with readings."""

    prior: FloatArray
    """(12,). Inverse variances."""

    def evidence(self, normal: FloatArray, right: FloatArray, rest: FloatArray) -> FloatArray:
        """(...). Log likelihood ratio of sets with these sums."""
        full = normal + np.diag(self.prior)
        solved = np.linalg.solve(full, right)
        gain = 0.5 * np.sum(right * solved, axis=(-1, -2))
        paid = np.linalg.slogdet(full)[1] - np.sum(np.log(self.prior))
        return np.asarray(gain - paid + rest)


def find_seeds(
    parts: list[Fragment], robot: RobotMotion, number: int, lags: FloatArray
) -> list[Seed]:
    """Sets of fragments that may be a robot, the likeliest first.

    Parameters
    ----------
    parts : list of Fragment
        All fragments.
    robot : RobotMotion
        Its ground velocity.
    number : int
        Which robot it is.
    lags : (G,) array [s]
        Offsets of the clocks to try.

    Returns
    -------
    seeds : list of Seed
        At most `KEPT`.
    """
    moving = [k for k, part in enumerate(parts) if part.moves]
    if not moving or robot.usual == 0:
        return []
    sums = _sums([parts[k] for k in moving], robot, lags)
    alone = sums.evidence(sums.normal, sums.right, sums.rest)
    alone[sums.count < FEWEST] = -np.inf
    first = np.array([parts[k].first_s for k in moving])
    last = np.array([parts[k].last_s for k in moving])
    best = alone.max(axis=1)
    way = np.array([len(parts[k].t) for k in moving])
    starts = list(
        dict.fromkeys([*np.argsort(-best)[:STARTS].tolist(), *np.argsort(-way)[:STARTS].tolist()])
    )
    entry = float(np.log(len(moving)) + 2)
    found: dict[tuple[int, ...], Seed] = {}
    for start in starts:
        for lag in _peaks(alone[start])[:LAGS]:
            members, evidence = _grown(sums, start, lag, first=first, last=last, entry=entry)
            names = tuple(sorted(moving[k] for k in members))
            if names not in found or found[names].evidence < evidence:
                found[names] = Seed(number, names, float(lags[lag]), evidence)
    return sorted(found.values(), key=lambda s: -s.evidence)[:KEPT]


def _sums(parts: list[Fragment], robot: RobotMotion, lags: FloatArray) -> _Sums:
    places = np.concatenate([part.uv for part in parts])
    middle = places.mean(axis=0)
    extent = max(float(np.sqrt(np.mean((places - middle) ** 2))), 1e-9)
    scale = BROAD * float(np.median([part.usual for part in parts])) / robot.usual
    deviation = scale * np.array([1, 1, *[PERSPECTIVE] * 4, *[BEND] * 6])
    shape = (len(parts), len(lags))
    normal, right, rest = np.zeros((*shape, 12, 12)), np.zeros((*shape, 12, 2)), np.zeros(shape)
    count = np.zeros(shape)
    for k, part in enumerate(parts):
        w = robot.at(part.t + lags[:, None])  # (G, K, 2)
        known = np.asarray(np.isfinite(w).all(axis=-1))
        w = np.where(known[..., None], w, 0.0)
        a, b = ((part.uv - middle) / extent).T
        monomials = np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=-1)
        X = (monomials[:, :, None] * w[:, :, None, :]).reshape(*w.shape[:2], 12)
        sigma = part.noise(LEVEL)
        share = _share(part, robot)
        weight = known * (share / sigma**2)  # (G, K)
        WX = weight[..., None] * X
        normal[k] = WX.swapaxes(1, 2) @ X
        right[k] = WX.swapaxes(1, 2) @ part.uv_dot
        density = (
            -np.log(2 * np.pi * sigma**2)
            - 0.5 * np.sum(part.uv_dot**2, axis=1) / sigma**2
            - part.alone
        )
        rest[k] = known @ (share * density)
        count[k] = known.sum(axis=1)
    return _Sums(normal, right, rest, count, 1 / deviation**2)


def _share(part: Fragment, robot: RobotMotion) -> float:
    """What a window counts."""
    return min(1.0, part.step / min(robot.memory_s, MEMORY_S))


def _peaks(values: FloatArray) -> list[int]:
    """Local maxima, the highest first."""
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    peak = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))
    return [int(k) for k in peak[np.argsort(-values[peak])] if np.isfinite(values[k])]


def _grown(
    sums: _Sums, start: int, lag: int, *, first: FloatArray, last: FloatArray, entry: float
) -> tuple[list[int], float]:
    """The start, and what adds to its evidence one after the other."""
    members = [start]
    normal, right, rest = sums.normal[start, lag], sums.right[start, lag], sums.rest[start, lag]
    evidence = float(sums.evidence(normal, right, rest))
    while True:
        free = np.ones(len(first), dtype=bool)
        for k in members:
            free &= np.minimum(last, last[k]) - np.maximum(first, first[k]) < HANDOVER_S
        others = np.flatnonzero(free)
        others = others[~np.isin(others, members)]
        if len(others) == 0:
            break
        union = sums.evidence(
            normal + sums.normal[others, lag],
            right + sums.right[others, lag],
            rest + sums.rest[others, lag],
        )
        best = int(np.argmax(union))
        if union[best] < evidence + entry:
            break
        k = int(others[best])
        members.append(k)
        evidence = float(union[best])
        normal, right, rest = (
            normal + sums.normal[k, lag],
            right + sums.right[k, lag],
            rest + sums.rest[k, lag],
        )
    return members, evidence
