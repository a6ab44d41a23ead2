"""Who follows which robot under a given g and offset of the clocks (eq. 15)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.identify_chain import Span, chained
from airground.calibration.identify_evidence import RELATIVE, follows, level_prior, spans_of
from airground.calibration.identify_solution import Scene, Solution

if TYPE_CHECKING:
    from airground.calibration.identify_windows import Fragment, RobotMotion
    from airground.geometry.arrays import FloatArray
    from airground.geometry.limited import LimitedHomography

__all__ = ["SWITCH", "followed", "judged", "own_turn", "residual", "turned"]

SWITCH = 4.0
"""What it costs, in log likelihood, that a fragment changes to another object."""

TURN_LEVEL = 0.1
"""Noise over speed with which the zero of a robot's headings is looked for."""

TURN_BINS = 72
"""For the zero of a robot's headings."""


def turned(xy_dot: FloatArray, angle: float) -> FloatArray:
    """Velocities turned counter-clockwise.

    Parameters
    ----------
    xy_dot : (..., 2) array
        Velocities.
    angle : float [rad]
        By how much.

    Returns
    -------
    xy_dot : (..., 2) array
        Turned.
    """
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(xy_dot @ np.array([[cos, sin], [-sin, cos]]))


def judged(
    scene: Scene, model: LimitedHomography, lag: float, turns: FloatArray, *, reference: int
) -> Solution:
    """See who follows which robot under a given g.

    Parameters
    ----------
    scene : Scene
        Fragments and robots.
    model : LimitedHomography
        g.
    lag : float [s]
        Offset of the clocks.
    turns : (R,) array [rad]
        Zeros of the headings; NaN where not known yet.
    reference : int
        Robot in whose frame g is.

    Returns
    -------
    solution : Solution
        At the level of noise that makes the data likeliest.
    """
    order = sorted(range(len(scene.robots)), key=lambda r: r != reference)
    found_turns = turns.copy()
    residuals: list[tuple[int, int, FloatArray]] = []
    for r in order:
        if scene.robots[r].usual == 0:
            continue
        if not scene.one_frame and r != reference:
            found_turns[r] = _turn(scene, model, lag, r)
        if not np.isfinite(found_turns[r]):
            continue
        residuals += [
            (r, k, residual(part, scene.robots[r], model, lag, float(found_turns[r])))
            for k, part in enumerate(scene.parts)
            if part.moves
        ]
    best: Solution | None = None
    for level in RELATIVE:
        spans = [
            span
            for r, k, off in residuals
            for span in followed(scene, r, k, off, float(level))
            if span.gain > scene.entry
        ]
        kept = chained(spans)
        gone = [r for r in range(len(scene.robots)) if r not in {s.robot for s in kept}]
        now = found_turns.copy()
        if not scene.one_frame:
            now[[r for r in gone if r != reference]] = np.nan
        solution = Solution(model, lag, now, kept, float(level))
        worth = sum(s.gain for s in kept) + float(level_prior(float(level)))
        if best is None or worth > sum(s.gain for s in best.spans) + float(level_prior(best.level)):
            best = solution
    assert best is not None
    return best


def residual(
    part: Fragment, robot: RobotMotion, model: LimitedHomography, lag: float, turn: float
) -> FloatArray:
    """Velocities of a fragment, minus what a robot's readings say (eq. 15).

    Parameters
    ----------
    part : Fragment
        Velocities in the image.
    robot : RobotMotion
        Readings.
    model : LimitedHomography
        g.
    lag : float [s]
        Offset of the clocks.
    turn : float [rad]
        To be added to the headings.

    Returns
    -------
    residual : (K, 2) array [px/s]
        NaN without readings.
    """
    w = turned(robot.at(part.t + lag), turn)
    return np.asarray(part.uv_dot - model.image_velocity(part.uv, w))


def followed(scene: Scene, r: int, k: int, off: FloatArray, level: float) -> list[Span]:
    """Stretches of a fragment that follow a robot.

    Parameters
    ----------
    scene : Scene
        Fragments and robots.
    r : int
        Robot.
    k : int
        Fragment.
    off : (K, 2) array [px/s]
        Residuals.
    level : float
        Noise over speed.

    Returns
    -------
    spans : list of Span
        Not yet freed from conflicts.
    """
    part = scene.parts[k]
    known = np.asarray(np.isfinite(off).all(axis=1))
    share = scene.share(part, scene.robots[r])
    ratio = follows(np.where(known[:, None], off, 0.0), part.noise(level)) - part.alone
    gain = np.where(known, share * ratio, 0.0)
    if np.sum(np.maximum(gain, 0.0)) < scene.entry:
        return []
    half = scene.length / 2
    spans = []
    for first, stop, total in spans_of(gain, switch=SWITCH):
        t0 = part.first_s if first == 0 else float(part.t[first]) - half / 2
        t1 = part.last_s if stop == len(part.t) else float(part.t[stop - 1]) + half / 2
        counted = share * float(np.count_nonzero(known[first:stop]))
        spans.append(Span(r, k, first, stop, t0, t1, total, counted))
    return spans


def _turn(scene: Scene, model: LimitedHomography, lag: float, r: int) -> float:
    """Zero of a robot's headings: of the fragment that follows best with one of its own."""
    best, angle = scene.entry, np.nan
    for k, part in enumerate(scene.parts):
        if not part.moves or len(part.t) < 3:
            continue
        own = own_turn(part, scene.robots[r], model, lag)
        if own is None:
            continue
        off = residual(part, scene.robots[r], model, lag, own)
        gain = max((s.gain for s in followed(scene, r, k, off, TURN_LEVEL)), default=-np.inf)
        if gain > best:
            best, angle = gain, own
    return angle


def own_turn(
    part: Fragment, robot: RobotMotion, model: LimitedHomography, lag: float
) -> float | None:
    """Zero of a robot's headings at which most of a fragment's way follows.

    Parameters
    ----------
    part : Fragment
        Velocities in the image.
    robot : RobotMotion
        Readings.
    model : LimitedHomography
        g.
    lag : float [s]
        Offset of the clocks.

    Returns
    -------
    turn : float or None [rad]
        None where nothing moves.
    """
    w = robot.at(part.t + lag)
    with np.errstate(divide="ignore", invalid="ignore"):  # on the horizon
        seen = model.ground_velocity(part.uv, part.uv_dot)
    good = np.isfinite(w).all(axis=1) & np.isfinite(seen).all(axis=1)
    if not good.any():
        return None
    z = (seen[good] @ (1, 1j)) * np.conj(w[good] @ (1, 1j))
    weight = np.minimum(np.abs(seen[good] @ (1, 1j)), np.abs(w[good] @ (1, 1j)))
    if not weight.sum() > 0:
        return None
    angle = np.angle(z)
    bins = (np.floor((angle + np.pi) / (2 * np.pi) * TURN_BINS).astype(int)) % TURN_BINS
    mass = np.bincount(bins, weight, TURN_BINS)
    mass = mass + np.roll(mass, 1) + np.roll(mass, -1)
    centre = (int(np.argmax(mass)) + 0.5) / TURN_BINS * 2 * np.pi - np.pi
    near = np.abs((angle - centre + np.pi) % (2 * np.pi) - np.pi) < 3 * np.pi / TURN_BINS
    return float(np.angle(np.sum(weight[near] * np.exp(1j * angle[near]))))
