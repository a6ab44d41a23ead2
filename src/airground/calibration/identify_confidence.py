"""How sure an answer is: against chance, against other answers, and against vehicles that drive alike.

Two things count for an answer that competes. By coincidence another fragment may follow the readings: the likelihoods
say how likely that is. Or it follows because it drives with the robot, in a convoy; then that it follows is no
coincidence, and only that it follows less well than a robot should speaks against it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.identify_evidence import (
    RELATIVE,
    follows,
    level_prior,
)
from airground.calibration.identify_judge import SWITCH, followed, residual
from airground.calibration.identify_solution import without

if TYPE_CHECKING:
    from airground.calibration.identify_chain import Span
    from airground.calibration.identify_solution import Scene, Solution
    from airground.calibration.identify_windows import Fragment
    from airground.geometry.arrays import FloatArray

__all__ = ["Odds", "Rival", "evidence_for", "odds_of", "rivals"]

TEMPER = 0.5
"""Of log likelihood ratios: slip, drift and a bent lens make neighbouring residuals tell less than they seem to."""

CONVOY = 2.0
"""Log likelihood ratio, tempered, from which on a fragment is thought to drive with the robot."""

CONVOY_LEVEL = 1.7
"""How much more the noise counts here than in the choice of its level: that of one robot is one."""

MOST_OF_IT = 0.7
"""Share of the time beside a span over which a rival should follow."""

ROBOT_LEVEL, ROBOT_FACTOR = 0.055, 1.6
"""Median of the level that most windows of a robot are within, and its scatter, a factor: real cars 0.02 to 0.07."""

ALIKE_SHARE = 0.1
"""Share of moving things that drive as the robot does, roughly."""

ALIKE_LEVEL, COINCIDENCES = 0.6, 3
"""How far off these are at most, and how many coincidences make them less so: of speed, of size, of phase."""

MOST_FIT = 0.85
"""Share of the windows that must be within a level of noise: what drives alike fits in most, but not in nearly all."""

JOINT = 6.0
"""Score from which on the other robots fix g and the clocks by themselves."""

LAG_STEP = 0.1
"""Between offsets that are tried for a rival [s]."""

CLOSE_PX = 4.0
"""Two tracks that stay within this are two of one thing."""

OVERLAP = 0.3
"""Share of a span over which a rival must be seen beside it."""


@dataclass(frozen=True, slots=True)
class Rival:
    """A fragment that may be the robot instead."""

    part: int
    """Which fragment."""

    span: int
    """Beside which of the robot's spans, by number."""

    log_odds: float
    """That it, not the span, is the robot."""


@dataclass(frozen=True, slots=True)
class Odds:
    """How sure it is which fragments are a robot."""

    confidence: float
    """Probability that they are."""

    chance: float
    """Log odds against chance."""

    against: float
    """Log odds against the best other answer; infinite where there is none."""

    rival: int
    """The fragment of that answer; -1 where there is none."""


def evidence_for(scene: Scene, solution: Solution, robot: int) -> float:
    """What speaks for a robot's spans: how much worse the answer is without them.

    Parameters
    ----------
    scene : Scene
        Fragments and robots.
    solution : Solution
        The answer.
    robot : int
        Which robot.

    Returns
    -------
    evidence : float
        Log likelihood ratio, all paid for.
    """
    return solution.score(scene) - max(0.0, without(solution, robot).score(scene))


