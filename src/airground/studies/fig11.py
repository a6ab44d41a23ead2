"""Figure 11: calibration with random turns, then from goal to goal, clicked at random.

The paper shows one such drive of its ER1 robot and gives no number. Ours is in the embedded world: a camera tilted by
35 degrees over a robot of 0.12 m/s, sightings with 1 px of noise, odometry and compass.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import calibrate
from airground.control.goals.point_to_point import PointToPoint
from airground.geometry import n_error
from airground.sim.recording_noise import RecordingNoise
from airground.sim.recording_plan import RecordingPlan
from airground.sim.recordings import Recording, record
from airground.studies.driving_world import DrivingWorld
from airground.studies.figure_drives import OPTIONS, SPEED_MPS, TOP_MPS
from airground.studies.item import Document, Item, Outcome, Work
from airground.studies.rig import Drive, Rig
from airground.studies.rig_options import LAG_S, limits_for
from airground.studies.sheet import Sheet

if TYPE_CHECKING:
    from pathlib import Path

    from airground.geometry.arrays import FloatArray

__all__ = ["FIG11", "random_goals"]

DIFFERS = (
    "The paper shows one drive of its robot and gives no number. Ours is in a simulated world with a tilted "
    "camera, and is calibrated on a recorded drive with random turns; the goals come from the seed, in place of "
    "clicks."
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
APART_M = 0.4
PAPER = {"shown": "the calibration drive, dotted, and the way through goals clicked at random"}


def random_goals(recording: Recording, rng: np.random.Generator) -> FloatArray:
    """Click at random where the robot has been calibrated.

    Parameters
    ----------
    recording : Recording
        Of the calibration drive.
    rng : Generator
        Of the clicks.

    Returns
    -------
    uv : (K, 2) array [px]
        Goals, each some way from the one before.
    """
    camera, seen = recording.truth.camera, recording.tracks.uv
    low, high = seen.min(axis=0), seen.max(axis=0)
    goals: list[FloatArray] = []
    while len(goals) < GOALS:
        uv = rng.uniform(low, high)
        before = camera.unproject(goals[-1]) if goals else recording.truth.xy[-1]
        if np.hypot(*(camera.unproject(uv) - before)) > APART_M:
            goals.append(np.round(uv))
    return np.stack(goals)


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


def _compute(work: Work) -> Outcome:
    recording = record(PLAN, NOISE, seed=np.random.default_rng([work.seed, 11]))
    calibration = calibrate(recording.tracks, recording.motion, image_size_px=PLAN.image_size_px)
    goals = random_goals(recording, np.random.default_rng([work.seed, 0x60]))
    world = _world(recording)
    rig = Rig(
        world,
        calibration.model,
        calibration.covariance,
        limits=limits_for(TOP_MPS),
        options=OPTIONS,
        seed=work.seed,
        time_offset_s=calibration.time_offset_s,
    )
    rig.settle()
    drives: list[Drive] = []
    rows: list[dict[str, float | bool]] = []
    for goal in goals:
        to = PointToPoint(rig.floor, goal[None], rig.limits, response_s=LAG_S)
        drive = rig.drive(to, most_s=60.0)
        off_px, off_m = rig.stands_off(goal)
        drives.append(drive)
        rows.append(
            {
                "reached": drive.done,
                "time_s": drive.duration,
                "goal_error_px": off_px,
                "goal_error_m": off_m,
            }
        )
    document: Document = {
        "paper": dict(PAPER),
        "n": float(n_error(world.camera.g, calibration.model)),
        "goals": rows,
        "goal_error_px_mean": float(np.mean([row["goal_error_px"] for row in rows])),
        "goal_error_m_mean": float(np.mean([row["goal_error_m"] for row in rows])),
    }

    def draw(path: Path) -> None:
        from airground.pictures.driving import draw_goals

        draw_goals(
            path,
            size_px=PLAN.image_size_px,
            calibration=recording.tracks.uv,
            driven=np.concatenate([drive.uv for drive in drives]),
            goals=goals,
            title="Figure 11: calibrate, then from goal to goal",
        )

    return Outcome(document, draw)


def _sheet(document: Mapping[str, Any]) -> Sheet:
    rows = [
        (
            str(k),
            "yes" if row["reached"] else "no",
            f"{row['time_s']:.1f} s",
            f"{row['goal_error_px']:.2f} px",
            f"{1000 * row['goal_error_m']:.1f} mm",
        )
        for k, row in enumerate(document["goals"], start=1)
    ]
    mean = ("mean", "", "", f"{document['goal_error_px_mean']:.2f} px")
    return Sheet(
        title=f"Figure 11: goals clicked at random, after a calibration with n = {document['n']:.4f}",
        header=("goal", "reached", "after", "off in the image", "on the ground"),
        rows=(*rows, (*mean, f"{1000 * document['goal_error_m_mean']:.1f} mm")),
        note="the paper shows a picture and gives no number",
    )


FIG11 = Item(_compute, _sheet, DIFFERS)
"""Figure 11."""
