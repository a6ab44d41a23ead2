"""What a session says after each step: what goes to the robots, and what a person or a log should know."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

    from airground.control.command import VelocityCommand

__all__ = [
    "CalibrationView",
    "CameraView",
    "Job",
    "Mode",
    "OtherView",
    "PathView",
    "RobotView",
    "SessionEvent",
    "SessionTick",
    "Task",
]

Mode = Literal["idle", "calibrating", "driving", "stopped"]
"""What the whole is doing.

- idle: nothing was asked of any robot, or all have arrived;
- calibrating: robots drive so that the camera becomes known;
- driving: one robot or more is under way;
- stopped: somebody pressed STOP, or a robot did not obey; it waits for a person.
"""

Task = Literal["none", "goal", "to_path", "path", "hand", "leg"]
"""What a robot is doing: nothing, to a goal, to a path's start, along it, driven by hand, a leg of calibration."""


@dataclass(frozen=True, slots=True, eq=False)
class RobotView:
    """One robot of ours."""

    name: str
    """What it is called."""

    uv: tuple[float, float] | None
    """Where its mark is in the image now, as it is believed [px]; None where it is not known."""

    covariance: tuple[float, float, float] | None
    """Of that: uu, uv, vv [px2]."""

    ahead_uv: tuple[float, float] | None
    """Image of a point ahead of it, for an arrow [px]; None where its heading is not known."""

    heading_rad: float | None
    """On the ground [rad]; by compass while there is no calibration."""

    speed_mps: float | None
    """Along the heading [m/s]; by odometer while there is no calibration."""

    turn_radps: float | None
    """Of the heading [rad/s]."""

    seen_s: float | None
    """Age of its newest sighting [s]."""

    heard_s: float | None
    """Age of its newest reading [s]."""

    task: Task
    """What it is doing."""

    done: bool
    """Whether it has arrived."""

    progress: float
    """0 to 1 along a path; 0 where there is none."""

    goals_px: tuple[tuple[float, float], ...]
    """Where it goes, in raw pixels."""

    error_m: float | None
    """From its path, or to its goal, on the ground [m]."""

    error_px: float | None
    """The same in the image [px]."""

    command: VelocityCommand
    """As sent."""

    stop: str
    """Why it is held at rest, in one line; empty where it is not."""

    stop_reason: str
    """The same as one of `StopReason`; empty where it is not held."""

    speed_limit_mps: float
    """What the operator set [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class OtherView:
    """Something else that moves in view."""

    name: str
    """Of its track."""

    uv: tuple[float, float]
    """Where it is [px]."""

    covariance: tuple[float, float, float]
    """Of that: uu, uv, vv [px2]."""

    xy_dot: tuple[float, float] | None
    """Ground velocity [m/s]; None while there is no calibration."""

    speed_mps: float | None
    """Its length [m/s]."""

    speed_sigma_mps: float | None
    """Standard deviation of that [m/s], the calibration's included."""

    ahead_uv: tuple[float, float] | None
    """Image of where it will be in a second [px]."""


@dataclass(frozen=True, slots=True, eq=False)
class PathView:
    """A path that was made of a sketch. Only changes give a new one."""

    robot: str
    """Whose."""

    sketch: int
    """Number of the sketch."""

    points: FloatArray
    """(N, 3). u, v [px], planned speed [m/s]; none where nothing can be driven."""

    undrivable: tuple[tuple[str, tuple[tuple[float, float], ...]], ...]
    """What keeps it from being driven: why, and where in the image [px]."""

    length_m: float
    """Of the path [m]."""

    duration_s: float
    """As planned [s]."""

    deviation_px: float
    """How far it leaves the sketch at most [px]."""

    released: bool = False
    """Whether the robot was told to drive it."""

    @property
    def drivable(self) -> bool:
        """Whether it may be released."""
        return not self.undrivable and len(self.points) > 1


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationView:
    """What is known of the camera, and how a calibration drive goes."""

    status: Literal["none", "calibrated", "bumped"]
    """Whether there is one in force; bumped: there was one, and the camera was moved."""

    relative_sigma: float | None
    """Of ground velocities, of the one in force."""

    revision: int
    """Grows with every new one."""

    phase: Literal["off", "starting", "running", "good", "solving"] = "off"
    """Of the drive: not calibrating; nothing known yet; known roughly; good enough; being solved for good."""

    live_sigma: float | None = None
    """Relative deviation so far in the drive; None while nothing is known."""

    wanted_sigma: float = 0.05
    """When it is good enough."""

    robot: str = ""
    """Which robot drives a leg, or should."""

    advice: str = ""
    """What to do next, in one line."""

    leg_from_px: tuple[float, float] | None = None
    """Start of the next leg."""

    leg_to_px: tuple[float, float] | None = None
    """Its end; None where no pixel is known for it yet."""

    sightings: int = 0
    """That were used."""


@dataclass(frozen=True, slots=True)
class CameraView:
    """How the camera stands."""

    state: str
    """opening, live, frozen, late, lost, ended."""

    line: str
    """What a user should know; empty where all is well."""

    age_s: float | None
    """Age of the newest frame [s]; None before the first."""

    rate_hz: float
    """Frames a second, lately."""

    index: int
    """Of the newest frame."""

    size_px: tuple[int, int] | None
    """Width and height [px]."""


@dataclass(frozen=True, slots=True)
class SessionEvent:
    """Something that a person or a log should know of; happened once."""

    t: float
    """When [s]."""

    level: Literal["info", "warning", "error"]
    """How bad."""

    line: str
    """What, in one line."""

    robot: str = ""
    """Which robot it is about; empty for none."""


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """Work that takes too long for the loop. Its result comes back as a `Finished`."""

    number: int
    """Names it."""

    what: str
    """For people: sketch, calibration, fences."""

    work: Callable[[], Any]
    """Pure: gives the same wherever and whenever it runs; raises `AirgroundError` only."""

    heavy: bool = False
    """Whether it takes seconds; it can be pickled then, for another process."""


@dataclass(frozen=True, slots=True, eq=False)
class SessionTick:
    """All that was decided in one step."""

    t: float
    """Now [s]."""

    number: int
    """Of the step."""

    mode: Mode
    """What the whole is doing."""

    why: str
    """Why it is stopped, in one line; empty otherwise."""

    stop_heard: int
    """How many times STOP was heard: the page shows that its own was."""

    commands: Mapping[str, VelocityCommand]
    """What goes to each robot."""

    robots: tuple[RobotView, ...]
    """Ours."""

    others: tuple[OtherView, ...]
    """Everything else in view."""

    camera: CameraView
    """How it stands."""

    calibration: CalibrationView
    """How it stands."""

    paths: tuple[PathView, ...]
    """One per robot at most, of the newest sketch."""

    fences: tuple[tuple[tuple[tuple[float, float], ...], ...], ...] = ((), ())
    """Polygons to stay inside, and to keep out of [px]."""

    fences_revision: int = 0
    """Grows with every change."""

    events: tuple[SessionEvent, ...] = ()
    """What happened in this step."""

    jobs: tuple[Job, ...] = ()
    """What is to be worked on."""

    refused: tuple[tuple[str, str], ...] = ()
    """Orders that were not carried out: client, why."""

    stages_ms: Mapping[str, float] = field(default_factory=dict)
    """How long parts of the way took lately [ms]; told by whoever has a clock, empty in a replay."""
