"""Section 4.3: a camera on a drone that hovers in wind and then drifts: held still, calibrated, and driven under."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.studies.item import Document, Item, Outcome, Work, or_why_not
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from airground.studies.moving_run import MovingRun

__all__ = ["MOVING", "RUNS", "figures"]

RUNS = 5
GOALS = 4
PAPER = {"shown": "how: four fixed points on the ground; no experiment"}
WORDS = {
    "still": "camera that stands where the first picture was taken",
    "moving": "drone in wind, height of the mark told",
    "flat": "drone in wind, mark taken to be on the floor",
}
DIFFERS = (
    "The paper says that four fixed points on the ground make a moving camera a still one, and shows no experiment. "
    "Here the robot of Table 2 drives in MuJoCo under a drone at 5 m that hovers in wind while it is calibrated and "
    "drifts away while it drives; nothing is marked, the floor itself is followed. Its tag is 0.3 m above the floor: "
    "that matters as soon as the camera moves, and is allowed for where the height of the tag and the drone's focal "
    "length are told; its tilt comes from the flight, and its height from the calibration."
)


def figures(runs: Sequence[MovingRun]) -> Document:
    """Sum up flights.

    Parameters
    ----------
    runs : sequence of MovingRun
        One or more.

    Returns
    -------
    document : dict
        Of the JSON object.
    """
    document: Document = {"runs": len(runs)}
    for name in WORDS:
        n = np.array([run.n[name] for run in runs if name in run.n])
        document[name] = {
            "n_rms": float(np.sqrt(np.mean(n**2))) if len(n) else None,
            "n_median": float(np.median(n)) if len(n) else None,
            "refused": len(runs) - len(n),
        }
    for key in ("n_rms", "n_median"):
        still, moving = document["still"][key], document["moving"][key]
        document[f"ratio_of_{key}"] = moving / still if moving is not None and still else None
    goals = [goal for run in runs for goal in run.goals]
    document["goals"] = {
        "driven": len(goals),
        "reached": sum(goal.reached for goal in goals),
        "off_px_mean": float(np.mean([goal.off_px for goal in goals])) if goals else None,
        "off_px_max": max((goal.off_px for goal in goals), default=None),
        "off_m_mean": float(np.mean([goal.off_m for goal in goals])) if goals else None,
        "off_m_max": max((goal.off_m for goal in goals), default=None),
    }
    document["placed_share"] = float(np.mean([run.placed_share for run in runs]))
    document["moved_m"] = max(run.moved_m for run in runs)
    return document


def _compute(work: Work) -> Outcome:
    found: list[MovingRun] = []

    def fly() -> Document:
        from airground.studies.moving_run import moving_options, moving_run  # MuJoCo is loaded late

        count, goals = (1, 1) if work.short else (RUNS, GOALS)
        options = moving_options(work.camera_hz)
        tasks = ((work.seed + k, goals, options) for k in range(count))
        for run in work.workers.map(moving_run, tasks, count, long=True):
            found.append(run)
            if work.progress is not None:
                work.progress(len(found), count)
        return figures(found)

    document: Document = {"paper": dict(PAPER), **or_why_not(fly)}
    if "none" in document:
        return Outcome(document)

    def draw(path: Path) -> None:
        from airground.pictures.moving import draw_moving

        n = {name: [run.n.get(name) for run in found] for name in WORDS}
        draw_moving(path, seen=found[0].uv, stable=found[0].stable_uv, n=n)

    return Outcome(document, draw)


def _sheet(document: Mapping[str, Any]) -> Sheet:
    title = "Moving camera: a drone in wind, calibrated and driven under"
    if "none" in document:
        return Sheet(title, ("",), (), document["none"])
    rows = [
        (
            text,
            _number(document[name]["n_rms"]),
            _number(document[name]["n_median"]),
            str(document[name]["refused"]),
        )
        for name, text in WORDS.items()
    ]
    goals, rms, median = (
        document["goals"],
        document["ratio_of_n_rms"],
        document["ratio_of_n_median"],
    )
    notes = []
    if rms is not None:
        notes.append(
            f"{rms:.2f} times the n of the camera that stands, in the median {median:.2f} times"
        )
    if goals["driven"]:
        notes.append(
            f"{goals['reached']} of {goals['driven']} goals reached while it drifted, off by "
            f"{goals['off_px_mean']:.2f} px and {1000 * goals['off_m_mean']:.1f} mm in the mean, "
            f"{goals['off_px_max']:.2f} px and {1000 * goals['off_m_max']:.1f} mm at most"
        )
    notes.append(
        f"the camera moved by up to {document['moved_m']:.1f} m; {document['placed_share']:.1%} of the pictures could "
        "be placed"
    )
    return Sheet(
        title,
        (f"over {document['runs']} flights", "n_e, rms", "median", "refused"),
        tuple(rows),
        "; ".join(notes),
    )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


MOVING = Item(_compute, _sheet, DIFFERS)
"""Section 4.3."""
