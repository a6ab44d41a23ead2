"""One robot under way: state filter, controller, vehicle and safety layer as one step. Knows no clock and no socket."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from airground.control.command import STOP, VelocityCommand
from airground.control.safety_types import SafetyMemory, Situation

if TYPE_CHECKING:
    from airground.control.controller import Controller, Guidance
    from airground.control.safety import SafetyLayer
    from airground.control.safety_types import Sent
    from airground.control.state import RobotState
    from airground.control.state_filter import StateFilter
    from airground.control.vehicles import Vehicle

__all__ = ["Pilot", "PilotTick"]


@dataclass(frozen=True, slots=True, eq=False)
class PilotTick:
    """All that was decided at one time, and from what."""

    t: float
    """When [s]."""

    state: RobotState
    """What was believed of the robot, at the time when the command takes effect."""

    guidance: Guidance | None
    """What the controller wanted; None where nothing was asked of the robot."""

    sent: Sent
    """What goes to the robot, and why."""

    @property
    def done(self) -> bool:
        """Whether the controller has arrived, and the robot is told to stand."""
        return self.guidance is not None and self.guidance.done and self.sent.command.at_rest


class Pilot:
    """Steers one robot: feed its `state_filter` as data arrive, call `tick` at a fixed rate, send what it says.

    Parameters
    ----------
    state_filter : StateFilter
        Belief about the robot.
    safety : SafetyLayer
        What every command passes.
    vehicle : Vehicle, optional
        What the robot can do at all; a unicycle where not given.
    """

    def __init__(
        self, state_filter: StateFilter, safety: SafetyLayer, vehicle: Vehicle[object] | None = None
    ) -> None:
        self.state_filter = state_filter
        self.safety = safety
        self.vehicle = vehicle
        self.memory = SafetyMemory()
        self._controller: Controller | None = None
        self._progress = 0.0

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

    def tick(
        self,
        t: float,
        dt: float,
        *,
        frame_t: float | None = None,
        operator_t: float | None = None,
        robot_t: float | None = None,
        stop: bool = False,
        separation: str = "",
    ) -> PilotTick:
        """Decide what to tell the robot now.

        Parameters
        ----------
        t : float [s]
            Now, on the camera's clock.
        dt : float [s]
            Until the next tick.
        frame_t : float, optional [s]
            Exposure of the newest picture that arrived.
        operator_t : float, optional [s]
            When the operator was last heard, if there is one.
        robot_t : float, optional [s]
            When the robot was last heard, if it answers.
        stop : bool
            Whether the operator's STOP is pressed.
        separation : str
            Why robots are too close, in one line; empty where they are not.

        Returns
        -------
        tick : PilotTick
            Its `sent.command` goes to the robot, and nothing else.
        """
        state = self.state_filter.predict(t + self.state_filter.options.actuation_delay_s)
        guidance = None
        command, trouble = STOP, ""
        if self._controller is not None:
            guidance = self._controller.step(state, self._progress, dt)
            command, trouble = guidance.command, guidance.trouble
        if self.vehicle is not None and command.finite:
            command = self.vehicle.feasible(command)
        sent = self.safety.check(
            command,
            Situation(
                t, state, frame_t, operator_t, robot_t, stop, separation, trouble or self._missing()
            ),
            self.memory,
        )
        self.memory = sent.memory
        if guidance is not None and sent.stop is None:
            self._progress = guidance.progress  # a robot that is stopped gets no further
        self.state_filter.sent(t, sent.command)
        return PilotTick(t, state, guidance, sent)

    def _missing(self) -> str:
        """What keeps the filter from an answer, where a robot is asked to move."""
        return "" if self._controller is None else self.state_filter.trouble
