"""What goes wrong in a live session, how to begin and end it, and what is to come of it: for tests and benchmark."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Literal

from airground.session.orders import DriveTo, Gone, Stop
from session_runs import session, speed, view

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.session.stepped import SteppedSession

AHEAD = (822.0, 227.0)
"""Three metres straight ahead of the red robot."""

ASIDE = (1000.0, 430.0)
"""On its right, so that it drives a curve at first."""


@dataclass(frozen=True)
class Fault:
    """One, while the red robot is on its way to a goal."""

    what: str
    """For the table in docs/faults.md."""

    begin: Callable[[SteppedSession], None]
    """Switches it on."""

    within_s: float
    """The robot is told to stand within so long."""

    still_s: float
    """It truly stands within so long; infinite where it goes on by itself before that, or does not hear."""

    says: str
    """Pattern of a line that a person is told."""

    then: Literal["goes on", "waits for release", "waits for an order"]
    """What happens once it is over."""

    camera: str = "live"
    """State of the camera meanwhile."""

    stops_all_s: float = inf
    """All robots are stopped within so long, and wait to be released; infinite where only this one is told to stand."""

    ends: bool = True
    """Whether what happens once it is over is what happens afterwards; otherwise, what happens while it lasts."""

    goal: tuple[float, float] = AHEAD
    """Where the robot goes."""

    run_up_s: float = 1.2
    """For how long it has been going when the fault comes."""

    @property
    def lasts_s(self) -> float:
        """For how long it must last, to see all that comes of it [s]."""
        bounds = (self.within_s, self.still_s, self.stops_all_s)
        return 0.15 + max(bound for bound in bounds if bound < inf)


@dataclass
class Answer:
    """What came of it."""

    rest_s: float = inf
    """From the fault until the robot was told to stand [s]."""

    still_s: float = inf
    """From the fault until it truly stood [s]."""

    stop_s: float = inf
    """From the fault until all robots were stopped [s]."""

    line: str = ""
    """Why, as a person was told when the robot was told to stand."""


def _silent(one: SteppedSession) -> None:
    one.operator = ""


def _gone(one: SteppedSession) -> None:
    one.operator = ""
    one.order(Gone())


FAULTS = {
    "frozen": Fault(
        "camera frozen: the same picture, new stamps",
        lambda one: one.world.faults.camera(frozen=True),
        *(0.56, 0.95),
        says="camera: frozen: the same picture for",
        then="goes on",
        camera="frozen",
    ),
    "gone": Fault(
        "camera gone",
        lambda one: one.world.faults.camera(gone=True),
        *(0.54, 0.95),
        says="camera: lost: no picture for|newest picture was taken 0.5. s ago",
        then="goes on",
        camera="lost",
    ),
    "late": Fault(
        "pictures late by 1 s, stamped truly",
        lambda one: one.world.faults.camera(late_s=1.0),
        *(0.6, 1.0),
        says="newest picture was taken 0.5. s ago",
        then="goes on",
        camera="late",
    ),
    "late, stamped at arrival": Fault(
        "pictures late by 1 s, stamped when they come",
        lambda one: one.world.faults.camera(late_s=1.0, stamped_late=True),
        *(0.6, 1.0),
        says="newest picture was taken 0.5. s ago",
        then="waits for release",
        stops_all_s=2.4,
    ),
    "link": Fault(
        "robot's link gone",
        lambda one: one.world.faults.robot("red", link_gone=True),
        *(0.54, 0.95),
        says="the robot was heard 0.5. s ago",
        then="goes on",
    ),
    "covered": Fault(
        "tracker lost the robot: its mark is covered",
        lambda one: one.world.faults.robot("red", covered=True),
        *(0.54, 0.95),
        says="the robot was seen 0.5. s ago",
        then="goes on",
    ),
    "false sighting": Fault(
        "its mark is seen 0.6 m off",
        lambda one: one.world.faults.robot("red", seen_off_m=(-0.6, 0.0)),
        *(0.6, inf),
        says="there is no state: the robot has not been found",
        then="goes on",
        ends=False,
    ),
    "pushed": Fault(
        "pushed by hand, half a metre",
        lambda one: one.world.faults.push("red", left_m=0.5),
        *(0.6, inf),
        says="there is no state: the robot has not been found",
        then="goes on",
        ends=False,
    ),
    "blocked": Fault(
        "robot blocked, its wheels turn",
        lambda one: one.world.faults.robot("red", blocked=True),
        *(0.6, 0.1),
        says="is not where its wheels have it: blocked, or carried",
        then="waits for release",
        stops_all_s=1.2,
    ),
    "motor off": Fault(
        "robot's motors off",
        lambda one: one.world.faults.robot("red", motor_off=True),
        *(2.8, 0.1),
        says="does not get on|blocked, or carried|does 0.00 m/s",
        then="waits for release",
        stops_all_s=2.8,
    ),
    "compass": Fault(
        "compass stuck, in a curve",
        lambda one: one.world.faults.robot("red", compass_stuck=True),
        *(1.7, inf),
        says="is not where its wheels have it: blocked, or carried",
        then="waits for release",
        stops_all_s=2.8,
        goal=ASIDE,
        run_up_s=0.4,
    ),
    "runaway": Fault(
        "robot does not heed commands, in a curve",
        lambda one: one.world.faults.robot("red", runaway=True),
        *(3.0, inf),
        says="told .* m/s and .* rad/s, does",
        then="waits for release",
        stops_all_s=3.0,
        goal=ASIDE,
        run_up_s=0.4,
    ),
    "operator silent": Fault(
        "operator silent",
        _silent,
        *(1.5, 1.8),
        says="me is not heard any more: all robots stand",
        then="waits for an order",
    ),
    "operator gone": Fault(
        "operator's connection closed, or controls handed over",
        _gone,
        *(0.5, 0.8),
        says="me left the controls: all robots stand",
        then="waits for an order",
    ),
    "STOP": Fault(
        "STOP pressed",
        lambda one: one.order(Stop(), "somebody"),
        *(0.021, 0.5),
        says="STOP, by somebody",
        then="waits for release",
        stops_all_s=0.021,
    ),
}


def with_fault(fault: Fault, wait_s: float, seed: int) -> tuple[SteppedSession, Answer]:
    """A session in which the fault came and still is there, and what it did."""
    one = session(1, seed=seed)
    one.run(0.3)
    one.order(DriveTo("red", (fault.goal,)))
    one.run(fault.run_up_s + wait_s)
    assert not view(one).command.at_rest
    fault.begin(one)
    began, answer = one.t, Answer()
    for _ in range(round(fault.lasts_s * 50)):
        tick = one.step()
        since = one.t - began
        if answer.rest_s == inf and view(one).command.at_rest:
            answer.rest_s, answer.line = since, view(one).stop or one.said[-1]
        if answer.still_s == inf and speed(one) < 0.02:
            answer.still_s = since
        if answer.stop_s == inf and tick.mode == "stopped":
            answer.stop_s = since
    return one, answer
