"""From a site, or none, to a session that runs: camera, detector, robots and recorder put together."""

from __future__ import annotations

import importlib
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Self

from airground.control.estimation.options import StateOptions
from airground.errors import InputError
from airground.robots.opening import open_robot
from airground.session.clock import SessionClock
from airground.session.live import LiveSession
from airground.session.options import RobotOptions, SessionOptions
from airground.session.recorder import Recorder
from airground.session.session import Session
from airground.session.stepped import embedded_robots
from airground.sim.live_apart import WorldApart
from airground.sim.live_options import FAMILY, EmbeddedOptions, robot_places
from airground.sim.live_world import EmbeddedWorld
from airground.sim.vehicle_odometry import OdometryNoise
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.eyes_apart import EyesApart
from airground.vision.moving import Stabilizer
from airground.vision.sources import live_source
from airground.vision.threads import use_threads
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import TracebackType

    from airground.calibration import Calibration
    from airground.records.site import RobotSite, Site
    from airground.robots import Robot
    from airground.session.live_camera import LiveCamera
    from airground.session.recorder import Images

__all__ = ["LiveSite", "SitePlan", "plan_of_site", "plan_without_site"]

EMBEDDED = "embedded"
WHEELS = OdometryNoise(speed_share=0.02)  # an odometer as it is bought: two per cent


@dataclass(frozen=True, slots=True)
class SitePlan:
    """What is to be opened."""

    options: SessionOptions
    """Of the session."""

    source: str
    """The camera, or `EMBEDDED`."""

    detector: str
    """As `make_detector` takes it."""

    links: Mapping[str, str]
    """By robot: its link, or `EMBEDDED`."""

    rate_hz: float | None = None
    """Frame rate that replaces the camera's own times."""

    stabilize: bool = False
    """Whether the camera moves."""

    calibration: Path | None = None
    """File to begin with."""

    images: Images = "some"
    """Which pictures a recording keeps."""

    image_hz: float = 2.0
    """How many a second, where some."""

    seed: int = 0
    """Of the embedded world."""


def plan_without_site(*, robots: int = 2, seed: int = 0) -> SitePlan:
    """Plan the embedded world.

    Parameters
    ----------
    robots : int
        How many.
    seed : int
        Of floor and noise.

    Returns
    -------
    plan : SitePlan
        Rendered, with a cart that is somebody else's.

    Raises
    ------
    InputError
        If there are too many robots.
    """
    world = EmbeddedWorld(EmbeddedOptions(robots=robots, odometry=WHEELS), seed)
    options = SessionOptions(embedded_robots(world), name="embedded world")
    links = {robot.name: EMBEDDED for robot in options.robots}
    return SitePlan(options, EMBEDDED, f"tag:family={FAMILY}", links, seed=seed)


def plan_of_site(site: Site) -> SitePlan:
    """Plan what a site file describes.

    Parameters
    ----------
    site : Site
        As read.

    Returns
    -------
    plan : SitePlan
        To be opened.

    Raises
    ------
    InputError
        If robots are embedded and the camera is not, or the other way round.
    """
    camera = site.cameras[0]
    embedded = [robot.name for robot in site.robots if robot.link == EMBEDDED]
    if (camera.source == EMBEDDED) != (len(embedded) == len(site.robots)):
        raise InputError(
            f"site {site.name}: camera and robots must all be embedded, or none; the camera is {camera.source!r}, "
            f"embedded robots are {', '.join(embedded) or 'none'}"
        )
    options = SessionOptions(
        tuple(_robot(one) for one in site.robots),
        name=site.name,
        control_hz=site.control.rate_hz,
        bounds=site.safety,
        stay_inside=tuple(one.corners_px for one in site.fences if one.kind == "stay_inside"),
        keep_out=tuple(one.corners_px for one in site.fences if one.kind == "keep_out"),
        margin_m=site.separation.margin_m,
        others_radius_m=site.separation.others_radius_m,
        wanted_sigma=site.calibration.wanted_sigma,
        distortion=site.calibration.lens,
    )
    return SitePlan(
        options,
        camera.source,
        camera.detector if camera.source != EMBEDDED else f"tag:family={FAMILY}",
        {robot.name: robot.link for robot in site.robots},
        rate_hz=camera.rate_hz,
        stabilize=camera.stabilize,
        calibration=site.calibration.file,
        images="some" if site.record is None else site.record.images,
        image_hz=2.0 if site.record is None else site.record.image_hz,
    )


