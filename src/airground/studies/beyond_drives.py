"""Simulated drives that the paper's method was not made for, and what each method makes of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import Calibration, Tracks, calibrate, identify
from airground.calibration.alignment import fit_linear
from airground.calibration.correspondences import pair_recordings
from airground.errors import AirgroundError
from airground.geometry.metrics import align_rotation, n_error
from airground.sim.recordings import Recording, RecordingNoise, RecordingPlan, record

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from airground.calibration import Identification
    from airground.geometry.arrays import FloatArray

__all__ = ["ABILITIES", "LINEAR", "Ability", "judged", "one_drive", "pairings", "unnamed"]

PLAN = RecordingPlan(drive="random_turns", tilt_deg=35.0, duration_s=40.0)
NOISE = RecordingNoise(
    tracks_hz=20.0, motion_hz=20.0, pixel_px=1.0, speed_mps=0.003, heading_rad=0.02, slip=0.02
)
STREAM = 0xBE  # of the seed; drive k is the same in all rows, so that they can be compared

LINEAR: Mapping[str, Any] = {"method": "linear", "time_offset_s": 0.0}
"""Options of `calibrate` for the paper's method; it has one clock."""


@dataclass(frozen=True, slots=True)
class Ability:
    """Something that a calibration may have to cope with."""

    words: str
    """What it is."""

    paper: str
    """What the paper says about it."""

    plan: RecordingPlan = PLAN
    """Camera and drive."""

    noise: RecordingNoise = NOISE
    """What is wrong with the recording."""

    without: Mapping[str, Any] | None = None
    """Options of `calibrate` that leave out what copes with it; None where no option does."""

    named: bool = True
    """Do the tracks tell the robots apart?"""

    beside: str = ""
    """What is found beside g, where there is something: a key of `one_drive`."""

    truth: float = 0.0
    """Its true value."""


ABILITIES: dict[str, Ability] = {
    "plain": Ability("an ordinary drive", "eight headings, noise"),
    "rectangles": Ability(
        "only two directions: a rectangle",
        "five measurements are enough",
        plan=replace(PLAN, drive="rectangle"),
    ),
    "outliers": Ability(
        "20% of the sightings anywhere",
        "every sample counts",
        noise=replace(NOISE, outlier_share=0.2),
        beside="inlier_fraction",
        truth=0.8,
    ),
    "clocks": Ability(
        "clocks 0.3 s apart",
        "not mentioned",
        noise=replace(NOISE, time_offset_s=0.3),
        without={"time_offset_s": 0.0},
        beside="time_offset_s",
        truth=0.3,
    ),
    "lens": Ability(
        "a lens with k1 = -0.15",
        "a pinhole",
        noise=replace(NOISE, lens_k1=-0.15),
        without={"distortion": "none"},
        beside="k1",
        truth=-0.15,
    ),
    "robots": Ability(
        "three robots, unnamed tracks",
        "several are imagined, one is driven",
        plan=replace(PLAN, robots=3),
        noise=replace(NOISE, heading_bias_rad=(0.0, 0.8, -1.5)),
        without={},
        named=False,
    ),
}
"""By key. Each robot's heading has a zero of its own; k1 is for radii in half diagonals of the image."""