def rivals(scene: Scene, solution: Solution, robot: int) -> list[Rival]:
    """Fragments beside a robot's that follow its readings too.

    Parameters
    ----------
    scene : Scene
        Fragments and robots.
    solution : Solution
        The answer.
    robot : int
        Which robot.

    Returns
    -------
    rivals : list of Rival
        One for each span and fragment, where it could be.
    """
    mine = solution.of(robot)
    fixed = without(solution, robot).score(scene) > JOINT
    found = []
    for k, part in enumerate(scene.parts):
        if not part.moves or len(part.t) < 3:
            continue
        beside = [j for j, span in enumerate(mine) if span.part != k and _beside(scene, span, k)]
        if not beside:
            continue
        taken = any(s.part == k and s.robot != robot for s in solution.spans)
        spans, level = _as_robot(scene, solution, robot, k, fixed=fixed or taken)
        for j in beside:
            with_it = [s for s in spans if _common(s, mine[j]) > 0]
            if not with_it:
                continue
            its = max(with_it, key=lambda s: s.gain)
            seen = min(part.last_s, mine[j].last_s) - max(part.first_s, mine[j].first_s)
            paid = SWITCH * (
                1 if fixed or taken else 2
            )  # for its own zero of headings, its own offset
            if _common(its, mine[j]) < MOST_OF_IT * seen:
                paid += (
                    SWITCH / TEMPER
                )  # then the robot's own track would have to change in its middle
            own = _level(scene, solution, mine[j])
            worse = CONVOY_LEVEL * (float(level_prior(level)) - float(level_prior(own)))
            alike = min(0.0, TEMPER * (its.gain - scene.entry - paid) - CONVOY) + min(0.0, worse)
            found.append(Rival(k, j, alike))
    return found + _claims(scene, solution, robot)


def _claims(scene: Scene, solution: Solution, robot: int) -> list[Rival]:
    """Other robots, seen nowhere else at that time, whose readings a span follows too."""
    found = []
    for j, span in enumerate(solution.of(robot)):
        for r, other in enumerate(scene.robots):
            elsewhere = any(_common(s, span) > 0 for s in solution.of(r))
            if r == robot or elsewhere or other.usual == 0:
                continue
            spans, _ = _as_robot(scene, solution, r, span.part, fixed=True)
            gain = max((s.gain for s in spans if _common(s, span) > 0), default=-np.inf)
            if np.isfinite(gain):
                found.append(Rival(span.part, j, min(0.0, TEMPER * (gain - span.gain))))
    return found


def odds_of(
    scene: Scene,
    solution: Solution,
    robot: int,
    others: list[Solution],
    beside: list[Rival],
) -> Odds:
    """How sure a robot's spans are.

    Parameters
    ----------
    scene : Scene
        Fragments and robots.
    solution : Solution
        The answer.
    robot : int
        Which robot.
    others : list of Solution
        Other answers.
    beside : list of Rival
        Rivals of the spans that are in the answer.

    Returns
    -------
    odds : Odds
        With the best competitor.
    """
    chance = min(TEMPER * evidence_for(scene, solution, robot), _not_alike(scene, solution, robot))
    competing: dict[int, float] = {}
    for rival in beside:
        competing[rival.part] = max(competing.get(rival.part, -np.inf), rival.log_odds)
    score = solution.score(scene)
    for other in others:
        mine = other.of(robot)
        if mine and not _shares(solution.of(robot), mine):
            part = max(mine, key=lambda s: s.gain).part
            log_odds = TEMPER * (other.score(scene) - score)
            competing[part] = max(competing.get(part, -np.inf), log_odds)
    worst = max(competing, key=lambda k: competing[k], default=-1)
    terms = [-chance, *competing.values()]
    total = float(np.logaddexp.reduce([0.0, *terms]))
    return Odds(
        confidence=float(np.exp(-total)),
        chance=chance,
        against=-competing[worst] if worst >= 0 else float("inf"),
        rival=worst,
    )


def _not_alike(scene: Scene, solution: Solution, robot: int) -> float:
    """Log odds against a vehicle that happens to drive alike: the same kind of laps, about as fast.

    With the same data as likely under both, only the level of noise tells: that of robots is known, and to come as
    near by chance needs several coincidences.
    """
    spans = solution.of(robot)
    weight = sum(s.counted for s in spans)
    square = sum(_level(scene, solution, s) ** 2 * s.counted for s in spans)
    level = float(np.sqrt(square / max(weight, 1e-9)))
    moving = sum(part.moves for part in scene.parts)
    off = np.log(max(level, ROBOT_LEVEL / ROBOT_FACTOR) / ROBOT_LEVEL) / np.log(ROBOT_FACTOR)
    robots = -0.5 * off**2 - 0.5 * np.log(2 * np.pi) - np.log(np.log(ROBOT_FACTOR))
    near = COINCIDENCES * np.log(min(level / ALIKE_LEVEL, 1.0)) + np.log(COINCIDENCES)
    return float(robots - near - np.log(ALIKE_SHARE * max(moving, 1)))


