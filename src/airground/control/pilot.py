"""One robot under way: state filter, controller, vehicle and safety layer as one step. Knows no clock and no socket."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, sqrt
from typing import TYPE_CHECKING, Any

from airground.control.command import STOP, VelocityCommand
from airground.control.safety.types import SafetyMemory, Situation
from airground.control.speed_hold import SpeedMemory

if TYPE_CHECKING:
    from airground.control.controller import Controller, Guidance
    from airground.control.estimation.state_filter import StateFilter
    from airground.control.safety.layer import SafetyLayer
    from airground.control.safety.types import Sent
    from airground.control.speed_hold import SpeedHold
    from airground.control.state import RobotState
    from airground.control.vehicles.wheels import Vehicle

__all__ = ["Links", "Pilot", "PilotTick", "Wish"]

STUCK, STUCK_S = 2, 5.0  # so many jumps under way, within so long, are a robot that does not get on


@dataclass(frozen=True, slots=True)
class Links:
    """When others were last heard, on the camera's clock; None for what is not watched."""

    frame_t: float | None = None
    """Exposure of the newest picture that arrived [s]."""

    operator_t: float | None = None
    """When the operator was last heard [s]."""

    robot_t: float | None = None
    """When the robot was last heard [s]."""

    stop: bool = False
    """Whether the operator's STOP is pressed."""


@dataclass(frozen=True, slots=True, eq=False)
class Wish:
    """What a robot would do if it were alone."""

    t: float
    """Now [s]."""

    dt: float
    """Until the next tick [s]."""

    state: RobotState
    """What is believed of it, at the time when the command takes effect."""

    guidance: Guidance | None
    """What its controller says; None where nothing was asked of it."""

    command: VelocityCommand
    """What it shall do: rest without a controller, within what the vehicle can do."""

    searching: bool = False
    """Whether it drives gently straight on, as its heading is unknown."""


@dataclass(frozen=True, slots=True, eq=False)
class PilotTick:
    """All that was decided at one time, and from what."""

    wish: Wish
    """What the robot would do if it were alone."""

    sent: Sent
    """What the safety layer let pass, and why."""

    command: VelocityCommand
    """What goes to the robot: that, or with a `SpeedHold` that in the robot's own unit of speed."""

    @property
    def t(self) -> float:
        """When [s]."""
        return self.wish.t

    @property
    def guidance(self) -> Guidance | None:
        """What the controller said."""
        return self.wish.guidance

    @property
    def done(self) -> bool:
        """Whether the controller has arrived, and the robot is told to stand."""
        guidance = self.wish.guidance
        return guidance is not None and guidance.done and self.sent.command.at_rest


