"""Figure 7: the robot as the camera sees it, and the path that it traced during a calibration drive."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.errors import AirgroundError
from airground.sim3d.world import World3d
from airground.studies.item import Document, Item, Outcome, Work
from airground.studies.robot_runs import LENS, OPTIONS
from airground.studies.sheet import Sheet
from airground.studies.table2 import typical_run

if TYPE_CHECKING:
    from pathlib import Path

    from airground.vision.frame import ImageArray

__all__ = ["FIG7"]

FILMED_S = 0.5
DIFFERS = (
    "The paper shows a photograph and the path by its tracker. Ours is a picture of the MuJoCo camera, and the path of "
    "the tag as our tracker saw it, brought to the ground by the survey: eight segments, 30 degrees apart."
)


def _compute(work: Work) -> Outcome:
    try:
        run = typical_run(work.robot_runs)
        with World3d(OPTIONS, run.seed) as world:
            world.advance(FILMED_S)
            image: ImageArray = world.frames(world.now)[-1].image
    except AirgroundError as error:
        return Outcome({"paper": {"shown": "view and path"}, "none": str(error)})
    uv = LENS.distort(run.uv)
    steps = np.hypot(*np.diff(run.xy, axis=0).T)
    document: Document = {
        "paper": {"shown": "the camera's view and the path"},
        "seed": run.seed,
        "sightings": len(run.uv),
        "length_m": float(steps.sum()),
        "extent_m": [float(v) for v in np.ptp(run.xy, axis=0)],
    }

    def draw(path: Path) -> None:
        from airground.pictures.robot_drive import draw_robot_drive

        draw_robot_drive(path, image=image, uv=uv, xy=run.xy)

    return Outcome(document, draw)


def _sheet(document: Mapping[str, Any]) -> Sheet:
    if "none" in document:
        return Sheet("Figure 7: no robot was driven", ("",), (), document["none"])
    width, depth = document["extent_m"]
    rows = (
        ("sightings", str(document["sightings"])),
        ("length of the path", f"{document['length_m']:.2f} m"),
        ("its extent", f"{width:.2f} m x {depth:.2f} m"),
    )
    return Sheet(f"Figure 7: the drive of seed {document['seed']}", ("", "ours"), rows)


FIG7 = Item(_compute, _sheet, DIFFERS)
"""Figure 7."""
