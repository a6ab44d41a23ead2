"""The demo's second half: with what was just calibrated, a sketch is followed and goals are driven to.

The robot is seen in rendered images, 100 ms late, by the same eyes as before. The same path is then driven once more by
who knows the true g: what is lost by calibrating is the difference.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airground.control.goals.point_to_point import PointToPoint
from airground.records import DrawnPath, replacing, write_path
from airground.studies.drive_measures import distance_to_line, rms
from airground.studies.driving_world import demo_driving_world
from airground.studies.path_drive import followed, oracle_rms, released
from airground.studies.rig import Drive, Rig
from airground.studies.rig_options import LAG_S, RigOptions, limits_for
from airground.vision.image_files import write_png
from airground.vision.overlay import Overlay
from airground.vision.overlay_orders import draw_goal, draw_path
from airground.vision.video_writer import VideoWriter

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from airground.calibration import Calibration
    from airground.control.paths.image_path import ImagePath
    from airground.geometry.arrays import FloatArray
    from airground.vision.eyes import Look

__all__ = ["GOALS_PX", "DemoDrive", "DemoGoal", "demo_drive", "hand_sketch"]

GOALS_PX = ((420.0, 430.0), (860.0, 330.0), (700.0, 560.0))
"""What an operator clicks."""

SKETCH_POINTS = 70
HAND_PX = 1.5  # how much a hand trembles
CAMERA_HZ = 20.0
FILM_EVERY = 2  # frames
UNDER_WAY = 50  # frames of the film after a goal was clicked: the robot is about half way


@dataclass(frozen=True, slots=True, eq=False)
class DemoGoal:
    """One clicked goal."""

    uv: FloatArray
    """(2,) [px]. What was clicked."""

    reached: bool
    """Whether the robot says that it is there."""

    error_px: float
    """How far off it really stands, in the image [px]."""

    error_m: float
    """The same on the ground [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class DemoDrive:
    """What was driven."""

    sketch_uv: FloatArray
    """(N, 2) [px]. As drawn."""

    path: ImagePath
    """What became of it."""

    to_start: Drive
    """To the path's start."""

    along: Drive
    """Along the path."""

    goal_drives: tuple[Drive, ...]
    """To the goals."""

    goals: tuple[DemoGoal, ...]
    """How that ended."""

    path_rms_px: float
    """Distance from the path while following it, in the image [px]."""

    path_rms_m: float
    """The same on the ground [m]."""

    oracle_path_rms_m: float | None
    """The same for a drive that knows the true g [m]; None where it did not get to the path."""

    @property
    def stops(self) -> int:
        """How often the robot was stopped for safety."""
        return sum(len(d.stops) for d in (self.to_start, self.along, *self.goal_drives))


def hand_sketch(seed: int) -> FloatArray:
    """Draw a line into the demo's image, with a trembling hand.

    Parameters
    ----------
    seed : int
        Of the trembling.

    Returns
    -------
    uv : (N, 2) array [px]
        From the left to the right.
    """
    share = np.linspace(0.0, 1.0, SKETCH_POINTS)
    bend = 110.0 * np.sin(2.2 * np.pi * share)
    line = np.column_stack([380.0 + 520.0 * share, 470.0 - bend - 60.0 * share])
    tremble = np.random.default_rng([seed, 0x5C]).normal(0.0, HAND_PX, line.shape)
    return np.asarray(np.round(line + tremble, 1))


def demo_drive(
    calibration: Calibration,
    out: Path,
    *,
    seed: int,
    clock_offset_s: float,
    names: Mapping[str, str],
    say: Callable[[str], None],
) -> DemoDrive:
    """Follow a sketch and drive to goals; write ``path.csv``, ``drive.mp4`` and ``drive-frame.png``.

    Parameters
    ----------
    calibration : Calibration
        To drive with.
    out : Path
        Folder, which exists.
    seed : int
        Of all noise.
    clock_offset_s : float [s]
        By how much the robot's clock is ahead of the camera's, in truth.
    names : mapping of str to str
        From the number of a tag to who bears it.
    say : callable
        Is told what is being done.

    Returns
    -------
    driven : DemoDrive
        With figures.

    Raises
    ------
    InputError
        If the sketch cannot be driven, which would be a fault of the calibration.
    """
    world = demo_driving_world(seed, clock_offset_s=clock_offset_s)
    sketch = hand_sketch(seed)
    write_path(out / "path.csv", DrawnPath(sketch))
    with ExitStack() as stack:
        film = _Film(calibration, names)
        rig = Rig(
            world,
            calibration.model,
            calibration.covariance,
            limits=limits_for(world.speed_mps),
            options=RigOptions(images=True, camera_hz=CAMERA_HZ),
            seed=seed,
            undistorted=calibration.undistort,
            time_offset_s=calibration.time_offset_s,
            each=film.add,
        )
        path = released(rig, calibration.undistort(sketch), size_px=world.camera.image_size_px)
        film.path = path
        temporary = stack.enter_context(replacing(out / "drive.mp4"))
        film.video = stack.enter_context(
            VideoWriter(
                temporary, size_px=world.camera.image_size_px, rate_hz=CAMERA_HZ / FILM_EVERY
            )
        )
        drives, _, _ = followed(rig, path, lambda line: say(f"drive: {line}"))
        to_start, along = drives[0], drives[-1]
        goal_drives, goals = [], []
        for k, pixel in enumerate(GOALS_PX, start=1):
            say(f"drive: to goal {k} of {len(GOALS_PX)}")
            uv = np.array(pixel)
            film.goals.append(uv)
            to = PointToPoint(
                rig.floor, calibration.undistort(uv)[None], rig.limits, response_s=LAG_S
            )
            goal_drives.append(rig.drive(to, most_s=60.0))
            goals.append(DemoGoal(uv, goal_drives[-1].done, *rig.stands_off(uv)))
            film.reached = len(film.goals)
        if film.telling is not None:
            with replacing(out / "drive-frame.png") as picture:
                write_png(picture, film.telling)
    path_px = calibration.distort(path.uv)
    line = world.camera.unproject(path_px)
    say("drive: the same path with the true g")
    return DemoDrive(
        sketch_uv=sketch,
        path=path,
        to_start=to_start,
        along=along,
        goal_drives=tuple(goal_drives),
        goals=tuple(goals),
        path_rms_px=rms(distance_to_line(along.uv, path_px)),
        path_rms_m=rms(distance_to_line(along.xy, line)),
        oracle_path_rms_m=oracle_rms(rig, path_px, line, seed=seed),
    )


class _Film:
    """Draws orders and tracks into every other picture, and keeps one that shows them."""

    def __init__(self, calibration: Calibration, names: Mapping[str, str]) -> None:
        self.video: VideoWriter | None = None
        self.path: ImagePath | None = None
        self.goals: list[FloatArray] = []
        self.reached = 0
        self.telling: np.ndarray[tuple[int, ...], np.dtype[np.uint8]] | None = None
        self._calibration = calibration
        self._overlay = Overlay(calibration=calibration, names=names)
        self._second = 0

    def add(self, look: Look) -> None:
        """Take a picture."""
        if self.video is None or look.frame.index % FILM_EVERY:
            return
        image = self._overlay.draw(look.frame, look.state.tracks)
        if self.path is not None:
            share = self.path.speed / max(float(self.path.speed.max()), 1e-9)
            draw_path(image, self._calibration.distort(self.path.uv)[::4], share[::4])
        for k, uv in enumerate(self.goals):
            draw_goal(image, uv, reached=k < self.reached)
        self.video.write(image)
        self._second += len(self.goals) == 2
        # A path, a goal reached, and the robot on its way to another one.
        if self.telling is None or (len(self.goals) == 2 and self._second <= UNDER_WAY):
            self.telling = image