def one_drive(key: str, seed: int, k: int) -> dict[str, float | None]:
    """Drive once, and calibrate in each way.

    Parameters
    ----------
    key : str
        Of `ABILITIES`.
    seed : int
        Of all drives.
    k : int
        Which of them.

    Returns
    -------
    found : dict
        ``linear_n``, ``trajectory_n`` and, where there is an option to leave out, ``without_n``; None where refused.
        ``equations_n`` is what eqs. 16 and 17 give, refused or not. Beside g, ``time_offset_s``, ``k1`` and
        ``inlier_fraction`` of the whole drive, and of robots without names the share ``right`` and ``wrong``.
    """
    ability = ABILITIES[key]
    rng = np.random.default_rng([seed, STREAM, k])
    recording = record(ability.plan, ability.noise, seed=rng)
    named = as_told = recording.tracks
    found: dict[str, float | None] = {}
    if not ability.named:
        robots = ability.plan.robots
        order = np.roll(np.arange(robots), rng.integers(1, robots))
        tracks = unnamed(recording, order)
        as_told = replace(tracks, targets=recording.tracks.targets)  # no name is right
        identification = identify(tracks, recording.motion)
        found["right"], found["wrong"] = pairings(recording, order, identification)
        named = identification.tracks
    found["linear_n"] = judged(recording, _calibrated(recording, as_told, LINEAR))
    found["equations_n"] = _equations_n(recording, as_told)
    if ability.without is not None:
        found["without_n"] = judged(recording, _calibrated(recording, as_told, ability.without))
    ours = _calibrated(recording, named, {})
    found["trajectory_n"] = judged(recording, ours)
    if ours is not None:
        found["time_offset_s"] = ours.time_offset_s
        found["inlier_fraction"] = ours.fit.inlier_fraction
        found["k1"] = 0.0 if ours.lens is None else ours.lens.k1 * _half_diagonal_px(recording) ** 2
    return found


def judged(recording: Recording, calibration: Calibration | None) -> float | None:
    """Compare an estimate with the truth.

    Parameters
    ----------
    recording : Recording
        With its truth.
    calibration : Calibration or None
        From what was recorded.

    Returns
    -------
    n : float or None
        Error of eq. 22 after the best rotation of the ground; None where there is no estimate.
    """
    return None if calibration is None else _n(recording, calibration.model.g)


def unnamed(recording: Recording, order: ArrayLike) -> Tracks:
    """Give tracks whose names tell nothing.

    Parameters
    ----------
    recording : Recording
        Of several robots.
    order : (K,) array_like of int
        The k-th track is that of robot ``order[k]``.

    Returns
    -------
    tracks : Tracks
        The same sightings, as `track-1`, `track-2`, ...
    """
    tracks = recording.tracks
    rows = [tracks.rows(tracks.targets[k]) for k in np.asarray(order).tolist()]
    counts = [one.stop - one.start for one in rows]
    return Tracks(
        targets=tuple(f"track-{k}" for k in range(1, len(rows) + 1)),
        target_index=np.repeat(np.arange(len(rows)), counts),
        t=np.concatenate([tracks.t[one] for one in rows]),
        uv=np.concatenate([tracks.uv[one] for one in rows]),
    )


def pairings(
    recording: Recording, order: ArrayLike, identification: Identification
) -> tuple[float, float]:
    """Compare what was found of unnamed tracks with the truth.

    Parameters
    ----------
    recording : Recording
        Of several robots.
    order : (K,) array_like of int
        As `unnamed` was given it.
    identification : Identification
        Of its tracks.

    Returns
    -------
    right : float
        Share of the robots that were given their own track, and no other.
    wrong : float
        Share of those that were given another's; the rest was left open.
    """
    names = {
        recording.tracks.targets[robot]: f"track-{k}"
        for k, robot in enumerate(np.asarray(order).tolist(), start=1)
    }
    given = [(one.robot, {span.track for span in one.spans}) for one in identification.robots]
    right = sum(tracks == {names[robot]} for robot, tracks in given)
    wrong = sum(not tracks <= {names[robot]} for robot, tracks in given)
    return right / len(names), wrong / len(names)


def _calibrated(
    recording: Recording, tracks: Tracks, options: Mapping[str, Any]
) -> Calibration | None:
    size = recording.plan.image_size_px
    try:
        return calibrate(tracks, recording.motion, image_size_px=size, **options)
    except AirgroundError:
        return None


def _equations_n(recording: Recording, tracks: Tracks) -> float | None:
    """What the paper's equations give where nobody asks whether the motion determines g."""
    try:
        data = pair_recordings(tracks, recording.motion).at_offset(0.0)
        return _n(recording, fit_linear(data).g)
    except AirgroundError:
        return None


def _n(recording: Recording, g_hat: FloatArray) -> float | None:
    aligned, _ = align_rotation(recording.truth.g, g_hat)
    n = float(n_error(recording.truth.g, aligned))
    return n if np.isfinite(n) else None


def _half_diagonal_px(recording: Recording) -> float:
    return float(np.hypot(*recording.plan.image_size_px) / 2)
