"""One g, one offset of the clocks, and which fragments follow which robot under them (eq. 15)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.identify_chain import Span
from airground.calibration.identify_judge import judged, turned
from airground.calibration.identify_solution import Scene, Solution
from airground.calibration.robust import robust_fit
from airground.calibration.samples import MotionSamples
from airground.errors import AirgroundError

if TYPE_CHECKING:
    from airground.calibration.identify_screen import Seed
    from airground.geometry.arrays import FloatArray
    from airground.geometry.limited import LimitedHomography

__all__ = ["solve"]

ROUNDS = 4
OFFSET_ROUNDS = 4
FIT_LEVEL = 0.065
"""Noise over speed with which g is fitted."""

MOST = 1500
"""Windows for a fit of g."""


def solve(scene: Scene, seed: Seed) -> Solution | str:
    """Fit g to a seed, see who follows, and again.

    Parameters
    ----------
    scene : Scene
        Fragments and robots.
    seed : Seed
        Where to begin.

    Returns
    -------
    solution : Solution or str
        In words why there is none.
    """
    turns = np.full(len(scene.robots), 0.0 if scene.one_frame else np.nan)
    turns[seed.robot] = 0.0
    spans: tuple[Span, ...] = tuple(
        Span(seed.robot, k, 0, len(scene.parts[k].t), 0.0, 0.0, 0.0, 0.0) for k in seed.members
    )
    lag, best = seed.lag, None
    for _ in range(ROUNDS):
        fit = _fit(scene, spans, lag, turns)
        if isinstance(fit, str):
            return fit if best is None else best
        model, lag = fit
        found = judged(scene, model, lag, turns, reference=seed.robot)
        if not found.spans:
            return "nothing follows the readings" if best is None else best
        same = best is not None and _members(found) == _members(best)
        if best is None or found.score(scene) >= best.score(scene):
            best = found
        spans, turns = found.spans, found.turns
        if same:
            break
    return best or "nothing follows the readings"


def _members(solution: Solution) -> set[tuple[int, int, int, int]]:
    return {(s.robot, s.part, s.first, s.stop) for s in solution.spans}


def _fit(
    scene: Scene, spans: tuple[Span, ...], lag: float, turns: FloatArray
) -> tuple[LimitedHomography, float] | str:
    """Fit g and the offset, robustly."""
    for _ in range(OFFSET_ROUNDS):
        uv, uv_dot, sigma, w, w_dot = _samples(scene, spans, lag, turns)
        if len(uv) < 6:
            return "too few velocities in common with the readings"
        if len(uv) > MOST:
            some = np.linspace(0, len(uv) - 1, MOST).astype(int)
            uv, uv_dot, sigma, w, w_dot = (a[some] for a in (uv, uv_dot, sigma, w, w_dot))
        try:
            fit = robust_fit(
                MotionSamples(uv, uv_dot, w), sigma_pxps=sigma, rng=np.random.default_rng(len(uv))
            )
        except AirgroundError as error:
            return str(error)
        except np.linalg.LinAlgError:
            return "the image velocities do not follow the ground velocities"
        model, inlier = fit.model, fit.inliers
        # One step of Gauss-Newton in the offset: its derivative is the change of the ground velocity.
        r = (uv_dot - model.image_velocity(uv, w))[inlier] / sigma[inlier, None]
        d = model.image_velocity(uv, w_dot)[inlier] / sigma[inlier, None]
        power = float(np.sum(d * d))
        step = float(np.clip(np.sum(r * d) / power, -0.15, 0.15)) if power > 0 else 0.0
        lag = float(np.clip(lag + step, *scene.reach))
        if abs(step) < 0.005:
            break
    middle = np.median(uv[inlier], axis=0)
    # The image is seen from above with v down: a right-handed ground frame is turned over in it.
    if (np.linalg.det(model.jacobian(middle)) > 0) != scene.left_handed:
        return "follows only if the ground frame is the other way round"
    return model, lag


def _samples(
    scene: Scene, spans: tuple[Span, ...], lag: float, turns: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Places, velocities, their noise, ground velocities and their derivatives."""
    rows: list[tuple[FloatArray, ...]] = []
    for span in spans:
        if not np.isfinite(turns[span.robot]):
            continue
        part, robot = scene.parts[span.part], scene.robots[span.robot]
        mine = slice(span.first, span.stop)
        t = part.t[mine] + lag
        w, ahead, behind = (turned(robot.at(t + h), turns[span.robot]) for h in (0.0, 0.1, -0.1))
        w_dot = (ahead - behind) / 0.2
        good = np.isfinite(w).all(axis=1)
        w_dot = np.where(np.isfinite(w_dot), w_dot, 0.0)
        columns = (part.uv[mine], part.uv_dot[mine], part.noise(FIT_LEVEL)[mine], w, w_dot)
        rows.append(tuple(c[good] for c in columns))
    if not rows:
        empty = np.zeros((0, 2))
        return empty, empty, np.zeros(0), empty, empty
    uv, uv_dot, sigma, w, w_dot = (np.concatenate(c) for c in zip(*rows, strict=True))
    return uv, uv_dot, sigma, w, w_dot
