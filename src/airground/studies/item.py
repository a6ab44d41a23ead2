"""What a table or figure of the paper is, to `reproduce`: something to compute, to print and to draw."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from airground.errors import AirgroundError
from airground.studies.sheet import Sheet
from airground.studies.simulation import PAPER, Progress, Trials, run_trials
from airground.studies.whole_drive import WholeDriveTrials, whole_drive_trials
from airground.studies.workers import HERE, Workers

if TYPE_CHECKING:
    from airground.studies.robot_figures import RobotDrives
    from airground.studies.robot_runs import RobotSummary

__all__ = ["ROBOT_RUNS", "Document", "Item", "Outcome", "Work", "or_why_not", "unobservable_note"]

Document = dict[str, Any]
"""A JSON object."""

ROBOT_RUNS = 20
"""Drives of the robot in MuJoCo, as in section 3.2."""


@dataclass(frozen=True)
class Work:
    """What all items of one call share; the simulation is run once, when the first of them asks."""

    trials: int
    """How many."""

    seed: int
    """Of all of them."""

    progress: Progress | None = None
    """Told how far it is."""

    workers: Workers = HERE
    """Who runs the trials."""

    @property
    def short(self) -> bool:
        """Whether so few trials are wanted that the robot in MuJoCo makes do with less too."""
        return self.trials < ROBOT_RUNS

    @property
    def camera_hz(self) -> float:
        """Pictures per second in MuJoCo: half as many where it is short."""
        return 5.0 if self.short else 10.0

    @cached_property
    def simulation(self) -> Trials:
        """Trials of the paper's simulation."""
        return run_trials(
            trials=self.trials, seed=self.seed, progress=self.progress, workers=self.workers
        )

    @cached_property
    def whole_drive(self) -> WholeDriveTrials:
        """Whole-drive estimates of those that have a linear one."""
        return whole_drive_trials(
            self.simulation, PAPER, progress=self.progress, workers=self.workers
        )

    @cached_property
    def robot_runs(self) -> tuple[RobotSummary, ...]:
        """Calibration drives of the robot in MuJoCo: 20, or as many as trials where these are fewer."""
        from airground.studies.robot_runs import robot_summaries  # MuJoCo is loaded late

        runs = min(ROBOT_RUNS, self.trials)
        return robot_summaries(
            runs, self.seed, self.workers, self.progress, camera_hz=self.camera_hz
        )

    @cached_property
    def robot_waves(self) -> RobotDrives:
        """Drives of figure 8 in MuJoCo."""
        from airground.studies.robot_figures import robot_drives

        return robot_drives(self, "wave")

    @cached_property
    def robot_ellipses(self) -> RobotDrives:
        """Drives of figures 9 and 10 in MuJoCo."""
        from airground.studies.robot_figures import robot_drives

        return robot_drives(self, "ellipse")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What an item gives."""

    document: Document
    """Its JSON object."""

    draw: Callable[[Path], None] | None = None
    """Draws it into a PNG, where it is a figure."""


@dataclass(frozen=True, slots=True)
class Item:
    """A table or a figure of the paper."""

    compute: Callable[[Work], Outcome]
    """Runs it."""

    sheet: Callable[[Mapping[str, Any]], Sheet]
    """Table for people, from the JSON object alone."""

    differs: str
    """What differs from the paper and why, in a sentence or two."""


def or_why_not(figures: Callable[[], Document]) -> Document:
    """Compute what not every machine can: MuJoCo may be missing, or may not be able to draw.

    Parameters
    ----------
    figures : callable
        Gives them.

    Returns
    -------
    figures : dict
        Those, or ``{"none": why there are none}``.
    """
    try:
        return figures()
    except AirgroundError as error:
        return {"none": str(error)}


def unobservable_note(document: Mapping[str, Any]) -> str:
    """Say how many trials gave no estimate.

    Parameters
    ----------
    document : mapping
        JSON object of an item.

    Returns
    -------
    note : str
        Empty if all did.
    """
    missing = document.get("unobservable_trials", 0)
    if not missing:
        return ""
    return f"{missing} of {document['trials']} trials leave g undetermined; figures are over the others"
