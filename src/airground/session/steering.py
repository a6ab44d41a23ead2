"""One step of all robots: by the calibration drive, by the fleet, or at rest; and what of it a person is told."""

from __future__ import annotations

from typing import TYPE_CHECKING

from airground.control.command import STOP
from airground.control.pilot import Links
from airground.control.safety.types import StopReason
from airground.session.fleet import limits_at
from airground.session.headway import Headway
from airground.session.views import blind_view, steered_view

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from airground.control.command import VelocityCommand
    from airground.control.pilot import PilotTick
    from airground.control.team import TeamTick
    from airground.session.fleet import Fleet
    from airground.session.session import Session
    from airground.session.tick import RobotView
    from airground.vision.tracker import Track

__all__ = ["Steering"]

NEVER = -1e9  # heard
GIVES_WAY_MPS = 0.03  # smaller changes that keep robots apart are not worth a line
WAITS_S = 4.0  # a robot that gives way for so long will not get on by itself
STANDS_MPS = 0.02
STOPPING_S = 1.5  # it has been told to stand, and may take so long
STRAYS_S = 5.0  # between two lines about a robot that moves and is to stand


class Steering:
    """Decides what all robots are told.

    Parameters
    ----------
    session : Session
        Whose.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._held: dict[str, str] = {}
        self._waits: dict[str, float] = {}
        self._headway = {name: Headway() for name in session.members}
        self._strays: dict[str, float] = {}

    def decide(
        self, others: Sequence[Track]
    ) -> tuple[dict[str, VelocityCommand], Callable[[], list[RobotView]]]:
        """Decide.

        Parameters
        ----------
        others : sequence of Track
            What else is in view.

        Returns
        -------
        commands : dict of str to VelocityCommand
            For the robots.
        views : callable
            To be called next, once: gives what a person is told, which no robot has to wait for.
        """
        session = self._session
        links = {name: self._links(name) for name in session.members}
        if session.drive is not None:
            views = session.drive.tick(session.t, links, others)
            return {view.name: view.command for view in views}, lambda: views
        if session.fleet is None:
            views = [blind_view(session.t, one, "none", None) for one in session.members.values()]
            return dict.fromkeys(session.members, STOP), lambda: views
        fleet = session.fleet
        for name, member in session.members.items():
            if fleet.pilot(name).safety.limits.speed_mps != limits_at(member).speed_mps:
                fleet.set_limits(name, limits_at(member))
        decided = fleet.tick(session.t, links, others)
        commands = {name: tick.command for name, tick in decided.ticks.items()}
        return commands, lambda: self._views(fleet, decided)

    def _views(self, fleet: Fleet, decided: TeamTick) -> list[RobotView]:
        session = self._session
        views = []
        for name, tick in decided.ticks.items():
            busy = fleet.errands[name].controller is not None
            if why := self._astray(fleet, name, tick, busy=busy):
                session.stop(f"{name}: {why}")
                busy = False
            apart = decided.separated[name]
            gives_way = apart.reason if apart.changed > GIVES_WAY_MPS else ""
            view = steered_view(session.t, session.members[name], fleet, tick, gives_way)
            found = busy and bool(tick.sent.causes)
            self._tell(view, busy=busy, found=found, gives_way=gives_way)
            views.append(view)
        return views

    def _astray(self, fleet: Fleet, name: str, tick: PilotTick, *, busy: bool) -> str:
        """Why all robots must stop until a person has looked, in one line; empty where they need not."""
        session, memory = self._session, tick.sent.memory
        disobeys = StopReason.DISOBEDIENCE in memory.latched
        lines = [k.line for k in tick.sent.causes if k.reason is StopReason.DISOBEDIENCE]
        line = lines[0] if lines else "does not do what it is told"
        if not busy:
            self._headway[name].rest()
            if disobeys and not session.operator.stopped:
                fleet.pilot(name).release()  # perhaps a person carries it
            astray = lines and memory.obedience.differs_s > session.options.bounds.persist_s
            if astray and session.t - self._strays.get(name, -1e9) > STRAYS_S:
                self._strays[name] = session.t
                stopped = session.operator.stopped
                what = "does not stop" if stopped else "moves and is to stand, is it carried?"
                session.say(f"{what}: {lines[-1]}", "error" if stopped else "warning", name)
            return ""
        if disobeys:
            self._strays[name] = session.t - STRAYS_S + STOPPING_S
            return line
        if self._headway[name].stuck(memory.place, tick.command, session.options.period_s):
            self._headway[name].rest()
            return "is told to drive and does not get on: blocked, or its motors are off"
        return ""

    def _tell(self, view: RobotView, *, busy: bool, found: bool, gives_way: str) -> None:
        session, name = self._session, view.name
        before = self._held.get(name, "")
        now = (
            before if busy and view.stop_reason else ""
        )  # what only waits for good ticks is no news
        if found:
            now = view.stop_reason
        if now and now != before:
            session.say(view.stop, "warning", name)
        elif before and not now and busy:
            session.say("goes on", "info", name)
        self._held[name] = now
        stands = abs(view.command.v) + abs(view.command.lateral) < STANDS_MPS
        if not (busy and stands and not view.done and not now):
            self._waits.pop(name, None)
        elif gives_way or name in self._waits:
            since = self._waits.setdefault(name, session.t)
            if since < session.t - WAITS_S:
                self._waits[name] = session.t + 1e9  # once
                session.say("waits: something stands in its way", "warning", name)

    def _links(self, name: str) -> Links:
        session = self._session
        member, heard_t = session.members[name], session.operator.heard_t
        busy = session.drive is not None
        if session.fleet is not None:
            busy = busy or session.fleet.errands[name].controller is not None
        frame_t = session.camera.fresh_t(session.offset_s)
        return Links(
            frame_t=NEVER if frame_t is None else frame_t,
            operator_t=(NEVER if heard_t is None else heard_t) if busy else None,
            robot_t=NEVER if member.heard_t is None else member.heard_t,
            stop=session.operator.stopped,
        )
