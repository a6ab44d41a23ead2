"""Figures 9 and 10: an ellipse on the ground, followed from off it, and the velocities of that drive.

What is wanted is an ellipse in the real world. A robot that only knows an estimate of g makes of it what that g says,
so the ellipse itself is a little wrong, beside how well it is followed. Both are told.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.control.trajectories.flat_tracker import FlatTracker
from airground.control.trajectories.trajectory import GroundEllipse
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.fig8 import convergence_sheet
from airground.studies.figure_drives import (
    SPEED_MPS,
    Models,
    Tracked,
    convergence,
    paper_models,
    paper_rig,
    paper_world,
)
from airground.studies.item import Document, Item, Outcome, Work
from airground.studies.rig_options import LAG_S
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from pathlib import Path

    from airground.geometry import LimitedHomography
    from airground.geometry.arrays import FloatArray

__all__ = ["FIG9", "FIG10"]

DIFFERS_9 = (
    "The paper shows one drive and gives no number. The wanted ellipse is one on the ground: a robot that knows "
    "an estimate of g follows the ellipse that this g draws, and the last column is what that costs; the others "
    "are as in Figure 8."
)
DIFFERS_10 = (
    "The paper shows the curves and gives no number. Ours settle to the two waves a round that an ellipse asks "
    "for, after the turn at the start and the run to catch up; our robot's limit is 0.2 m/s."
)

START_UV = np.array([760.0, 610.0])
HEADING_RAD = 2.2
CENTRE_UV = np.array([511.5, 400.0])
SEMI_M = (0.75, 0.45)
ANGLE_RAD = 0.4
TURNS = 1.5
PAPER9 = {"shown": "one ellipse on the ground, and a path that comes to it from inside or outside"}
PAPER10 = {"shown": "forward and angular velocity over time: both settle to what the ellipse asks"}


@dataclass(frozen=True, slots=True, eq=False)
class _Ellipses:
    """The drives that both figures show."""

    models: Models
    """What was driven with."""

    drives: dict[str, Tracked]
    """What was driven."""

    wanted: FloatArray
    """(N, 2) [m]. The true ellipse."""

    shape_m: dict[str, float]
    """Distance of what was driven, once it had settled, from the true ellipse [m]."""


@lru_cache(maxsize=2)
def _ellipses(seed: int) -> _Ellipses:
    models = paper_models(seed)
    world = paper_world(START_UV, HEADING_RAD)
    phi = np.linspace(0, 2 * np.pi, 1500)
    cos, sin = np.cos(ANGLE_RAD), np.sin(ANGLE_RAD)
    flat = np.column_stack([SEMI_M[0] * np.cos(phi), SEMI_M[1] * np.sin(phi)])
    wanted = world.camera.unproject(CENTRE_UV) + flat @ np.array([[cos, sin], [-sin, cos]])
    drives, shape = {}, {}
    for name, model in models.items():
        tracked = _drive(model, seed)
        drives[name] = tracked
        half = len(tracked.drive.t) // 2
        shape[name] = rms(distance_to_line(tracked.drive.xy[half:], wanted))
    return _Ellipses(models, drives, wanted, shape)


def _drive(model: LimitedHomography, seed: int) -> Tracked:
    world = paper_world(START_UV, HEADING_RAD)
    rig = paper_rig(world, model, seed)
    a, b = SEMI_M
    around = np.pi * (3 * (a + b) - np.sqrt((3 * a + b) * (a + 3 * b)))  # Ramanujan
    ellipse = GroundEllipse(
        rig.floor, CENTRE_UV, SEMI_M, float(around / SPEED_MPS), ANGLE_RAD, turns=TURNS
    )
    tracker = FlatTracker(rig.floor, ellipse, rig.limits, response_s=LAG_S)
    drive = rig.drive(tracker, most_s=1.5 * ellipse.duration + 20)
    line = np.stack([ellipse.at(t)[0] for t in np.linspace(0, ellipse.period, 1500)])
    return Tracked(
        drive,
        distance_to_line(drive.uv, line),
        distance_to_line(drive.xy, world.camera.unproject(line)),
    )


def _compute9(work: Work) -> Outcome:
    found = _ellipses(work.seed)
    document: Document = {
        "paper": dict(PAPER9),
        "n": found.models.errors(),
        **convergence(found.drives),
        "ellipse_rms_m": found.shape_m,
    }

    def draw(path: Path) -> None:
        from airground.pictures.driving import draw_ground_path

        shown = found.drives["trajectory"].drive
        draw_ground_path(
            path,
            wanted=found.wanted,
            driven=shown.xy,
            heading=shown.xy[0] + 0.25 * np.array([np.cos(shown.theta[0]), np.sin(shown.theta[0])]),
            title="Figure 9: an ellipse on the ground",
        )

    return Outcome(document, draw)


def _compute10(work: Work) -> Outcome:
    shown = _ellipses(work.seed).drives["trajectory"].drive
    half = len(shown.t) // 2
    document: Document = {
        "paper": dict(PAPER10),
        "v_max_mps": float(shown.v.max()),
        "v_min_mps": float(shown.v.min()),
        "omega_max_radps": float(np.abs(shown.omega).max()),
        "settled_v_mps": float(shown.v[half:-40].mean()),
        "settled_omega_radps": float(shown.omega[half:-40].mean()),
    }

    def draw(path: Path) -> None:
        from airground.pictures.driving import draw_velocities

        draw_velocities(
            path,
            t=shown.t - shown.t[0],
            v=shown.v,
            omega=shown.omega,
            title="Figure 10: velocities of the drive of figure 9",
        )

    return Outcome(document, draw)


def _sheet9(document: Mapping[str, Any]) -> Sheet:
    sheet = convergence_sheet("Figure 9: an ellipse on the ground", document)
    off = [
        f"{100 * document['ellipse_rms_m'][key]:.1f} cm"
        for key in ("linear", "trajectory", "oracle")
    ]
    return Sheet(
        sheet.title,
        (*sheet.header, "from the true ellipse"),
        tuple((*row, value) for row, value in zip(sheet.rows, off, strict=True)),
        sheet.note,
    )


def _sheet10(document: Mapping[str, Any]) -> Sheet:
    d = document
    return Sheet(
        title="Figure 10: velocities of the drive of figure 9, with whole-drive g",
        header=("", "smallest", "largest", "mean once on it"),
        rows=(
            (
                "forward",
                f"{d['v_min_mps']:.3f} m/s",
                f"{d['v_max_mps']:.3f} m/s",
                f"{d['settled_v_mps']:.3f} m/s",
            ),
            (
                "angular",
                "",
                f"{d['omega_max_radps']:.2f} rad/s",
                f"{d['settled_omega_radps']:.3f} rad/s",
            ),
        ),
        note="the paper shows a picture and gives no number",
    )


FIG9 = Item(_compute9, _sheet9, DIFFERS_9)
"""Figure 9."""

FIG10 = Item(_compute10, _sheet10, DIFFERS_10)
"""Figure 10."""
