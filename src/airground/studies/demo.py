"""The main job, end to end, in the embedded world: film, track, calibrate, measure, drive, report.

What is estimated comes from rendered images and the robot's odometry alone. The world's truth is only compared with.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.calibration import Provenance, Speeds, calibrate, measure_speeds
from airground.calibration.inspection import Inspection, inspect_calibration
from airground.geometry import n_error, velocity_map_error
from airground.records import (
    make_folder,
    read_motion,
    read_tracks,
    write_motion,
    write_speeds,
    write_tracks,
)
from airground.sim import (
    CalibrationDrive,
    DriveNoise,
    Scene,
    World,
    calibration_drive,
    demo_scene,
    demo_world,
)
from airground.studies.demo_drive import DemoDrive, demo_drive
from airground.studies.film import film, watch
from airground.studies.report import write_report

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from airground.calibration import Calibration, Tracks

__all__ = ["Demo", "run_demo"]

CLOCKS_APART_S = 0.08  # the robot's clock is ahead of the camera's; calibration has to find that
DURATION_S = 75.0
SURE = 1.96  # standard deviations that hold 95 per cent


@dataclass(frozen=True, slots=True, eq=False)
class Demo:
    """What the demo did and how well."""

    world: World
    """The truth."""

    scene: Scene
    """The same, with all that the camera sees of it."""

    mark_height_m: float
    """Height of the tags above the floor [m]: the calibration is that of their plane."""

    drive: CalibrationDrive
    """The robot's readings, and the true path."""

    tracks: Tracks
    """The recording, as read back."""

    calibration: Calibration
    """The estimate."""

    inspection: Inspection
    """What it says."""

    speeds: Speeds
    """Measured ground velocities of robot and cart."""

    n: float
    """Error of g (eq. 22)."""

    map_error: float
    """Relative error of ground velocities over the driven region and all headings."""

    cart_speed_mps: float
    """Mean of the cart's measured speed [m/s]."""

    cart_rms_mps: float
    """Root mean square error of the cart's measured speed [m/s]."""

    cart_covered: float
    """Share of the cart's speeds whose stated 95 % interval holds the truth."""

    driven: DemoDrive
    """The sketch that was followed with it, and the goals that were driven to."""

    elapsed_s: float
    """Time it took [s]."""

    def document(self) -> dict[str, Any]:
        """Give the JSON object of the demo.

        Returns
        -------
        document : dict
            Figures by name, with units.
        """
        c = self.calibration
        return {
            "n": self.n,
            "map_error": self.map_error,
            "relative_sigma": c.observability.relative_sigma,
            "time_offset_s": c.time_offset_s,
            "time_offset_sigma_s": c.time_offset_sigma_s,
            "time_offset_true_s": CLOCKS_APART_S,
            "cart_speed_mps": self.cart_speed_mps,
            "cart_speed_true_mps": float(np.linalg.norm(self.drive.cart_xy_dot)),
            "cart_rms_mps": self.cart_rms_mps,
            "cart_covered": self.cart_covered,
            "path_rms_px": self.driven.path_rms_px,
            "path_rms_m": self.driven.path_rms_m,
            "oracle_path_rms_m": self.driven.oracle_path_rms_m,
            "goals": [
                {
                    "u_px": float(goal.uv[0]),
                    "v_px": float(goal.uv[1]),
                    "reached": goal.reached,
                    "goal_error_px": goal.error_px,
                    "goal_error_m": goal.error_m,
                }
                for goal in self.driven.goals
            ],
            "stops": self.driven.stops,
            "elapsed_s": self.elapsed_s,
        }


def run_demo(
    out: Path,
    *,
    seed: int,
    command: str,
    say: Callable[[str], None],
    duration_s: float | None = None,
) -> Demo:
    """Run the demo and write its files.

    Parameters
    ----------
    out : Path
        Folder to write to; made where it is missing.
    seed : int
        Of all random numbers.
    command : str
        Command line, for the calibration's provenance.
    say : callable
        Is told what is being done.
    duration_s : float, optional [s]
        Of the drive; `DURATION_S` where not given.

    Returns
    -------
    demo : Demo
        Results and figures.

    Raises
    ------
    FileError
        If the folder cannot be made.
    """
    started = time.perf_counter()
    duration_s = DURATION_S if duration_s is None else duration_s
    make_folder(out)

    world = demo_world()
    scene = demo_scene(seed, world=world)
    drive = calibration_drive(
        world,
        np.random.default_rng(seed),
        duration_s=duration_s,
        noise=DriveNoise(time_offset_s=CLOCKS_APART_S),
    )
    names = {"0": world.robot, "1": world.cart.target}
    write_motion(out / "motion.csv", drive.motion)
    watched = watch(scene, duration_s=duration_s, seed=seed, names=names, say=say)
    write_tracks(out / "tracks.csv", watched.tracks)

    say("calibrate from the recording")
    tracks, motion = read_tracks(out / "tracks.csv"), read_motion(out / "motion.csv")
    calibration = calibrate(tracks, motion, image_size_px=world.camera.image_size_px)
    calibration = replace(calibration, provenance=Provenance(command=command))
    calibration.save(out / "calibration.json")

    say("measure everybody's speed")
    speeds = measure_speeds(calibration, tracks)
    write_speeds(
        out / "speeds.csv",
        t=speeds.t,
        targets=speeds.targets,
        target_index=speeds.target_index,
        uv=speeds.uv,
        xy_dot=speeds.xy_dot,
        speed_sigma=speeds.speed_sigma,
    )
    driven = demo_drive(
        calibration, out, seed=seed, clock_offset_s=CLOCKS_APART_S, names=names, say=say
    )
    cart = speeds.target_index == speeds.targets.index(drive.cart)
    off = speeds.speed[cart] - float(np.linalg.norm(drive.cart_xy_dot))
    height = float(scene.body(world.robot).reference[2])
    truth = scene.plane(height).g
    demo = Demo(
        world=world,
        scene=scene,
        mark_height_m=height,
        drive=drive,
        tracks=tracks,
        calibration=calibration,
        inspection=inspect_calibration(calibration),
        speeds=speeds,
        n=float(n_error(truth, calibration.model)),
        map_error=velocity_map_error(truth, calibration.model, tracks.uv[tracks.rows(world.robot)]),
        cart_speed_mps=float(speeds.speed[cart].mean()),
        cart_rms_mps=float(np.sqrt(np.mean(off**2))),
        cart_covered=float(np.mean(np.abs(off) < SURE * speeds.speed_sigma[cart])),
        driven=driven,
        elapsed_s=0.0,
    )
    film(
        out / "demo.mp4",
        scene,
        calibration,
        watched,
        seed=seed,
        names=names,
        say=say,
    )
    say("draw the report")
    demo = replace(demo, elapsed_s=time.perf_counter() - started)
    write_report(out, demo)
    return replace(demo, elapsed_s=time.perf_counter() - started)
