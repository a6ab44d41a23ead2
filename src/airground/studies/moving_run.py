"""A drone that looks down on the robot in MuJoCo: hovers in wind while it is calibrated, then drifts while it drives.

The same drive is filmed once more from where the first picture was taken, by a camera that stands. Sightings are
referred to the first picture by what is seen of the floor. The robot's tag is above the floor, so that its place in a
picture moves with the camera in another way: who knows how high it is, and the camera's focal length, can allow for
that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from airground.calibration import Motion, calibrate
from airground.control.goals.point_to_point import PointToPoint
from airground.errors import UndeterminedError
from airground.geometry import align_rotation, n_error
from airground.geometry.arrays import FloatArray
from airground.sim.flights import hover
from airground.sim.scene_camera import Pinhole
from airground.sim3d.camera_pose import CameraPose
from airground.sim3d.canvas import Canvas
from airground.sim3d.options import FAMILY, CameraOptions3d, World3dOptions
from airground.sim3d.survey import Survey, survey
from airground.sim3d.world import World3d
from airground.studies.figure_drives import TOP_MPS
from airground.studies.rig import Rig
from airground.studies.rig_options import LAG_S, limits_for
from airground.studies.robot_driver import RobotDriver, random_headings
from airground.studies.robot_run import CAMERA_HZ
from airground.studies.robot_stage import ROBOT, driving_world, world_rig_options
from airground.studies.stage import Known
from airground.studies.world_body import WorldBody
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.moving import (
    MarksPlane,
    MarksView,
    RaisedStabilizer,
    Stabilizer,
    apply_each,
    calibrate_marks,
)
from airground.vision.tracker import Tracker, TrackRecorder
from airground.vision.video_tracks import track_video

if TYPE_CHECKING:
    from airground.calibration import Calibration, Tracks
    from airground.vision.eyes import Look

__all__ = ["Drone", "MovingGoal", "MovingRun", "moving_options", "moving_run"]

HEIGHT_M = 5.0
BACK_M = 2.6  # behind the middle of the drive
DRIFT_MPS = np.array([0.025, 0.012, 0.0])
BEGIN_S = 4.0  # over which the drift begins
CLICKS = 50  # tried at most
APART_M = 0.4
TAG_M = ROBOT.options.tag_height_m
METHOD = {"method": "trajectory", "distortion": "none"}  # the drone's video has no lens in it


class Drone:
    """Where the camera is: in wind, and from some time on adrift.

    Parameters
    ----------
    options : CameraOptions3d
        Of the camera.
    seed : int
        Of the wind.
    """

    def __init__(self, options: CameraOptions3d, seed: int) -> None:
        pose = CameraPose.looking_at(options.position_m, options.target_m)
        focal = Canvas.of(options).focal_length_px
        base = Pinhole(focal, pose.world_from_camera.T, pose.position, options.image_size_px)
        self.focal_length_px = focal
        """Of the camera [px]."""
        self.adrift_from: float | None = None
        """Since when it drifts [s]."""
        self._hover = hover(base, seed=seed)

    def __call__(self, t: float) -> CameraPose:
        """Tell the pose.

        Parameters
        ----------
        t : float [s]
            When.

        Returns
        -------
        pose : CameraPose
            Then.
        """
        camera = self._hover(t)
        return CameraPose(camera.centre_m + self._drifted(t), camera.camera_from_world.T)

    def _drifted(self, t: float) -> FloatArray:
        if self.adrift_from is None or t <= self.adrift_from:
            return np.zeros(3)
        since = t - self.adrift_from
        way = since**2 / (2 * BEGIN_S) if since < BEGIN_S else since - BEGIN_S / 2
        return DRIFT_MPS * way


@dataclass(frozen=True, slots=True)
class MovingGoal:
    """A goal clicked in the moving picture."""

    reached: bool
    """Whether the robot said so."""

    off_px: float
    """How far from it its mark stood, in the last picture [px]."""

    off_m: float
    """The same on the ground [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class MovingRun:
    """One flight."""

    seed: int
    """Of the world and of the wind."""

    n: dict[str, float]
    """Error n (eq. 23) by how the camera was: ``still``; ``moving``, with the mark's height told; ``flat``, the mark
    taken to be on the floor. Missing where refused."""

    goals: tuple[MovingGoal, ...]
    """Driven to while the drone drifted."""

    placed_share: float
    """Of the pictures, those whose place is known."""

    moved_m: float
    """How far the camera went from where its first picture was taken, at most [m]."""

    height_m: float
    """Of the camera above the floor at its first picture, in truth [m]."""

    found_height_m: float | None
    """The same as it was found; None where the calibration was refused."""

    uv: FloatArray
    """(M, 2) [px]. Where the robot's mark was seen while it was calibrated, in the pictures as they are."""

    stable_uv: FloatArray
    """(M, 2) [px]. The same in the first picture."""


def moving_options(rate_hz: float = CAMERA_HZ) -> World3dOptions:
    """The world of the flights.

    Parameters
    ----------
    rate_hz : float
        Pictures per second.

    Returns
    -------
    options : World3dOptions
        The robot of table 2, seen from higher up and without a lens.
    """
    camera = CameraOptions3d(
        position_m=(0.0, -0.25 - BACK_M, HEIGHT_M),
        target_m=(0.0, -0.05, 0.0),
        k1=0.0,
        rate_hz=rate_hz,
    )
    return World3dOptions(robots=(ROBOT,), camera=camera)


def moving_run(seed: int, goals: int, options: World3dOptions | None = None) -> MovingRun:
    """Calibrate under a hovering drone, and drive while it drifts.

    Parameters
    ----------
    seed : int
        Of the world and of the wind.
    goals : int
        How many.
    options : World3dOptions, optional
        `moving_options` where not given.

    Returns
    -------
    run : MovingRun
        How it went.

    Raises
    ------
    InputError
        If MuJoCo is not installed.
    UnreachableError
        If it cannot draw here.
    """
    options = options or moving_options()
    drone = Drone(options.camera, seed)
    with World3d(options, seed, camera_pose=drone) as world:
        flight = _Flight(world, drone)
        motion = flight.film(seed)
        tracks = flight.tracks
        ground, raw, truth = dict(flight.ground), flight.raw, flight.survey(flight.first_s)
        try:
            found = calibrate_marks(tracks, ground, motion, flight.view)
        except UndeterminedError:
            found = None
        n = _errors(
            truth,
            {
                "moving": None if found is None else found.calibration,
                "flat": _calibrated(tracks, motion, options),
                "still": _filmed_still(options, seed, drone(flight.first_s)),
            },
        )
        driven = () if found is None else flight.drive(found, truth, goals, seed)
        rows = tracks.rows(ROBOT.name)
        height = None if found is None else found.camera_height_m
        return MovingRun(
            seed,
            n,
            driven,
            placed_share=flight.placed / flight.frames,
            moved_m=flight.moved_m,
            height_m=float(drone(flight.first_s).position[2]),
            found_height_m=height,
            uv=raw[rows],
            stable_uv=(tracks if found is None else found.tracks).uv[rows],
        )


def _errors(truth: Survey, found: dict[str, Calibration | None]) -> dict[str, float]:
    return {
        name: float(n_error(truth.g, align_rotation(truth.g, one.model)[0]))
        for name, one in found.items()
        if one is not None
    }


def _filmed_still(options: World3dOptions, seed: int, pose: CameraPose) -> Calibration | None:
    """The same drive, from where the first picture was taken."""
    with World3d(options, seed, camera_pose=lambda _: pose) as world:
        driver = RobotDriver(world, ROBOT.name)
        driver.swing()
        eyes = Eyes(make_detector(f"tag:family={FAMILY}"), Tracker())
        frames = driver.segments(_headings(seed))
        tracks = track_video(frames, eyes, TrackRecorder()).tracks
        return _calibrated(_named(tracks), _motion(driver), options)


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


def _calibrated(tracks: Tracks, motion: Motion, options: World3dOptions) -> Calibration | None:
    size = options.camera.image_size_px
    try:
        return calibrate(tracks, motion, image_size_px=size, **METHOD)  # type: ignore[arg-type]
    except UndeterminedError:
        return None


class _Flight:
    """One flight, with its eyes: what they said of every picture is kept."""

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
        """The calibration drive."""
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
        """The truth about the plane of the tags as the camera saw it then."""
        return survey(self._world, TAG_M, t=t, region_m=(-1.2, -1.0, 1.2, 0.7))

    def drive(
        self, found: MarksPlane, truth: Survey, count: int, seed: int
    ) -> tuple[MovingGoal, ...]:
        """From goal to goal, each clicked in the picture of the moment."""
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
