"""Fragments that say little by themselves, but go on where a robot's others end.

A robot at rest, or a second of straight driving, tells nothing by its motion. Its place does: it is where the robot
must be then, given where it was seen before or after and how it moved in between.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.identify_chain import HANDOVER_S, Span
from airground.calibration.identify_judge import turned

if TYPE_CHECKING:
    from airground.calibration.identify_solution import Scene, Solution

__all__ = ["adjoined"]

GAP_S = 1.5
"""Between two fragments, at most."""

PLACE_PX, PLACE_SHARE = 4.0, 0.15
"""How far off its place may be: so much, and so much of the way in between."""

LEVEL, WITHIN, MOST = 0.15, 3.0, 0.8
"""Its velocities must follow the readings: to so much of the speed, within so many deviations, most of them."""

SLOW = 0.1
"""Of the usual speed in the image, which the noise does not fall below."""


def adjoined(scene: Scene, solution: Solution, robot: int, taken: set[int]) -> list[Span]:
    """Fragments that go on where a robot's spans end.

    Parameters
    ----------
    scene : Scene
        Fragments and robots.
    solution : Solution
        The answer.
    robot : int
        Which robot.
    taken : set of int
        Fragments that are spoken for.

    Returns
    -------
    spans : list of Span
        Whole fragments, without gain; none where two compete for a place.
    """
    chain = sorted(solution.of(robot), key=lambda s: s.first_s)
    added: list[Span] = []
    while True:
        new = _next(scene, solution, chain, taken)
        if new is None:
            return added
        taken = taken | {new.part}
        added.append(new)
        chain = sorted([*chain, new], key=lambda s: s.first_s)


def _next(scene: Scene, solution: Solution, chain: list[Span], taken: set[int]) -> Span | None:
    for j, span in enumerate(chain):
        for after in (False, True):
            other = chain[j + 1] if after and j + 1 < len(chain) else None
            other = chain[j - 1] if not after and j else other
            fits = []
            for k, part in enumerate(scene.parts):
                if k in taken or not len(part.t):
                    continue
                gap = part.first_s - span.last_s if after else span.first_s - part.last_s
                if not -HANDOVER_S < gap < GAP_S:
                    continue
                if other is not None:
                    free = other.first_s - part.last_s if after else part.first_s - other.last_s
                    if free < -HANDOVER_S:
                        continue
                if _goes_on(scene, solution, span, k, after=after):
                    fits.append(k)
            if len(fits) == 1:
                part = scene.parts[fits[0]]
                return Span(
                    span.robot, fits[0], 0, len(part.t), part.first_s, part.last_s, 0.0, 0.0
                )
    return None


def _goes_on(scene: Scene, solution: Solution, span: Span, k: int, *, after: bool) -> bool:
    """Whether a fragment begins (or ends) where the robot must be, and moves as it does."""
    part, own, robot = scene.parts[k], scene.parts[span.part], scene.robots[span.robot]
    at, its = (span.last_s, part.first_s) if after else (span.first_s, part.last_s)
    here, there = (own.ends[1], part.ends[0]) if after else (own.ends[0], part.ends[1])
    if (
        span.stop < len(own.t) if after else span.first > 0
    ):  # the span ends in the fragment's middle
        here = own.uv[span.stop - 1 if after else span.first]
        at = float(own.t[span.stop - 1 if after else span.first])
    turn = float(solution.turns[span.robot])
    way = robot.way(at + solution.lag, its + solution.lag)
    if way is None:
        return False
    with np.errstate(divide="ignore", invalid="ignore"):  # beyond the horizon
        place = solution.model.image_position(turned(way, turn), here)
    off = float(np.linalg.norm(there - place))
    if not off < PLACE_PX + PLACE_SHARE * float(np.linalg.norm(place - here)):
        return False
    w = turned(robot.at(part.t + solution.lag), turn)
    read = solution.model.image_velocity(part.uv, w)
    size = np.maximum(np.linalg.norm(read, axis=1), SLOW * own.usual)
    sigma = np.hypot(part.gain, LEVEL * size)
    good = np.linalg.norm(part.uv_dot - read, axis=1) < WITHIN * sigma
    return bool(np.mean(good[np.isfinite(w).all(axis=1)]) > MOST) if len(good) else False
