"""The paper's robot experiment (section 3.2) in MuJoCo: eight segments, turns by the compass, our eyes on its pictures.

``python -m airground.studies.robot_run --runs 5`` prints n_e (eq. 23) of both methods. Calibration is given encoders,
compass and pictures; the truth is surveyed. Before the drive the compass is swung, as any compass should be: left in,
iron of two per cent of the earth's field makes n_e 0.05, as large as the paper's own.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from math import copysign, pi, remainder, tau
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import Motion, Tracks, calibrate
from airground.control.command import STOP, VelocityCommand
from airground.errors import UndeterminedError
from airground.geometry import align_rotation, n_error
from airground.sim3d.backend import drawn_by
from airground.sim3d.options import FAMILY, CameraOptions3d, World3dOptions
from airground.sim3d.survey import Survey, survey
from airground.sim3d.world import World3d
from airground.studies.compass_swing import CompassSwing, swing_compass
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.tracker import Tracker, TrackRecorder
from airground.vision.video_tracks import track_video

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from airground.robots.protocol import RobotReading
    from airground.vision.frame import Frame

__all__ = ["RobotRun", "calibration_run", "main", "run_errors"]

SEGMENTS = 8
SEGMENT_S = 3.0
SPEED_MPS = 0.15
TURN_RAD = pi / 6
STEP_S = 0.05  # of the loop that drives
REST_S = 0.5  # before the first segment, and after each turn
SWING_S = 13.0  # of turning on the spot, more than once round
TURN_S = 8.0  # most for a turn
SURE_RAD = 0.02
TURN_RADPS = (0.12, 0.6)  # least, so that it does not stick, and most
CAMERA_HZ = 10.0  # half the world's own: a run takes half the time
METHODS = {
    "trajectory": {"method": "trajectory", "distortion": "division"},  # a real camera has a lens
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

    image_size_px: tuple[int, int]
    """Width and height [px]."""

    duration_s: float
    """Of the drive [s]."""


def calibration_run(
    seed: int, options: World3dOptions | None = None, *, swing: bool = True
) -> RobotRun:
    """Drive eight segments with turns of 30 degrees, and film it.

    Parameters
    ----------
    seed : int
        Of the world.
    options : World3dOptions, optional
        Of the world; its first robot is driven. The defaults with ten pictures a second where not given.
    swing : bool
        Whether the compass is swung before.

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
        drive = _Drive(world, robot.name)
        if swing:
            drive.swing()
        eyes = Eyes(make_detector(f"tag:family={FAMILY}"), Tracker())
        tracks = track_video(drive.frames(), eyes, TrackRecorder()).tracks
        truth = survey(world, robot.options.tag_height_m)
        heard = drive.heard
        duration = world.now
    tracks = replace(tracks, targets=tuple(names.get(name, name) for name in tracks.targets))
    motion = Motion.from_rows(
        [k.t for k in heard],
        [robot.name] * len(heard),
        heading=np.array([k.heading for k in heard]),
        speed=np.array([k.speed for k in heard]),
    )
    return RobotRun(tracks, motion, truth, options.camera.image_size_px, duration)


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


class _Drive:
    """Drives by what the robot tells, and gives the camera's pictures as they come."""

    def __init__(self, world: World3d, name: str) -> None:
        self.heard: list[RobotReading] = []
        self._world = world
        self._name = name
        self._compass = CompassSwing(0.0, 0.0)

    def swing(self) -> None:
        """Turn round on the spot, and learn from the encoders how the compass errs. Nothing is filmed."""
        for command, seconds in ((VelocityCommand(0.0, TURN_RADPS[1]), SWING_S), (STOP, REST_S)):
            for _ in range(round(seconds / STEP_S)):
                self._advance(command)
        t, heading, rate = (
            np.array(column, dtype=np.float64)
            for column in zip(*((k.t, k.heading, k.turn_rate) for k in self.heard), strict=True)
        )
        self._compass = swing_compass(t, heading, rate)
        self.heard = []
        self._world.drop_frames()

    def frames(self) -> Iterator[Frame]:
        """All pictures of the drive."""
        yield from self._for(REST_S, STOP)
        first = self._heading()
        for segment in range(SEGMENTS):
            if segment:
                yield from self._turn(first + segment * TURN_RAD)
            yield from self._for(SEGMENT_S, VelocityCommand(SPEED_MPS, 0.0))
        yield from self._for(REST_S, STOP)

    def _turn(self, wanted: float) -> Iterator[Frame]:
        end = self._world.now + TURN_S
        while abs(off := remainder(wanted - self._heading(), tau)) > SURE_RAD:
            if self._world.now > end:
                break
            least, most = TURN_RADPS
            rate = copysign(min(max(1.5 * abs(off), least), most), off)
            yield from self._step(VelocityCommand(0.0, rate))
        yield from self._for(REST_S, STOP)

    def _heading(self) -> float:
        heading = self.heard[-1].heading
        assert heading is not None
        return heading

    def _for(self, seconds: float, command: VelocityCommand) -> Iterator[Frame]:
        for _ in range(round(seconds / STEP_S)):
            yield from self._step(command)

    def _step(self, command: VelocityCommand) -> Iterator[Frame]:
        self._advance(command)
        yield from self._world.frames(self._world.now)

    def _advance(self, command: VelocityCommand) -> None:
        world = self._world
        world.command(self._name, world.now, command)
        world.advance(world.now + STEP_S)
        for reading in world.readings(self._name, world.now):
            assert reading.heading is not None
            heading = self._compass.corrected(reading.heading)
            self.heard.append(replace(reading, heading=heading))


if __name__ == "__main__":
    main()
