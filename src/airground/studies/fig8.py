"""Figure 8: a robot that starts off a trajectory in the image comes to it and follows it.

The paper shows one run and no number. Ours: a wave across the image, driven with g as the paper's own simulated
calibration finds it, by its linear method and from the whole drive, and with the true g.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.control import Floor
from airground.control.trajectories.flat_tracker import FlatTracker
from airground.control.trajectories.spline import SplineTrajectory, times_at_speed
from airground.studies.drive_measures import distance_to_line
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

__all__ = ["FIG8", "convergence_sheet", "drive_wave", "wave"]

DIFFERS = (
    "The paper shows one drive and gives no number, no noise and no limits. Ours sees 100 ms late with noise, "
    "lags and slips, and is driven with three g: since the feedback is in the image, a wrong g does not keep the "
    "robot off the path; it costs a steady lag."
)

START_UV = np.array([300.0, 640.0])
HEADING_RAD = 2.6
PAPER = {"shown": "one path in the image: off the wanted one at the start, then on it"}
NAMES = (("linear", "linear g"), ("trajectory", "whole-drive g"), ("oracle", "true g"))


def wave() -> FloatArray:
    """Points of the wanted path.

    Returns
    -------
    uv : (N, 2) array [px]
        A wave of one and a half periods, from left to right.
    """
    u = np.linspace(180.0, 860.0, 18)
    return np.column_stack([u, 380.0 + 110.0 * np.sin((u - 180.0) / 680.0 * 3 * np.pi)])


def drive_wave(truth: LimitedHomography, model: LimitedHomography, seed: int) -> Tracked:
    """Drive along the wave.

    Parameters
    ----------
    truth : LimitedHomography
        Gives the trajectory its times: the same for all.
    model : LimitedHomography
        What the pilot is given.
    seed : int
        Of the noise.

    Returns
    -------
    tracked : Tracked
        What was driven, and how far off.
    """
    world = paper_world(START_UV, HEADING_RAD)
    points = wave()
    times = times_at_speed(Floor(truth, world.ground_uv), points, SPEED_MPS)
    trajectory = SplineTrajectory(points, times)
    rig = paper_rig(world, model, seed)
    tracker = FlatTracker(rig.floor, trajectory, rig.limits, response_s=LAG_S)
    drive = rig.drive(tracker, most_s=2 * trajectory.duration + 30)
    line = np.stack([trajectory.at(t)[0] for t in np.linspace(0, trajectory.duration, 1500)])
    return Tracked(
        drive,
        distance_to_line(drive.uv, line),
        distance_to_line(drive.xy, world.camera.unproject(line)),
    )


@lru_cache(maxsize=2)
def _drives(seed: int) -> tuple[Models, dict[str, Tracked]]:
    models = paper_models(seed)
    return models, {name: drive_wave(models.truth, g, seed) for name, g in models.items()}


def _compute(work: Work) -> Outcome:
    models, drives = _drives(work.seed)
    document: Document = {"paper": dict(PAPER), "n": models.errors(), **convergence(drives)}

    def draw(path: Path) -> None:
        from airground.pictures.driving import draw_image_path

        shown = drives["trajectory"].drive
        ahead = shown.xy[0] + 0.25 * np.array([np.cos(shown.theta[0]), np.sin(shown.theta[0])])
        world = paper_world(START_UV, HEADING_RAD)
        points = wave()
        times = times_at_speed(Floor(models.truth, world.ground_uv), points, SPEED_MPS)
        wanted = SplineTrajectory(points, times)
        draw_image_path(
            path,
            size_px=world.camera.image_size_px,
            wanted=np.stack([wanted.at(t)[0] for t in np.linspace(0, times[-1], 400)]),
            driven=shown.uv,
            heading=world.camera.project(ahead),
            title="Figure 8: from off the path onto it, in the image",
        )

    return Outcome(document, draw)


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
    rows = []
    for key, name in NAMES:
        one = document[key]
        settled = f"{one['settle_s']:.1f} s" if one["settled"] else "never"
        n = document["n"].get(key)
        rows.append(
            (
                name,
                "0" if n is None else f"{n:.3f}",
                f"{one['start_error_px']:.0f} px",
                settled,
                f"{one['path_rms_px']:.2f} px",
                f"{100 * one['path_rms_m']:.2f} cm",
            )
        )
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
        note="the paper shows a picture and gives no number",
    )


def _sheet(document: Mapping[str, Any]) -> Sheet:
    return convergence_sheet("Figure 8: onto a path in the image", document)


FIG8 = Item(_compute, _sheet, DIFFERS)
"""Figure 8."""
