"""The paper's robot experiment (section 3.2) in MuJoCo: eight segments, turns by the compass, our eyes on its pictures.

``python -m airground.studies.robot_run --runs 5`` prints n_e (eq. 23) of both methods. Calibration is given encoders,
compass and pictures; the truth is surveyed. Before the drive the compass is swung, as any compass should be: left in,
iron of two per cent of the earth's field makes n_e 0.05, as large as the paper's own.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import Motion, Tracks, calibrate
from airground.errors import UndeterminedError
from airground.geometry import align_rotation, n_error
from airground.geometry.arrays import FloatArray
from airground.sim3d.backend import drawn_by
from airground.sim3d.options import FAMILY, CameraOptions3d, World3dOptions
from airground.sim3d.survey import Survey, survey
from airground.sim3d.vehicle import TRUTH_HZ
from airground.sim3d.world import World3d
from airground.studies.rig_body import BodyPose
from airground.studies.robot_driver import RobotDriver, paper_headings
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.tracker import Tracker, TrackRecorder
from airground.vision.video_tracks import track_video

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from airground.studies.compass_swing import CompassSwing
    from airground.vision.frame import Frame

__all__ = ["CAMERA_HZ", "RobotRun", "calibration_run", "main", "run_errors"]

CAMERA_HZ = 10.0
"""Pictures per second: half the world's own, so that a run takes half the time."""

METHODS = {
    "trajectory": {"method": "trajectory", "distortion": "division"},  # a real camera has a lens
    "auto": {"method": "trajectory", "distortion": "auto"},
    "no lens": {"method": "trajectory", "distortion": "none"},
    "linear": {"method": "linear"},
}
"""How each column is calibrated; the paper's method knows no lens."""


@dataclass(frozen=True, slots=True, eq=False)
class RobotRun:
    """A calibration drive."""

    tracks: Tracks
    """Sightings of all tags, by the names of their bearers."""

    motion: Motion
    """Compass and encoders of the robot."""

    truth: Survey
    """Of the plane of the tags."""

    compass: CompassSwing
    """What the robot's compass was found to read too much; the motion is without it."""

    others: dict[str, FloatArray]
    """(M, 2) [s, m/s] by name. True speeds of vehicles that are not ours, at the stamps of the pictures."""

    end: BodyPose
    """Where the robot stands at the end, in truth."""

    image_size_px: tuple[int, int]
    """Width and height [px]."""

    duration_s: float
    """Of the drive [s]."""


def calibration_run(
    seed: int,
    options: World3dOptions | None = None,
    *,
    swing: bool = True,
    headings: Sequence[float] | None = None,
) -> RobotRun:
    """Drive segments with turns between them, and film it.

    Parameters
    ----------
    seed : int
        Of the world.
    options : World3dOptions, optional
        Of the world; its first robot is driven. The defaults with ten pictures a second where not given.
    swing : bool
        Whether the compass is swung before.
    headings : sequence of float, optional [rad]
        Of the segments, from the first; the paper's eight, 30 degrees apart, where not given.

    Returns
    -------
    run : RobotRun
        What calibration may use, and the truth.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    UnreachableError
        If it cannot draw here.
    """
    options = options or World3dOptions(camera=CameraOptions3d(rate_hz=CAMERA_HZ))
    robot = options.robots[0]
    names = {str(one.tag): one.name for one in options.vehicles}
    with World3d(options, seed) as world:
        drive = RobotDriver(world, robot.name)
        if swing:
            drive.swing()
        eyes = Eyes(make_detector(f"tag:family={FAMILY}"), Tracker())
        true: dict[str, list[tuple[float, float]]] = {other.name: [] for other in options.others}
        frames = _watched(world, drive.segments(headings or paper_headings()), true)
        tracks = track_video(frames, eyes, TrackRecorder()).tracks
        truth = survey(world, robot.options.tag_height_m)
        heard = drive.heard
        duration = world.now
        end = world.truth(robot.name, round(world.now * TRUTH_HZ) / TRUTH_HZ)
    tracks = replace(tracks, targets=tuple(names.get(name, name) for name in tracks.targets))
    motion = Motion.from_rows(
        [k.t for k in heard],
        [robot.name] * len(heard),
        heading=np.array([k.heading for k in heard]),
        speed=np.array([k.speed for k in heard]),
    )
    return RobotRun(
        tracks,
        motion,
        truth,
        drive.compass,
        {name: np.array(rows) for name, rows in true.items()},
        BodyPose(end.xy, end.theta, end.v, end.omega),
        options.camera.image_size_px,
        duration,
    )


def _watched(
    world: World3d, frames: Iterator[Frame], true: dict[str, list[tuple[float, float]]]
) -> Iterator[Frame]:
    """The same frames, with the true speeds at their exposures noted."""
    for frame in frames:
        for name, rows in true.items():
            exposed = frame.t - world.options.camera.latency_s
            rows.append((frame.t, world.truth(name, exposed).v))
        yield frame


def run_errors(run: RobotRun) -> dict[str, float]:
    """n_e (eq. 23) by method, the compass's zero apart.

    Parameters
    ----------
    run : RobotRun
        A drive.

    Returns
    -------
    n : dict of str to float
        The columns of `METHODS`; infinite where one refuses.
    """
    found = {}
    for method, how in METHODS.items():
        try:
            calibration = calibrate(
                run.tracks,
                run.motion,
                image_size_px=run.image_size_px,
                **how,  # type: ignore[arg-type]
            )
        except UndeterminedError:
            found[method] = np.inf
            continue
        aligned, _ = align_rotation(run.truth.g, calibration.model)
        found[method] = float(n_error(run.truth.g, aligned))
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table.

    Parameters
    ----------
    arguments : sequence of str, optional
        Command line.
    """
    parser = argparse.ArgumentParser(description="The paper's robot experiment, in MuJoCo")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(arguments)
    rows = []
    for seed in range(args.seed, args.seed + args.runs):
        started = time.perf_counter()
        run = calibration_run(seed)
        filmed = time.perf_counter()
        rows.append([run_errors(run)[method] for method in METHODS])
        told = "  ".join(f"{m} {n:.4f}" for m, n in zip(METHODS, rows[-1], strict=True))
        print(
            f"seed {seed}: {told}  ({run.duration_s:.1f} s driven; {filmed - started:.1f} s to film and track, "
            f"{time.perf_counter() - filmed:.1f} s to calibrate)",
            flush=True,
        )
    medians = np.median(np.array(rows), axis=0)
    told = "  ".join(f"{m} {n:.4f}" for m, n in zip(METHODS, medians, strict=True))
    print(f"median:  {told}  (the paper's robot: 0.0540; {drawn_by()})")


if __name__ == "__main__":
    main()
