"""One flight of the drone: the robot's calibration drive filmed, and the drive from goal to goal."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import Motion
from airground.control.goals.point_to_point import PointToPoint
from airground.sim3d.options import FAMILY
from airground.sim3d.survey import Survey, survey
from airground.studies.figure_drives import TOP_MPS
from airground.studies.rig import Rig
from airground.studies.rig_options import LAG_S, limits_for
from airground.studies.robot_driver import RobotDriver, random_headings
from airground.studies.robot_stage import ROBOT, driving_world, world_rig_options
from airground.studies.stage import Known
from airground.studies.world_body import WorldBody, tag_eyes
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.moving import (
    MarksPlane,
    MarksView,
    RaisedStabilizer,
    Stabilizer,
    apply_each,
)
from airground.vision.tracker import Tracker, TrackRecorder
from airground.vision.video_tracks import track_video

if TYPE_CHECKING:
    from airground.calibration import Tracks
    from airground.geometry.arrays import FloatArray
    from airground.sim3d.world import World3d
    from airground.studies.drone import Drone
    from airground.vision.eyes import Look

__all__ = ["Flight", "MovingGoal", "filmed_still"]

CLICKS = 50  # tried at most
APART_M = 0.4
TAG_M = ROBOT.options.tag_height_m


@dataclass(frozen=True, slots=True)
class MovingGoal:
    """A goal clicked in the moving picture."""

    reached: bool
    """Whether the robot said so."""

    off_px: float
    """How far from it its mark stood, in the last picture [px]."""

    off_m: float
    """The same on the ground [m]."""


class Flight:
    """One flight, with its eyes: what they said of every picture is kept.

    Parameters
    ----------
    world : World3d
        With the robot in it.
    drone : Drone
        That films it.
    """

    def __init__(self, world: World3d, drone: Drone) -> None:
        self._world, self._drone = world, drone
        self._stabilizer = Stabilizer()
        self._driver = RobotDriver(world, ROBOT.name)
        self._look: Look | None = None
        self.ground: dict[float, FloatArray] = {}
        self.frames = self.placed = 0
        self.moved_m = 0.0
        self.first_s = 0.0
        self.tracks: Tracks

    def film(self, seed: int) -> Motion:
        """Film the calibration drive.

        Parameters
        ----------
        seed : int
            Of its turns.

        Returns
        -------
        motion : Motion
            Readings meanwhile; what was seen is in `tracks`.
        """
        self._driver.swing()
        frames = self._driver.segments(_headings(seed))
        eyes = Eyes(make_detector(f"tag:family={FAMILY}"), Tracker(), self._stabilizer)
        self.tracks = _named(track_video(frames, eyes, TrackRecorder(), each=self._note).tracks)
        return _motion(self._driver)

    @property
    def raw(self) -> FloatArray:
        """(N, 2) [px]. Sightings in the pictures as they are."""
        H = np.stack([self.ground[t] for t in self.tracks.t.tolist()])
        return apply_each(np.linalg.inv(H), self.tracks.uv)

    @property
    def view(self) -> MarksView:
        """What is told."""
        camera = self._world.options.camera
        return MarksView(TAG_M, self._drone.focal_length_px, camera.image_size_px)

    def survey(self, t: float) -> Survey:
        """Survey the plane of the tags as the camera saw it.

        Parameters
        ----------
        t : float [s]
            When.

        Returns
        -------
        truth : Survey
            Then.
        """
        return survey(self._world, TAG_M, t=t, region_m=(-1.2, -1.0, 1.2, 0.7))

    def drive(
        self, found: MarksPlane, truth: Survey, count: int, seed: int
    ) -> tuple[MovingGoal, ...]:
        """Drive from goal to goal, each clicked in the picture of the moment, while the drone drifts.

        Parameters
        ----------
        found : MarksPlane
            What the pilot is told.
        truth : Survey
            Of the first picture.
        count : int
            Of goals.
        seed : int
            Of the clicks.

        Returns
        -------
        goals : tuple of MovingGoal
            How far off, in truth.
        """
        world, known = self._world, Known.of(found.calibration)
        self._drone.adrift_from = world.now
        view = self.view
        marks = RaisedStabilizer(
            self._stabilizer,
            height_ratio=TAG_M / found.camera_height_m,
            normal=found.normal,
            focal_length_px=view.focal_length_px,
            principal_point=view.principal_point,
        )
        eyes = Eyes(make_detector(f"tag:family={FAMILY}"), Tracker(), marks)
        rig = Rig(
            driving_world(truth.image_from_plane, lens=False),
            known.model,
            known.covariance,
            limits=limits_for(TOP_MPS),
            options=world_rig_options(),
            seed=seed,
            time_offset_s=known.time_offset_s,
            body=WorldBody(
                world, ROBOT.name, compass=self._driver.compass, eyes=eyes, each=self._note
            ),
        )
        rig.settle()
        rng = np.random.default_rng([seed, 0x62])
        rows = found.tracks.rows(ROBOT.name)
        seen = found.tracks.uv[rows]
        return tuple(self._to_goal(rig, seen, rng) for _ in range(count))

    def _to_goal(self, rig: Rig, seen: FloatArray, rng: np.random.Generator) -> MovingGoal:
        stable_px, xy = self._click(rig, seen, rng)
        to = PointToPoint(rig.floor, stable_px[None], rig.limits, response_s=LAG_S)
        drive = rig.drive(to, most_s=60.0)
        stands, _ = rig.rest(0.5)
        there, here = self.survey(self._world.now).project(np.stack([stands, xy]))
        return MovingGoal(
            drive.done, float(np.hypot(*(here - there))), float(np.hypot(*(stands - xy)))
        )

    def _click(
        self, rig: Rig, seen: FloatArray, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """A pixel of the last picture, as it lies in the first one; and where that is on the ground, in truth."""
        look = self._look
        assert look is not None
        assert look.stabilization is not None
        assert look.stabilization.stable_from_image is not None
        stable = np.array(look.stabilization.stable_from_image)
        exposed = look.frame.t - self._world.options.camera.latency_s
        ground = np.linalg.inv(self.survey(exposed).image_from_plane)
        low, high = seen.min(axis=0), seen.max(axis=0)
        for _ in range(CLICKS):
            uv = np.round(apply_each(np.linalg.inv(stable), rng.uniform(low, high)))
            xy = apply_each(ground, uv)
            if np.hypot(*(xy - rig.body.pose.xy)) > APART_M:
                break
        return apply_each(stable, uv), xy

    def _note(self, look: Look) -> None:
        exposed = look.frame.t - self._world.options.camera.latency_s
        if not self.frames:
            self.first_s = exposed
        self.frames += 1
        first, now = self._drone(self.first_s), self._drone(exposed)
        self.moved_m = max(self.moved_m, float(np.linalg.norm(now.position - first.position)))
        if look.stabilization is None or look.stabilization.stable_from_image is None:
            return
        self.placed += 1
        self._look = look
        self.ground[look.frame.t] = np.array(look.stabilization.stable_from_image)


def filmed_still(world: World3d, seed: int) -> tuple[Tracks, Motion]:
    """The same drive under a camera that stands.

    Parameters
    ----------
    world : World3d
        With that camera.
    seed : int
        Of the drive.

    Returns
    -------
    tracks : Tracks
        Sightings.
    motion : Motion
        Readings.
    """
    driver = RobotDriver(world, ROBOT.name)
    driver.swing()
    frames = driver.segments(_headings(seed))
    tracks = track_video(frames, tag_eyes(), TrackRecorder()).tracks
    return _named(tracks), _motion(driver)


def _headings(seed: int) -> tuple[float, ...]:
    return random_headings(np.random.default_rng([seed, 0x12]))


def _named(tracks: Tracks) -> Tracks:
    """The robot's track under its name."""
    label = str(ROBOT.tag)
    return replace(tracks, targets=tuple(ROBOT.name if k == label else k for k in tracks.targets))


def _motion(driver: RobotDriver) -> Motion:
    heard = driver.heard
    return Motion.from_rows(
        [k.t for k in heard],
        [ROBOT.name] * len(heard),
        heading=np.array([k.heading for k in heard]),
        speed=np.array([k.speed for k in heard]),
    )
