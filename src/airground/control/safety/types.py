"""What the safety layer is told, what it says, and what it remembers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, Protocol

from airground.control.command import STOP, VelocityCommand
from airground.control.safety.obedience import Obedience

if TYPE_CHECKING:
    from airground.control.floor import Floor
    from airground.control.state import RobotState

__all__ = [
    "Cause",
    "Clearance",
    "FenceTest",
    "Place",
    "SafetyMemory",
    "Sent",
    "Situation",
    "Stop",
    "StopReason",
]

NONE: Mapping[StopReason, int] = MappingProxyType({})
KEPT = 200  # stops that are remembered one by one


class StopReason(Enum):
    """Why a robot is stopped; the value is what a person reads first."""

    OPERATOR = "operator's stop"
    NOT_A_NUMBER = "not a number"
    FAULT = "fault"
    CLOCK = "clock"
    LATE_TICK = "late tick"
    OPERATOR_LINK = "operator's link lost"
    ROBOT_LINK = "robot's link lost"
    CAMERA = "no pictures"
    TRACK = "track lost"
    STATE_TIME = "state out of date"
    STATE_JUMP = "state jumped"
    STATE_SIGMA = "state uncertain"
    HORIZON = "not on visible ground"
    IMAGE = "outside the image"
    CALIBRATION = "calibration uncertain here"
    FENCE = "outside the fence"
    LEAVING = "about to leave the fence"
    SEPARATION = "too close"
    DISOBEDIENCE = "does not do what it is told"
    CONTROLLER = "controller has no answer"
    STARTING = "starting"

    @property
    def latched(self) -> bool:
        """Whether it holds until somebody releases it."""
        return self in (StopReason.OPERATOR, StopReason.DISOBEDIENCE)

    @property
    def hard(self) -> bool:
        """Whether it stops at once even where stops are gentle."""
        return self in (
            StopReason.OPERATOR,
            StopReason.NOT_A_NUMBER,
            StopReason.FAULT,
            StopReason.CLOCK,
            StopReason.FENCE,
            StopReason.LEAVING,
            StopReason.SEPARATION,
            StopReason.DISOBEDIENCE,
        )


Cause = tuple[StopReason, str]
"""A kind, and a line for a person."""


@dataclass(frozen=True, slots=True)
class Stop:
    """One cause of a stop."""

    t: float
    """When it was noticed [s]."""

    reason: StopReason
    """What kind."""

    line: str
    """For a person, with the numbers."""


class Place(NamedTuple):
    """Where a robot is, in plain numbers."""

    x: float
    """On the floor [m]."""

    y: float
    """On the floor [m]."""

    theta: float
    """Heading [rad]."""

    sigma_m: float = 0.0
    """Standard deviation of the position in its worst direction [m]; 0 where nothing is known of it."""


class Clearance(Protocol):
    """What a fence answers."""

    @property
    def clearance_m(self) -> float:
        """Distance to where robots may not be [m]; negative there."""
        ...


class FenceTest(Protocol):
    """What the safety layer asks of a fence; `Fence` is one."""

    @property
    def floor(self) -> Floor:
        """Whose ground coordinates it takes."""
        ...

    def boundary(self, x: float, y: float) -> Clearance | None:
        """Nearest place where a robot must stop.

        Parameters
        ----------
        x, y : float [m]
            Ground point.

        Returns
        -------
        boundary : Clearance or None
            None where nothing bounds the ground.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """All that is known when a command is about to be sent; times are on one clock."""

    t: float
    """Now [s]."""

    state: RobotState | None
    """Of the robot, when the command takes effect; None where there is none."""

    frame_t: float | None = None
    """Exposure of the newest picture that arrived [s]; None where nobody watches the camera."""

    operator_t: float | None = None
    """When the operator was last heard [s]; None where there is no operator's link to watch."""

    robot_t: float | None = None
    """When the robot was last heard [s]; None where it does not answer."""

    stop: bool = False
    """Whether the operator's STOP is pressed; it holds until it is released."""

    searching: bool = False
    """Whether the heading is unknown and the robot drives gently straight on to show it: then theta, v and omega may be
    NaN, and nothing faster than `SafetyBounds.search_mps` is let pass."""

    disobeys: str = ""
    """Why the robot is taken not to do what it is told, in one line, where others than this layer have seen that."""

    separation: str = ""
    """Why robots are too close, in one line; empty where they are not."""

    trouble: str = ""
    """Why the controller has no answer, in one line; empty where it has."""


@dataclass(frozen=True, slots=True, eq=False)
class SafetyMemory:
    """What the safety layer must be told at the next tick."""

    t: float | None = None
    """Time of the last tick [s]; None before the first."""

    sent: VelocityCommand = STOP
    """What was sent then."""

    place: Place | None = None
    """Where the robot was then; None where that was not known."""

    good_ticks: int = 0
    """Since the last cause to stop."""

    held: frozenset[StopReason] = frozenset({StopReason.STARTING})
    """Causes since the robot last was free to go; it is free where there are none."""

    latched: frozenset[StopReason] = frozenset()
    """Causes that wait for a release."""

    obedience: Obedience = field(default_factory=Obedience)
    """What the robot was told against what it was seen to do."""

    stops: tuple[Stop, ...] = ()
    """Causes in order, each when it began; the newest 200."""

    counts: Mapping[StopReason, int] = field(default_factory=lambda: NONE)
    """How often each cause began."""

    @property
    def going(self) -> bool:
        """Whether the robot is free to go."""
        return not self.held

    def released(self) -> SafetyMemory:
        """Let go of what is latched; the robot goes after the usual number of good ticks.

        Returns
        -------
        memory : SafetyMemory
            Without latches; a cause that is still there latches again. The same where nothing is latched.
        """
        if not self.latched:
            return self
        return replace(self, latched=frozenset(), good_ticks=0, obedience=Obedience())


@dataclass(frozen=True, slots=True, eq=False)
class Sent:
    """What leaves the safety layer: exactly this is sent and logged."""

    command: VelocityCommand
    """For the robot."""

    asked: VelocityCommand | None
    """What came in."""

    stop: Stop | None
    """Why the robot is stopped, the gravest cause first; None where it is free to go."""

    causes: tuple[Stop, ...]
    """All causes of this tick; none while it only waits for more good ticks."""

    memory: SafetyMemory
    """For the next tick."""

    @property
    def limited(self) -> bool:
        """Whether limits changed the command of a robot that is free to go."""
        return self.stop is None and self.command != self.asked