def _shares(mine: tuple[Span, ...], its: tuple[Span, ...]) -> bool:
    """Whether two answers have some stretch of a fragment in common."""
    return any(
        a.part == b.part and min(a.stop, b.stop) > max(a.first, b.first) for a in mine for b in its
    )


def _common(a: Span, b: Span) -> float:
    return min(a.last_s, b.last_s) - max(a.first_s, b.first_s)


def _beside(scene: Scene, span: Span, k: int) -> bool:
    """Whether a fragment is seen during a span, elsewhere."""
    part, own = scene.parts[k], scene.parts[span.part]
    common = min(part.last_s, span.last_s) - max(part.first_s, span.first_s)
    if common < min(OVERLAP * (span.last_s - span.first_s), 2.0):
        return False
    _, i, j = np.intersect1d(np.round(part.t, 6), np.round(own.t, 6), return_indices=True)
    if len(i) == 0:
        return True
    return bool(np.median(np.linalg.norm(part.uv[i] - own.uv[j], axis=1)) > CLOSE_PX)


def _as_robot(
    scene: Scene, solution: Solution, r: int, k: int, *, fixed: bool
) -> tuple[list[Span], float]:
    """How a fragment follows a robot at its best offset and zero of headings."""
    part, robot = scene.parts[k], scene.robots[r]
    reach = (solution.lag, solution.lag) if fixed else scene.reach
    lags = np.arange(reach[0], reach[1] + LAG_STEP / 2, LAG_STEP)
    w = robot.at(part.t + lags[:, None]) @ (1, 1j)  # (G, K)
    with np.errstate(divide="ignore", invalid="ignore"):  # on the horizon
        seen = solution.model.ground_velocity(part.uv, part.uv_dot) @ (1, 1j)
    z = seen * np.conj(w)
    z = np.where(np.isfinite(z), z, 0.0)
    z = z / np.sqrt(np.abs(z) + 1e-12)
    turn = np.angle(z.sum(axis=1))
    turned = w * np.exp(1j * turn[:, None])
    xy = np.stack([turned.real, turned.imag], axis=-1)
    off = part.uv_dot - solution.model.image_velocity(part.uv, xy)
    known = np.asarray(np.isfinite(off).all(axis=-1))
    ratio = follows(np.where(known[..., None], off, 0.0), part.noise(float(RELATIVE[3])))
    gain = np.where(known, scene.share(part, robot) * (ratio - part.alone), 0.0)
    best = int(np.argmax(np.sum(np.maximum(gain, -SWITCH), axis=1)))
    rest = residual(part, robot, solution.model, float(lags[best]), float(turn[best]))
    spans: list[Span] = []
    worth, level = -np.inf, float(RELATIVE[-1])
    for trial in RELATIVE:
        found = followed(scene, r, k, rest, float(trial))
        total = sum(s.gain for s in found) + float(level_prior(float(trial)))
        if found and total > worth:
            worth, spans = total, found
    return spans, _relative(part, rest, spans) if spans else level


def _level(scene: Scene, solution: Solution, span: Span) -> float:
    """Noise over speed of a span."""
    part, robot = scene.parts[span.part], scene.robots[span.robot]
    turn = float(solution.turns[span.robot])
    return _relative(part, residual(part, robot, solution.model, solution.lag, turn), [span])


def _relative(part: Fragment, off: FloatArray, spans: list[Span]) -> float:
    rows = np.concatenate([np.arange(s.first, s.stop) for s in spans])
    sigma = part.noise(1.0)[rows]
    z2 = np.sum(off[rows] ** 2, axis=1) / sigma**2
    z2 = z2[np.isfinite(z2)]
    if not len(z2):
        return float(RELATIVE[-1])
    # A quantile of an exponential is -ln(1 - q) times its mean; two coordinates.
    return float(np.sqrt(np.quantile(z2, MOST_FIT) / -np.log(1 - MOST_FIT) / 2))