class LiveSite:
    """Opens what a plan says and runs it. A context manager.

    Parameters
    ----------
    plan : SitePlan
        What is to be opened.
    calibration : Calibration or None
        What is known of the camera already.
    record : Path, optional
        File to record to.
    note : callable, optional
        Told what may surprise, a line each, from any thread.

    Raises
    ------
    InputError
        If the plan cannot be carried out.
    UnreachableError
        If a robot's link cannot be opened.
    FileError
        If the recording's file cannot be made.
    """

    def __init__(
        self,
        plan: SitePlan,
        calibration: Calibration | None = None,
        *,
        record: Path | None = None,
        note: Callable[[str], None] | None = None,
    ) -> None:
        self._stack = ExitStack()
        _warm_up()
        clock = SessionClock()
        with ExitStack() as opened:
            camera, robots = self._open(plan, clock, opened)
            eyes = opened.enter_context(
                EyesApart(partial(_eyes, plan.detector, moving=plan.stabilize))
            )
            recorder = None
            if record is not None:
                recorder = Recorder(
                    record,
                    plan.options,
                    calibration,
                    images=plan.images,
                    image_hz=plan.image_hz,
                    note=note,
                )
            self.robots = robots
            """By name."""
            self.live = LiveSession(
                Session(plan.options, calibration),
                camera,
                eyes,
                robots,
                clock=clock,
                recorder=recorder,
                note=note,
            )
            self._stack = opened.pop_all()

    def _open(
        self, plan: SitePlan, clock: SessionClock, opened: ExitStack
    ) -> tuple[LiveCamera, Mapping[str, Robot]]:
        if plan.source == EMBEDDED:
            count = len(plan.options.robots)
            options = EmbeddedOptions(robots=count, odometry=WHEELS)
            there = {place.name: str(place.tag) for place in robot_places(options)}
            for robot in plan.options.robots:
                if there.get(robot.name) != robot.track:
                    known = ", ".join(f"{name} (track {tag})" for name, tag in there.items())
                    raise InputError(
                        f"robot {robot.name} (track {robot.track}) is not in the embedded world; "
                        f"its first {count} are {known}"
                    )
            world = opened.enter_context(WorldApart(options, plan.seed, clock))
            return world.camera, world.robots
        robots = {
            name: opened.enter_context(open_robot(name, link, clock=clock))
            for name, link in plan.links.items()
        }
        source = opened.enter_context(live_source(plan.source, rate_hz=plan.rate_hz))
        return source.start(), robots

    def __enter__(self) -> Self:
        self.live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.live.close()
        self._stack.close()


def _warm_up() -> None:
    """Have ready what the loop must not wait for when it is first needed."""
    for name in ("shapely", "daqp", "scipy.optimize", "scipy.interpolate"):
        importlib.import_module(name)
    use_threads(1)  # the loop must not wait for images whose threads wait for each other


def _eyes(detector: str, *, moving: bool) -> Eyes:
    return Eyes(make_detector(detector), Tracker(), Stabilizer() if moving else None)


def _robot(one: RobotSite) -> RobotOptions:
    state = StateOptions(
        lever_arm_m=one.lever_arm_m,
        actuation_delay_s=one.timing.actuation_delay_s,
        speed_lag_s=one.timing.speed_lag_s,
        turn_lag_s=one.timing.turn_lag_s,
    )
    return RobotOptions(
        one.name,
        one.track,
        one.kind,
        radius_m=one.radius_m,
        limits=one.limits,
        speed_mps=one.speed_mps,
        state=state,
        compass=one.compass,
    )
