"""Where the whole-drive estimate starts: g and the clock from motion correspondences, robustly.

Velocities over short windows need no origin and no noise model, and `robust_fit` finds g among many wrong ones, from
two headings on. The clock's offset is the one at which most of the image motion is explained.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.by_linear import require_overlap
from airground.calibration.clock import REACH, parabola_minimum
from airground.calibration.correspondences import Correspondences, Pairing, pair_recordings
from airground.calibration.headings import APART_DEG, advise, distinct_headings_deg
from airground.calibration.local_polynomial import noise_level
from airground.calibration.recordings import Tracks
from airground.calibration.robust import RobustFit, robust_fit
from airground.calibration.samples import MotionSamples
from airground.calibration.trajectory.plausible import plausible_sightings
from airground.errors import UnobservableMotionError
from airground.geometry.velocity import image_velocity

if TYPE_CHECKING:
    from airground.calibration.recordings import Motion
    from airground.geometry.arrays import FloatArray

__all__ = ["Start", "find_start", "plausible_tracks"]

STEP = 0.2  # s; over which the velocity of a ground vehicle changes little enough for a robust fit to notice the best
FINE = 0.05  # s
SEARCHED = 400  # samples for the search of the clock
USED = 4000  # samples for the start itself
RELATIVE = 0.05  # noise of readings and of what windows smooth away, of the image velocity
CLEAR = 0.02  # how much less the best offset must cost than zero, of the cost
TURN_STEPS = 72
BETTER = (
    0.8  # what zeros of their own must bring the cost down to: swapped names look alike otherwise
)
LEAST_AGREE = 0.25  # share of the samples that must follow g: of fewer some g can always be found
ONE_HEADING = 4  # constraints, of parallel lines: their vanishing point and two speeds
AGREE = 0.5  # share of a robot's samples that must follow the others' g for its headings to have the same zero


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """A first estimate."""

    fit: RobustFit
    """g, and a second solution if there is one."""

    offset: float
    """Clock offset [s]."""

    turns: FloatArray
    """(K,) [rad]. What to add to the headings of each of the pairing's robots."""

    apart: tuple[int, ...]
    """Robots whose headings count from another zero than the first one's."""

    data: Correspondences
    """The samples at that offset, with the headings turned."""

    targets: tuple[str, ...]
    """Names of the pairing's robots."""


