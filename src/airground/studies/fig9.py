"""Figures 9 and 10: an ellipse on the ground, followed from off it, and the velocities of that drive.

What is wanted is an ellipse in the real world. A robot that only knows an estimate of g makes of it what that g says,
so the ellipse itself is a little wrong, beside how well it is followed. Both are told.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.fig8 import NAMES, ahead, convergence_sheet
from airground.studies.figure_drives import paper_stage
from airground.studies.figure_paths import convergence, drive_ellipse, true_ellipse
from airground.studies.item import Document, Item, Outcome, Work, or_why_not
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from pathlib import Path

    from airground.pictures.driving import DrivenPanel
    from airground.studies.figure_paths import Tracked
    from airground.studies.rig import Drive
    from airground.studies.stage import Stage

__all__ = ["FIG9", "FIG10"]

DIFFERS_9 = (
    "The paper shows one drive and gives no number. Ours, as in Figure 8, is driven in two worlds. The wanted ellipse "
    "is one on the ground: a robot that knows an estimate of g follows the ellipse that this g draws, and the last "
    "column is what that costs; the others are as in Figure 8."
)
DIFFERS_10 = (
    "The paper shows the curves and gives no number. Ours settle to the two waves a round that an ellipse asks "
    "for, after the turn at the start and the run to catch up; our robot's limit is 0.2 m/s."
)

PAPER9 = {"shown": "one ellipse on the ground, and a path that comes to it from inside or outside"}
PAPER10 = {"shown": "forward and angular velocity over time: both settle to what the ellipse asks"}


@lru_cache(maxsize=2)
def _ellipses(seed: int) -> dict[str, Tracked]:
    stage = paper_stage(seed)
    return {name: drive_ellipse(stage, name) for name in stage.known}


def _figures9(stage: Stage, drives: Mapping[str, Tracked]) -> Document:
    wanted = true_ellipse(stage)
    shape = {}
    for name, tracked in drives.items():
        half = len(tracked.drive.t) // 2
        shape[name] = rms(distance_to_line(tracked.drive.xy[half:], wanted))
    return {"n": dict(stage.errors), **convergence(drives), "ellipse_rms_m": shape}


def _compute9(work: Work) -> Outcome:
    stage, drives = paper_stage(work.seed), _ellipses(work.seed)
    document: Document = {
        "paper": dict(PAPER9),
        **_figures9(stage, drives),
        "mujoco": or_why_not(
            lambda: _figures9(work.robot_ellipses.stage, work.robot_ellipses.drives)
        ),
    }

    def draw(path: Path) -> None:
        from airground.pictures.driving import draw_ground_paths

        panels = [_panel("Figure 9: under Table 1's camera", stage, drives)]
        if "none" not in document["mujoco"]:
            found = work.robot_ellipses
            panels.append(_panel("The robot in MuJoCo", found.stage, found.drives))
        draw_ground_paths(path, panels)

    return Outcome(document, draw)


def _panel(title: str, stage: Stage, drives: Mapping[str, Tracked]) -> DrivenPanel:
    from airground.pictures.driving import DrivenPanel

    shown = drives["trajectory"].drive
    return DrivenPanel(title, true_ellipse(stage), shown.xy, heading=ahead(shown))


def _figures10(shown: Drive) -> Document:
    half = len(shown.t) // 2
    return {
        "v_max_mps": float(shown.v.max()),
        "v_min_mps": float(shown.v.min()),
        "omega_max_radps": float(np.abs(shown.omega).max()),
        "settled_v_mps": float(shown.v[half:-40].mean()),
        "settled_omega_radps": float(shown.omega[half:-40].mean()),
    }


def _compute10(work: Work) -> Outcome:
    drives = {"embedded world": _ellipses(work.seed)["trajectory"].drive}
    document: Document = {
        "paper": dict(PAPER10),
        **_figures10(drives["embedded world"]),
        "mujoco": or_why_not(lambda: _figures10(work.robot_ellipses.drives["trajectory"].drive)),
    }

    def draw(path: Path) -> None:
        from airground.pictures.driving import draw_velocities

        if "none" not in document["mujoco"]:
            drives["MuJoCo"] = work.robot_ellipses.drives["trajectory"].drive
        draw_velocities(
            path,
            {name: (one.t - one.t[0], one.v, one.omega) for name, one in drives.items()},
            title="Figure 10: velocities of the drive of figure 9",
        )

    return Outcome(document, draw)


def _sheet9(document: Mapping[str, Any]) -> Sheet:
    sheet = convergence_sheet("Figure 9: an ellipse on the ground", document)
    off = [
        f"{100 * world['ellipse_rms_m'][key]:.1f} cm"
        for world in (document, document["mujoco"])
        for key, _ in NAMES
        if key in world
    ]
    return Sheet(
        sheet.title,
        (*sheet.header, "from the true ellipse"),
        tuple((*row, value) for row, value in zip(sheet.rows, off, strict=True)),
        sheet.note,
    )


def _sheet10(document: Mapping[str, Any]) -> Sheet:
    robot = document["mujoco"]
    rows = _rows10(document, "")
    rows += [] if "none" in robot else _rows10(robot, "MuJoCo, ")
    missing = f"; {robot['none']}" if "none" in robot else ""
    return Sheet(
        title="Figure 10: velocities of the drive of figure 9, with whole-drive g",
        header=("", "smallest", "largest", "mean once on it"),
        rows=tuple(rows),
        note=f"the paper shows a picture and gives no number{missing}",
    )


def _rows10(d: Mapping[str, Any], where: str) -> list[tuple[str, ...]]:
    return [
        (
            f"{where}forward",
            f"{d['v_min_mps']:.3f} m/s",
            f"{d['v_max_mps']:.3f} m/s",
            f"{d['settled_v_mps']:.3f} m/s",
        ),
        (
            f"{where}angular",
            "",
            f"{d['omega_max_radps']:.2f} rad/s",
            f"{d['settled_omega_radps']:.3f} rad/s",
        ),
    ]


FIG9 = Item(_compute9, _sheet9, DIFFERS_9)
"""Figure 9."""

FIG10 = Item(_compute10, _sheet10, DIFFERS_10)
"""Figure 10."""
