"""Figures 8 to 11 in MuJoCo: the drives of all pilots, side by side on all cores."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from airground.studies.figure_paths import drive_ellipse, drive_wave
from airground.studies.robot_stage import robot_stage

if TYPE_CHECKING:
    from collections.abc import Mapping

    from airground.studies.figure_paths import Tracked
    from airground.studies.item import Work
    from airground.studies.robot_stage import RobotStage

__all__ = ["RobotDrives", "one_drive", "robot_drives"]

FIGURES = {"wave": drive_wave, "ellipse": drive_ellipse}


@dataclass(frozen=True, slots=True, eq=False)
class RobotDrives:
    """Drives of one figure."""

    stage: RobotStage
    """Where."""

    drives: Mapping[str, Tracked]
    """By what the pilot was told."""


def robot_drives(work: Work, figure: str) -> RobotDrives:
    """Drive a figure with all that is known, or with the whole drive's g alone where few trials are wanted.

    Parameters
    ----------
    work : Work
        Seed, workers and how much.
    figure : str
        Of `FIGURES`.

    Returns
    -------
    drives : RobotDrives
        The estimates first.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    UnreachableError
        If it cannot draw here.
    """
    stage = robot_stage(work.seed, work.camera_hz)
    names = [name for name in stage.known if not work.short or name == "trajectory"]
    tasks = ((stage, figure, name) for name in names)
    drives: dict[str, Tracked] = {}
    for name, tracked in zip(
        names, work.workers.map(one_drive, tasks, len(names), long=True), strict=True
    ):
        drives[name] = tracked
        if work.progress is not None:
            work.progress(len(drives), len(names))
    return RobotDrives(stage, drives)


def one_drive(stage: RobotStage, figure: str, name: str) -> Tracked:
    """Drive once.

    Parameters
    ----------
    stage : RobotStage
        Where.
    figure : str
        Of `FIGURES`.
    name : str
        Of what the pilot is told.

    Returns
    -------
    tracked : Tracked
        What was driven, and how far off.
    """
    return FIGURES[figure](stage, name)