def plausible_tracks(
    tracks: Tracks, motion: Motion
) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Tell sightings that fit in with their neighbours, of all robots that have readings.

    Parameters
    ----------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.

    Returns
    -------
    plausible : (N,) array of bool
        True also for targets without readings.
    """
    keep = np.ones(len(tracks), dtype=bool)
    for name in tracks.targets:
        if name in motion.targets:
            keep[tracks.rows(name)] = plausible_sightings(tracks, name)
    return keep


def find_start(tracks: Tracks, motion: Motion, offset: float | None) -> Start:
    """Find g and the clock's offset from motion correspondences.

    Parameters
    ----------
    tracks : Tracks
        Plausible sightings.
    motion : Motion
        Readings.
    offset : float, optional [s]
        The clock's offset, where it is known.

    Returns
    -------
    start : Start
        A first estimate.

    Raises
    ------
    UnobservableMotionError
        If no offset gives a g.
    InputError
        If tracks and motion do not belong together.
    """
    pairing = pair_recordings(tracks, motion, most=USED)
    noise = _Noise(pairing)
    if offset is None:
        offset = _search(pairing, noise)
    data = pairing.thinned(USED).at_offset(offset)
    if not len(data.samples):
        require_overlap(pairing, motion, offset)
    try:
        start = _fit(pairing, data, _Noise(pairing.thinned(USED)), offset)
    except UnobservableMotionError as error:
        raise _one_heading(data) or error from None
    except np.linalg.LinAlgError:  # a g that flattens the ground
        raise _disagreement(data, 0) from None
    count = int(np.count_nonzero(start.fit.inliers))
    if count < LEAST_AGREE * len(data.samples):
        raise _disagreement(data, count)
    return start


def _one_heading(data: Correspondences) -> UnobservableMotionError | None:
    """Where no two headings were driven, that is the reason, whatever the search came upon."""
    headings = distinct_headings_deg(data.samples.xy_dot)
    if any(abs((h - headings[0] + 90) % 180 - 90) >= APART_DEG for h in headings):
        return None
    seen = ", ".join(f"{h:.0f}" for h in headings) or "none"
    return UnobservableMotionError(
        f"the motion does not determine g: one heading gives {ONE_HEADING} of the 6 constraints of eq. 15 at most "
        f"(headings seen, modulo 180 degrees: {seen})",
        rank=ONE_HEADING if headings else 0,
        headings_deg=headings,
        advice=advise(headings, enough=2),
    )


def _disagreement(data: Correspondences, count: int) -> UnobservableMotionError:
    return UnobservableMotionError(
        "the image velocities do not follow the ground velocities: "
        f"{count} of {len(data.samples)} samples agree at best",
        rank=0,
        headings_deg=distinct_headings_deg(data.samples.xy_dot),
        advice="check that tracks and motion belong together, and the clock",
    )


class _Noise:
    """Deviation of the image velocities in the windows of a pairing."""

    def __init__(self, pairing: Pairing) -> None:
        gains = []
        for pair in pairing.pairs:
            rough = noise_level(pair.raw_uv)
            level = max(0.3, rough if np.isfinite(rough) else 1.0)
            gains.append(pair.windows.velocity_gain() * level)
        self.gain = np.concatenate(gains)

    def of(self, data: Correspondences) -> FloatArray:
        """(W,) [px/s]."""
        speed = np.hypot(*data.samples.uv_dot.T)
        usual = float(np.median(speed)) if len(speed) else 1.0
        sigma = np.hypot(self.gain[data.window], RELATIVE * np.maximum(speed, 0.2 * usual))
        return np.asarray(np.maximum(sigma, 1e-6))


def _search(pairing: Pairing, noise: _Noise) -> float:
    few = pairing.thinned(SEARCHED)
    noise = _Noise(few)
    usual = len(few.at_offset(0.0).samples)
    known: dict[float, float] = {}

    def cost(offset: float) -> float:
        if offset not in known:
            known[offset] = _cost(few, noise, offset, usual)
        return known[offset]

    count = round(REACH / STEP)
    grid = [STEP * k for k in range(-count, count + 1)]
    costs = np.array([cost(o) for o in grid])
    if not np.isfinite(costs).any():
        return 0.0
    best = grid[int(np.argmin(costs))]
    if abs(best) > REACH - STEP / 2 or not cost(best) < (1 - CLEAR) * cost(0.0):
        best = 0.0
    step = STEP / 2
    while step > FINE / 2:
        near = [cost(best - step), cost(best), cost(best + step)]
        if not np.isfinite(near).all():
            break
        best += step * parabola_minimum(near)
        step /= 2
    return float(best)


def _cost(pairing: Pairing, noise: _Noise, offset: float, usual: int) -> float:
    data = pairing.at_offset(offset)
    if len(data.samples) < max(6, usual // 2):
        return np.inf
    try:
        return _fit(pairing, data, noise, offset).fit.cost
    except (UnobservableMotionError, np.linalg.LinAlgError):  # also a g that flattens the ground
        return np.inf


def _fit(pairing: Pairing, data: Correspondences, noise: _Noise, offset: float) -> Start:
    """Fit all robots, their headings counted from one zero if they agree, else each from its own."""
    sigma = noise.of(data)
    turns = np.zeros(data.target_count)
    present = np.unique(data.target_index)
    rng = np.random.default_rng(len(data.samples))  # the same samples, the same start
    if data.one_frame or len(present) == 1:
        fit = robust_fit(data.samples, sigma_pxps=sigma, rng=rng)
        return Start(fit, offset, turns, (), data, pairing.targets)
    together: RobustFit | None
    try:
        together = robust_fit(data.samples, sigma_pxps=sigma, rng=rng)
        shares = [float(np.mean(together.inliers[data.target_index == k])) for k in present]
        if min(shares) >= AGREE:
            return Start(together, offset, turns, (), data, pairing.targets)
    except UnobservableMotionError:
        together = None
    alone = _best_alone(data, sigma, present, rng)
    if alone is None:
        if together is None:
            together = robust_fit(data.samples, sigma_pxps=sigma, rng=rng)
        return Start(together, offset, turns, (), data, pairing.targets)
    reference, fit = alone
    for k in present:
        if k != reference:
            mine = data.target_index == k
            turns[k] = _turn(fit.model.g, data.samples.take(mine), sigma[mine])
    samples = _turned(data.samples, turns[data.target_index])
    fit = robust_fit(samples, sigma_pxps=sigma, rng=rng)
    if together is not None and fit.cost > BETTER * together.cost:
        return Start(together, offset, turns * 0.0, (), data, pairing.targets)
    apart = tuple(int(k) for k in present if k != reference)
    data = Correspondences(
        samples, data.window, data.target_index, data.span, data.sightings, data.one_frame
    )
    return Start(fit, offset, turns, apart, data, pairing.targets)


def _best_alone(
    data: Correspondences,
    sigma: FloatArray,
    present: np.ndarray[tuple[int, ...], np.dtype[np.intp]],
    rng: np.random.Generator,
) -> tuple[int, RobustFit] | None:
    best: tuple[int, RobustFit] | None = None
    for k in present:
        mine = data.target_index == k
        if mine.sum() < 12:
            continue
        try:
            fit = robust_fit(data.samples.take(mine), sigma_pxps=sigma[mine], rng=rng)
        except UnobservableMotionError:
            continue
        if best is None or fit.relative_sigma < best[1].relative_sigma:
            best = int(k), fit
    return best


def _turn(g: FloatArray, samples: MotionSamples, sigma: FloatArray) -> float:
    """Turn of a robot's headings that explains most of its image motion."""
    angles = np.linspace(-np.pi, np.pi, TURN_STEPS, endpoint=False)
    costs = []
    for angle in angles:
        turned = _turned(samples, np.full(len(samples), angle))
        r = (samples.uv_dot - image_velocity(g, turned.uv, turned.xy_dot)) / sigma[:, None]
        costs.append(float(np.sum(np.minimum(np.sum(r**2, axis=1), 9.0))))
    return float(angles[int(np.argmin(costs))])


def _turned(samples: MotionSamples, turn: FloatArray) -> MotionSamples:
    cos, sin = np.cos(turn), np.sin(turn)
    x, y = samples.xy_dot.T
    return MotionSamples(
        samples.uv, samples.uv_dot, np.column_stack([cos * x - sin * y, sin * x + cos * y])
    )
