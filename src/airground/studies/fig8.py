"""Figure 8: a robot that starts off a trajectory in the image comes to it and follows it.

The paper shows one run and no number. Ours: a wave across the image, driven with g by the linear method and from the
whole drive, and with the true g; in the embedded world and by the robot in MuJoCo.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.studies.figure_drives import paper_stage
from airground.studies.figure_paths import convergence, drive_wave, wave_line
from airground.studies.item import Document, Item, Outcome, Work, or_why_not
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from pathlib import Path

    from airground.geometry.arrays import FloatArray
    from airground.pictures.driving import DrivenPanel
    from airground.studies.figure_paths import Tracked
    from airground.studies.rig import Drive
    from airground.studies.stage import Stage

__all__ = ["FIG8", "NAMES", "ahead", "convergence_sheet"]

DIFFERS = (
    "The paper shows one drive and gives no number, no noise and no limits. Ours is driven twice: under Table 1's "
    "camera in the embedded world, 100 ms late with noise, lags and slips, with g as the paper's own simulated "
    "calibration finds it; and by the robot of Table 2 in MuJoCo, with our eyes on its pictures, with what its own "
    "calibration drive gave. Since the feedback is in the image, a wrong g does not keep the robot off the path; it "
    "costs a steady lag."
)

PAPER = {"shown": "one path in the image: off the wanted one at the start, then on it"}
NAMES = (("linear", "linear g"), ("trajectory", "whole-drive g"), ("oracle", "true g"))


def _compute(work: Work) -> Outcome:
    stage = paper_stage(work.seed)
    drives = {name: drive_wave(stage, name) for name in stage.known}
    document: Document = {
        "paper": dict(PAPER),
        "n": dict(stage.errors),
        **convergence(drives),
        "mujoco": or_why_not(lambda: _in_mujoco(work)),
    }

    def draw(path: Path) -> None:
        from airground.pictures.driving import draw_image_paths

        panels = [_panel("Figure 8: Table 1's camera", stage, drives)]
        if "none" not in document["mujoco"]:
            found = work.robot_waves
            panels.append(_panel("The robot in MuJoCo", found.stage, found.drives))
        draw_image_paths(path, panels)

    return Outcome(document, draw)


def _in_mujoco(work: Work) -> Document:
    found = work.robot_waves
    return {"n": dict(found.stage.errors), **convergence(found.drives)}


def _panel(title: str, stage: Stage, drives: Mapping[str, Tracked]) -> DrivenPanel:
    from airground.pictures.driving import DrivenPanel

    shown, layout = drives["trajectory"].drive, stage.layout
    world = stage.world(layout.wave_start_uv, layout.wave_heading_rad)
    return DrivenPanel(
        title,
        wave_line(stage),
        shown.uv,
        world.camera.image_size_px,
        world.distorted(world.camera.project(ahead(shown))),
    )


def ahead(drive: Drive) -> FloatArray:
    """A point ahead of the robot at its start.

    Parameters
    ----------
    drive : Drive
        What was driven.

    Returns
    -------
    xy : (2,) array [m]
        A quarter of a metre on.
    """
    theta = float(drive.theta[0])
    return np.asarray(drive.xy[0] + 0.25 * np.array([np.cos(theta), np.sin(theta)]))


def convergence_sheet(title: str, document: Mapping[str, Any]) -> Sheet:
    """Table of figures that `convergence` gives.

    Parameters
    ----------
    title : str
        Above it.
    document : mapping
        JSON object of the item.

    Returns
    -------
    sheet : Sheet
        A row for each g.
    """
    rows = [_row(document, key, name) for key, name in NAMES]
    robot = document["mujoco"]
    rows += [_row(robot, key, f"MuJoCo, {name}") for key, name in NAMES if key in robot]
    missing = f"; {robot['none']}" if "none" in robot else ""
    return Sheet(
        title=title,
        header=(
            "driven with",
            "n",
            "off at the start",
            "within 8 px after",
            "then rms",
            "on the ground",
        ),
        rows=tuple(rows),
        note=f"the paper shows a picture and gives no number{missing}",
    )


def _row(document: Mapping[str, Any], key: str, name: str) -> tuple[str, ...]:
    one, n = document[key], document["n"].get(key)
    px, m = one["path_rms_px"], one["path_rms_m"]
    return (
        name,
        "0" if n is None else f"{n:.3f}",
        f"{one['start_error_px']:.0f} px",
        f"{one['settle_s']:.1f} s" if one["settled"] else "never",
        "-" if px is None else f"{px:.2f} px",
        "-" if m is None else f"{100 * m:.2f} cm",
    )


def _sheet(document: Mapping[str, Any]) -> Sheet:
    return convergence_sheet("Figure 8: onto a path in the image", document)


FIG8 = Item(_compute, _sheet, DIFFERS)
"""Figure 8."""
