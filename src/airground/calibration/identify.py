"""Which of many tracks are the robots, from how they move."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration.headings import advise, distinct_headings_deg
from airground.calibration.identify_adjoin import adjoined
from airground.calibration.identify_confidence import odds_of, rivals
from airground.calibration.identify_rename import renamed, track_spans
from airground.calibration.identify_screen import find_seeds
from airground.calibration.identify_solution import Scene, Solution
from airground.calibration.identify_solve import solve
from airground.calibration.identify_types import Identification, RobotIdentity, TrackSpan
from airground.calibration.identify_windows import fragments, robot_motion, window_length
from airground.calibration.recordings import refuse_extremes
from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.calibration.identify_confidence import Odds
    from airground.calibration.recordings import Motion, Tracks

__all__ = [
    "LEAST_CONFIDENCE",
    "REACH_S",
    "Identification",
    "RobotIdentity",
    "TrackSpan",
    "identify",
]

LEAST_CONFIDENCE = 0.95
REACH_S = 3.0  # how far apart two clocks are looked for
LAG_STEP_S = 0.1
KNOWN_S = 0.2  # about an offset that was given
SURE_SPAN = 2.0  # log odds against a rival above which a span is kept
TURN = "drive a turn or a stop that the others do not"


def identify(
    tracks: Tracks,
    motion: Motion,
    *,
    time_offset_s: float | None = None,
    reach_s: float = REACH_S,
    left_handed: bool = False,
    least_confidence: float = LEAST_CONFIDENCE,
    note: Callable[[str], None] | None = None,
) -> Identification:
    """Find which of many unlabelled tracks are the robots whose readings are given.

    A robot's track follows its readings through one g and one offset of the clocks, shared by all robots (eq. 15); a
    track of something else does not. Tracks may be pieces of a robot's way, may change to another object in their
    middle, and most of them may be nothing known at all. Names in the tracks are not believed.

    Parameters
    ----------
    tracks : Tracks
        Sightings under any names.
    motion : Motion
        Readings of one or several robots.
    time_offset_s : float, optional [s]
        To be added to times of the tracks to get times of the readings, where it is known: vehicles that follow the
        robot at a distance can then be told from it.
    reach_s : float [s]
        How far apart the two clocks may be, where it is not known.
    left_handed : bool
        Whether the readings' ground frame is left-handed, as north-east is. The sense of turns tells tracks apart, so
        it is not guessed.
    least_confidence : float
        Probability from which on an answer is accepted.
    note : callable, optional
        Is given one-line remarks.

    Returns
    -------
    identification : Identification
        For each robot its tracks, or the reason why there are none.

    Raises
    ------
    InputError
        If an option is out of its range, or the recordings hold numbers too large to compute with.
    """
    if not 0.5 <= least_confidence < 1:
        raise InputError(f"least_confidence must lie in 0.5..1, not {least_confidence}")
    if not 0 < reach_s <= 60:
        raise InputError(f"reach_s must lie in 0..60, not {reach_s}")
    if time_offset_s is not None and not abs(time_offset_s) < np.inf:
        raise InputError(f"time_offset_s must be finite, not {time_offset_s}")
    refuse_extremes(tracks, "tracks")
    refuse_extremes(motion, "motion")
    say = note or (lambda _: None)

    middle, reach = (0.0, reach_s) if time_offset_s is None else (time_offset_s, KNOWN_S)
    length = window_length(tracks)
    scene = Scene(
        parts=fragments(tracks, length),
        robots=[robot_motion(motion, name, length) for name in motion.targets],
        one_frame=motion.xy_dot is not None,
        left_handed=left_handed,
        reach=(middle - reach, middle + reach),
        length=length,
    )
    found, turned_over = _solutions(scene)
    best = found[0] if found else None
    if best is not None and best.score(scene) <= 0:
        best = None
    identities: list[RobotIdentity] = []
    for r in range(len(scene.robots)):
        if best is None or not best.of(r):
            identities.append(_missing(scene, r, found, mirrored=r in turned_over))
            continue
        identity, best = _settled(scene, best, r, found[1:], tracks=tracks, least=least_confidence)
        identities.append(identity)
    kept = [identity for identity in identities if identity.identified]
    return Identification(
        robots=tuple(identities),
        tracks=renamed(tracks, motion.targets, identities, say),
        time_offset_s=best.lag if best is not None and kept else None,
        model=best.model if best is not None and kept else None,
    )


def _solutions(scene: Scene) -> tuple[list[Solution], set[int]]:
    """Different answers, the best first; and robots that tracks follow the other way round."""
    count = max(1, round((scene.reach[1] - scene.reach[0]) / LAG_STEP_S))
    lags = np.linspace(*scene.reach, count + 1)
    different: dict[tuple[tuple[int, int], ...], Solution] = {}
    turned_over: set[int] = set()
    for r, robot in enumerate(scene.robots):
        for seed in find_seeds(scene.parts, robot, r, lags):
            answer = solve(scene, seed)
            if isinstance(answer, str):
                if "other way round" in answer and seed.evidence > 20:
                    turned_over.add(r)
                continue
            key = tuple(sorted({(s.robot, s.part) for s in answer.spans}))
            if key not in different or answer.score(scene) > different[key].score(scene):
                different[key] = answer
    return sorted(different.values(), key=lambda s: -s.score(scene)), turned_over


def _settled(
    scene: Scene,
    best: Solution,
    r: int,
    others: list[Solution],
    *,
    tracks: Tracks,
    least: float,
) -> tuple[RobotIdentity, Solution]:
    """Decide on one robot: spans that a rival could be instead go, and what is left must be sure."""
    beside = rivals(scene, best, r)
    mine = best.of(r)
    doubtful = {rival.span for rival in beside if rival.log_odds > -SURE_SPAN}
    name = scene.robots[r].name
    if doubtful and len(doubtful) < len(mine):
        gone = {mine[j] for j in doubtful}
        without = replace(best, spans=tuple(s for s in best.spans if s not in gone))
        clear = [rival for rival in beside if rival.span not in doubtful]
        odds = odds_of(scene, without, r, others, clear)
        if odds.confidence >= least:
            return _identity(scene, without, r, odds, tracks), without
    odds = odds_of(scene, best, r, others, beside)
    if odds.confidence >= least:
        return _identity(scene, best, r, odds, tracks), best
    names = tuple(dict.fromkeys(scene.parts[s.part].name for s in mine))
    if odds.rival >= 0 and odds.against < odds.chance:
        rival = scene.parts[odds.rival].name
        reason = f"{_list(names)} and {rival} both follow its readings, as vehicles in a convoy do"
        if rival in names:
            reason = f"{rival} follows the readings of another robot as well"
        names = tuple(dict.fromkeys((*names, rival)))
        advice = TURN
    else:
        reason = f"{_list(names)} follows its readings, but so might others by chance"
        advice = f"drive longer; {_headings(scene, r)}"
    identity = RobotIdentity(
        name, (), odds.confidence, min(odds.chance, odds.against), names, reason, advice
    )
    return identity, best


def _identity(scene: Scene, best: Solution, r: int, odds: Odds, tracks: Tracks) -> RobotIdentity:
    taken = {s.part for s in best.spans}
    chain = sorted((*best.of(r), *adjoined(scene, best, r, taken)), key=lambda s: s.first_s)
    spans = tuple(
        span
        for s in chain
        if (span := track_spans(tracks, scene.parts[s.part].name, s.first_s, s.last_s)) is not None
    )
    names = tuple(dict.fromkeys(span.track for span in spans))
    rival = () if odds.rival < 0 else (scene.parts[odds.rival].name,)
    margin = min(odds.chance, odds.against)
    return RobotIdentity(
        robot=scene.robots[r].name,
        spans=spans,
        confidence=odds.confidence,
        margin=margin,
        candidates=tuple(dict.fromkeys((*names, *rival))),
        reason="",
        advice="",
    )


def _missing(scene: Scene, r: int, found: list[Solution], *, mirrored: bool) -> RobotIdentity:
    """Say why nothing follows a robot."""
    robot = scene.robots[r]
    tried = [s for s in found if s.of(r)]
    names: tuple[str, ...] = ()
    if robot.usual == 0:
        reason, advice = "its readings show no motion", "drive, with turns, where the camera sees"
    elif not any(part.moves for part in scene.parts):
        reason, advice = "no track moves", "check the detector, and that the camera sees the robot"
    elif mirrored:
        reason = "tracks follow its readings only if the ground frame is left-handed"
        advice = "say left_handed (--left-handed) if its y axis points to the right of x"
    elif tried:
        names = tuple(dict.fromkeys(scene.parts[s.part].name for s in tried[0].of(r)))
        reason = f"{_list(names)} follows its readings, but so might others by chance"
        advice = f"drive longer; {_headings(scene, r)}"
    else:
        reason = "no track follows its readings"
        advice = f"check the clocks and that the camera sees it, or {_headings(scene, r)}"
    return RobotIdentity(robot.name, (), 0.0, 0.0, names, reason, advice)


def _headings(scene: Scene, r: int) -> str:
    xy_dot = scene.robots[r].xy_dot
    return advise(distinct_headings_deg(xy_dot[np.isfinite(xy_dot).all(axis=1)]), enough=2)


def _list(names: tuple[str, ...]) -> str:
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
