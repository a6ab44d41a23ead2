"""Figure 11: calibration with random turns, then from goal to goal, clicked at random.

The paper shows one such drive of its ER1 robot and gives no number. Ours are in two worlds: in the embedded one, a
camera tilted by 35 degrees over a robot of 0.12 m/s, sightings with 1 px of noise, odometry and compass; and the robot
of table 2 in MuJoCo, seen by our eyes in rendered pictures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import calibrate
from airground.control.goals.point_to_point import PointToPoint
from airground.errors import UndeterminedError
from airground.geometry import n_error
from airground.geometry.arrays import FloatArray
from airground.sim.recording_noise import RecordingNoise
from airground.sim.recording_plan import RecordingPlan
from airground.sim.recordings import Recording, record
from airground.studies.driving_world import DrivingWorld
from airground.studies.figure_drives import OPTIONS, TOP_MPS
from airground.studies.figure_paths import SPEED_MPS
from airground.studies.item import Document, Item, Outcome, Work, or_why_not
from airground.studies.rig import Drive, Rig
from airground.studies.rig_options import LAG_S, limits_for
from airground.studies.sheet import Sheet
from airground.studies.stage import Known

if TYPE_CHECKING:
    from pathlib import Path

    from airground.pictures.driving import DrivenPanel
    from airground.studies.robot_stage import RobotStage

__all__ = ["FIG11", "GoalDrives", "drive_goals", "random_goals"]

DIFFERS = (
    "The paper shows one drive of its robot and gives no number. Ours is driven twice, after a calibration on a drive "
    "with random turns: in the embedded world, with a tilted camera, and by the robot of Table 2 in MuJoCo, with our "
    "eyes on its pictures; the goals come from the seed, in place of clicks."
)

PLAN = RecordingPlan(
    drive="random_turns",
    tilt_deg=35.0,
    duration_s=None,
    speed_mps=SPEED_MPS,
    height_m=3.0,
    image_size_px=(1024, 768),
)
NOISE = RecordingNoise(
    pixel_px=1.0, speed_mps=0.003, heading_rad=0.02, slip=0.02, time_offset_s=0.05
)
GOALS = 6
FEW_GOALS = 2  # in MuJoCo, where few trials are wanted
APART_M = 0.4
PAPER = {"shown": "the calibration drive, dotted, and the way through goals clicked at random"}


@dataclass(frozen=True, slots=True, eq=False)
class GoalDrives:
    """From goal to goal."""

    goals: FloatArray
    """(K, 2) [px]. As clicked."""

    drives: tuple[Drive, ...]
    """To each of them."""

    off_px: tuple[float, ...]
    """How far from each the robot came to stand, in the image [px]."""

    off_m: tuple[float, ...]
    """The same on the ground [m]."""

    def document(self, n: float) -> Document:
        """Give the JSON object.

        Parameters
        ----------
        n : float
            Of the calibration.

        Returns
        -------
        document : dict
            Goal by goal, and means.
        """
        return {
            "n": n,
            "goals": [
                {
                    "reached": drive.done,
                    "time_s": drive.duration,
                    "goal_error_px": px,
                    "goal_error_m": m,
                }
                for drive, px, m in zip(self.drives, self.off_px, self.off_m, strict=True)
            ],
            "goal_error_px_mean": float(np.mean(self.off_px)),
            "goal_error_m_mean": float(np.mean(self.off_m)),
        }


def random_goals(
    seen: FloatArray, world: DrivingWorld, start_m: FloatArray, rng: np.random.Generator, count: int
) -> FloatArray:
    """Click at random where the robot has been calibrated.

    Parameters
    ----------
    seen : (M, 2) array [px]
        Where it was seen meanwhile.
    world : DrivingWorld
        The truth.
    start_m : (2,) array [m]
        Where it stands.
    rng : Generator
        Of the clicks.
    count : int
        How many.

    Returns
    -------
    uv : (K, 2) array [px]
        Goals, each some way from the one before.
    """
    low, high = seen.min(axis=0), seen.max(axis=0)
    goals: list[FloatArray] = []
    before = start_m
    while len(goals) < count:
        uv = np.round(rng.uniform(low, high))
        xy = world.camera.unproject(world.undistorted(uv))
        if np.hypot(*(xy - before)) > APART_M:
            goals.append(uv)
            before = xy
    return np.stack(goals)


def drive_goals(rig: Rig, known: Known, goals: FloatArray) -> GoalDrives:
    """Drive from goal to goal.

    Parameters
    ----------
    rig : Rig
        With the robot at rest.
    known : Known
        What its pilot was told.
    goals : (K, 2) array [px]
        In raw pixels.

    Returns
    -------
    driven : GoalDrives
        How far off, in truth.
    """
    drives, off = [], []
    for goal in goals:
        to = PointToPoint(rig.floor, known.undistort(goal)[None], rig.limits, response_s=LAG_S)
        drives.append(rig.drive(to, most_s=60.0))
        off.append(rig.stands_off(goal))
    return GoalDrives(goals, tuple(drives), tuple(px for px, _ in off), tuple(m for _, m in off))


def _world(recording: Recording) -> DrivingWorld:
    truth = recording.truth
    x, y = truth.axle.xy[-1].tolist()
    return DrivingWorld(
        "paper",
        camera=truth.camera,
        lens=None,
        ground_uv=recording.tracks.uv[-1],
        start_m=(x, y),
        heading_rad=float(truth.axle.theta[-1]),
        speed_mps=SPEED_MPS,
        clock_offset_s=NOISE.time_offset_s,
    )


@lru_cache(maxsize=1)
def _embedded(seed: int) -> tuple[Recording, float, GoalDrives]:
    recording = record(PLAN, NOISE, seed=np.random.default_rng([seed, 11]))
    calibration = calibrate(recording.tracks, recording.motion, image_size_px=PLAN.image_size_px)
    world, known = _world(recording), Known.of(calibration)
    goals = random_goals(
        recording.tracks.uv,
        world,
        recording.truth.xy[-1],
        np.random.default_rng([seed, 0x60]),
        GOALS,
    )
    rig = Rig(
        world,
        known.model,
        known.covariance,
        limits=limits_for(TOP_MPS),
        options=OPTIONS,
        seed=seed,
        undistorted=known.undistort,
        time_offset_s=known.time_offset_s,
    )
    rig.settle()
    return recording, float(n_error(world.camera.g, known.model)), drive_goals(rig, known, goals)


def _by_robot(stage: RobotStage, count: int) -> GoalDrives:
    if "trajectory" not in stage.known:
        raise UndeterminedError("the calibration drive in MuJoCo left g undetermined")
    known, run = stage.known["trajectory"], stage.run
    world = stage.world_at(run.end.xy, run.end.theta)
    goals = random_goals(
        stage.seen, world, run.end.xy, np.random.default_rng([stage.seed, 0x61]), count
    )
    with stage.rig_at("trajectory", run.end.xy, run.end.theta) as rig:
        return drive_goals(rig, known, goals)


def _compute(work: Work) -> Outcome:
    recording, n, driven = _embedded(work.seed)
    count = FEW_GOALS if work.short else GOALS
    shown: list[tuple[RobotStage, GoalDrives]] = []

    def in_mujoco() -> Document:
        from airground.studies.robot_stage import robot_stage

        stage = robot_stage(work.seed, work.camera_hz)
        found = _by_robot(stage, count)
        shown.append((stage, found))
        return found.document(stage.errors["trajectory"])

    document: Document = {
        "paper": dict(PAPER),
        **driven.document(n),
        "mujoco": or_why_not(in_mujoco),
    }

    def draw(path: Path) -> None:
        from airground.pictures.driving import draw_goals

        panels = [
            _panel(
                "Figure 11: in the embedded world", recording.tracks.uv, driven, PLAN.image_size_px
            )
        ]
        for stage, found in shown:
            panels.append(_panel("The robot in MuJoCo", stage.seen, found, stage.run.image_size_px))
        draw_goals(path, panels)

    return Outcome(document, draw)


def _panel(
    title: str, calibration: FloatArray, found: GoalDrives, size_px: tuple[int, int]
) -> DrivenPanel:
    from airground.pictures.driving import DrivenPanel

    driven = np.concatenate([drive.uv for drive in found.drives])
    return DrivenPanel(title, found.goals, driven, size_px, calibration=calibration)


def _sheet(document: Mapping[str, Any]) -> Sheet:
    robot = document["mujoco"]
    rows = _rows(document, "")
    rows += [] if "none" in robot else _rows(robot, "MuJoCo, ")
    told = robot["none"] if "none" in robot else f"n of that in MuJoCo: {robot['n']:.4f}"
    return Sheet(
        title=f"Figure 11: goals clicked at random, after a calibration with n = {document['n']:.4f}",
        header=("goal", "reached", "after", "off in the image", "on the ground"),
        rows=tuple(rows),
        note=f"the paper shows a picture and gives no number; {told}",
    )


def _rows(document: Mapping[str, Any], where: str) -> list[tuple[str, ...]]:
    rows = [
        (
            f"{where}{k}",
            "yes" if row["reached"] else "no",
            f"{row['time_s']:.1f} s",
            f"{row['goal_error_px']:.2f} px",
            f"{1000 * row['goal_error_m']:.1f} mm",
        )
        for k, row in enumerate(document["goals"], start=1)
    ]
    mean = (f"{where}mean", "", "", f"{document['goal_error_px_mean']:.2f} px")
    return [*rows, (*mean, f"{1000 * document['goal_error_m_mean']:.1f} mm")]


FIG11 = Item(_compute, _sheet, DIFFERS)
"""Figure 11."""
