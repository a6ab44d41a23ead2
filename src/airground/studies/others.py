"""Robots in the scene that are not ours: their speeds as measured after each drive of table 2, beside the truth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from airground.studies.item import Document, Item, Outcome, Work, or_why_not
from airground.studies.other_speeds import OtherSpeeds
from airground.studies.sheet import Sheet

__all__ = ["OTHERS"]

DIFFERS = (
    "The paper measures no other vehicle. In the MuJoCo world of Table 2 somebody else's cart goes round by a route at "
    "0.2 m/s and tells us nothing; its speed comes from its tag's track and the calibration of our robot's drive, "
    "its error bar from both. It brakes and turns on the spot at each corner: at ten pictures a second its speed "
    "between two of them is anybody's guess, and the error bar there says so."
)
UNDER_WAY_MPS = 0.1  # half the cart's speed
AT_SPEED = 0.95  # of the cart's speed


def _compute(work: Work) -> Outcome:
    return Outcome({"paper": {"shown": "nothing"}, **or_why_not(lambda: _figures(work))})


def _figures(work: Work) -> Document:
    runs = work.robot_runs
    speeds = OtherSpeeds.joined([run.others for run in runs])
    usual = max((float(run.others.true.max()) for run in runs if len(run.others.true)), default=0.0)
    return {
        "all": speeds.scored(),
        "under_way": speeds.faster_than(UNDER_WAY_MPS).scored(),
        "at_speed": speeds.faster_than(AT_SPEED * usual).scored(),
        "runs": len(runs),
    }


def _sheet(document: Mapping[str, Any]) -> Sheet:
    title = "Other vehicles: speeds measured with what our robot's drive calibrated"
    if "none" in document:
        return Sheet(title, ("",), (), document["none"])
    words = {
        "at_speed": "at its speed",
        "under_way": "starting and braking too",
        "all": "and standing",
    }
    return Sheet(
        title,
        ("cart", "sightings", "error, rms", "of the speed", "within the stated 95 %"),
        tuple(_row(text, document[key]) for key, text in words.items()),
        f"over {document['runs']} drives; the paper measures none",
    )


def _row(text: str, one: Mapping[str, Any]) -> tuple[str, ...]:
    if not one["sightings"]:
        return (text, "0", "-", "-", "-")
    return (
        text,
        str(one["sightings"]),
        f"{1000 * one['rms_mps']:.1f} mm/s",
        f"{one['rms_share']:.1%}",
        f"{one['inside_share']:.1%}",
    )


OTHERS = Item(_compute, _sheet, DIFFERS)
"""Speeds of vehicles that are not ours."""