class Pilot:
    """Steers one robot: feed its `state_filter` as data arrive, call `tick` at a fixed rate, send what it says.

    A robot without a compass first drives gently straight on (`SafetyBounds.search_mps`), until the image shows where
    it heads.

    Parameters
    ----------
    state_filter : StateFilter
        Belief about the robot.
    safety : SafetyLayer
        What every command passes.
    vehicle : Vehicle, optional
        What the robot can do at all; a unicycle where not given.
    speed_hold : SpeedHold, optional
        Holds the speed in metres per second where the robot's own unit is another, such as with a wheel that is worn:
        by at most its bound, and behind the safety layer, whose limits are those of the ground.
    """

    def __init__(
        self,
        state_filter: StateFilter,
        safety: SafetyLayer,
        vehicle: Vehicle[Any] | None = None,
        speed_hold: SpeedHold | None = None,
    ) -> None:
        self.state_filter = state_filter
        self.safety = safety
        self.vehicle = vehicle
        self.speed_hold = speed_hold
        self.speed_memory = SpeedMemory()
        self.memory = SafetyMemory()
        self._controller: Controller | None = None
        self._progress = 0.0
        self._moved_t = -inf
        self._jumps = 0
        self._jumped_t: list[float] = []

    @property
    def controller(self) -> Controller | None:
        """What brings the robot where it shall be; None while it shall stand."""
        return self._controller

    @property
    def progress(self) -> float:
        """Of the controller."""
        return self._progress

    def assign(self, controller: Controller | None) -> None:
        """Give the robot something else to do, from the next tick on.

        Parameters
        ----------
        controller : Controller or None
            What brings it where it shall be; None to stand.
        """
        self._controller = controller
        self._progress = 0.0

    def release(self) -> None:
        """Let go of stops that wait for a person: the operator's, and that of a robot that did not obey."""
        self.memory = self.memory.released()
        self._jumped_t.clear()

    def tick(self, t: float, dt: float, links: Links | None = None) -> PilotTick:
        """Decide what to tell a robot that is alone.

        Parameters
        ----------
        t : float [s]
            Now, on the camera's clock.
        dt : float [s]
            Until the next tick.
        links : Links, optional
            When others were last heard.

        Returns
        -------
        tick : PilotTick
            Its `command` goes to the robot, and nothing else.
        """
        return self.send(self.wish(t, dt), links)

    def wish(self, t: float, dt: float) -> Wish:
        """Say what the robot would do if it were alone: the first half of a tick.

        Parameters
        ----------
        t : float [s]
            Now, on the camera's clock.
        dt : float [s]
            Until the next tick.

        Returns
        -------
        wish : Wish
            For `send`, or for what keeps several robots apart.
        """
        state = self.state_filter.predict(t + self.state_filter.options.actuation_delay_s)
        guidance, command = None, STOP
        searching = self._controller is not None and self.state_filter.searching
        if searching:
            command = VelocityCommand(self.safety.bounds.search_mps, 0.0)
        elif self._controller is not None:
            guidance = self._controller.step(state, self._progress, dt)
            command = guidance.command
        if self.vehicle is not None and command.finite:
            command = self.vehicle.feasible(command)
        return Wish(t, dt, state, guidance, command, searching)

    def send(
        self,
        wish: Wish,
        links: Links | None = None,
        *,
        instead: VelocityCommand | None = None,
        separation: str = "",
    ) -> PilotTick:
        """Decide what the robot is told: the second half of a tick.

        Parameters
        ----------
        wish : Wish
            What it would do if it were alone.
        links : Links, optional
            When others were last heard.
        instead : VelocityCommand, optional
            What keeps robots apart made of it.
        separation : str
            Why robots are too close, in one line; empty where they are not.

        Returns
        -------
        tick : PilotTick
            Its `command` goes to the robot, and nothing else.
        """
        links = links or Links()
        trouble = ""
        if wish.guidance is not None:
            trouble = self.state_filter.trouble or wish.guidance.trouble
        u, v = wish.state.uv.tolist()
        known = wish.searching or isfinite(wish.state.theta + u + v)
        situation = Situation(
            t=wish.t,
            state=wish.state if known else None,  # the filter says why there is none
            frame_t=links.frame_t,
            operator_t=links.operator_t,
            robot_t=links.robot_t,
            stop=links.stop,
            searching=wish.searching,
            disobeys=self._stuck(wish.t),
            separation=separation,
            trouble=trouble,
        )
        command = wish.command if instead is None else instead
        sent = self.safety.check(command, situation, self.memory)
        self.memory = sent.memory
        if wish.guidance is not None and sent.stop is None:
            self._progress = wish.guidance.progress  # a robot that is stopped gets no further
        told = self._in_own_unit(wish, sent.command)
        self.state_filter.sent(wish.t, told)
        if not told.at_rest:
            self._moved_t = wish.t
        return PilotTick(wish, sent, told)

    def _in_own_unit(self, wish: Wish, command: VelocityCommand) -> VelocityCommand:
        if self.speed_hold is None:
            return command
        state, sigma = wish.state, 0.0
        if state.covariance is not None:
            sigma = sqrt(max(state.covariance.item(3, 3), 0.0))
        v, self.speed_memory = self.speed_hold.step(
            self.speed_memory, command.v, state.v, wish.dt, sigma_mps=sigma
        )
        return VelocityCommand(v, command.omega, command.lateral)

    def _stuck(self, t: float) -> str:
        """Why it is taken to be stuck: to the filter, wheels that turn on the spot look like a robot carried back."""
        jumps = self.state_filter.jumps
        if jumps != self._jumps and t - self._moved_t < STUCK_S / 4:
            self._jumped_t.append(t)
        self._jumps = jumps
        if self._jumped_t:
            self._jumped_t = [k for k in self._jumped_t if t - k < STUCK_S]
        if len(self._jumped_t) < STUCK:
            return ""
        return f"for the {STUCK}nd time within {STUCK_S:g} s it is not where its wheels have it: blocked, or carried"
