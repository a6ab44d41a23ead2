"""What each order does. An order that cannot be carried out is refused with one line, and nothing changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from airground.control.command import STOP, VelocityCommand
from airground.errors import AirgroundError
from airground.session.fleet import Errand, limits_at
from airground.session.hand import HOLD_S, HandDriven
from airground.session.orders import (
    Calibrate,
    DriveTo,
    EndCalibration,
    FollowPath,
    Gone,
    Hand,
    Release,
    Rest,
    SetFences,
    SetSpeed,
    Sketch,
    Stop,
)
from airground.session.planning import plan_goals, plan_path, plan_sketch

if TYPE_CHECKING:
    from airground.session.fleet import Fleet
    from airground.session.inputs import Ordered
    from airground.session.member import Member
    from airground.session.session import Session

__all__ = ["Dispatch"]


class _NotNowError(Exception):
    """Why an order is not carried out."""


class Dispatch:
    """Carries out orders on a session.

    Parameters
    ----------
    session : Session
        Whose.
    """

    def __init__(self, session: Session) -> None:
        self._session = session

    def take(self, ordered: Ordered) -> None:
        """Carry out an order, or say why not.

        Parameters
        ----------
        ordered : Ordered
            Who asks for what.
        """
        session, client, order = self._session, ordered.client, ordered.order
        if isinstance(order, Stop):
            session.operator.stop_heard += 1
            session.stop(f"STOP, by {client}")
            return
        if isinstance(order, Gone):
            session.leave(client)
            return
        session.operator.hear(session.t, client)
        try:
            self._carry_out(client, order)
        except _NotNowError as why:
            session.refuse(client, str(why))

    def _carry_out(self, client: str, order: Any) -> None:
        session = self._session
        if isinstance(order, Release):
            session.release()
        elif isinstance(order, SetSpeed):
            member = self._member(order.robot)
            member.speed_mps = min(order.speed_mps, member.options.limits.speed_mps)
        elif isinstance(order, SetFences):
            session.set_fences(order)
        elif isinstance(order, Hand):
            self._by_hand(order)
        elif isinstance(order, Rest):
            self._rest(order)
        else:
            doing = _DOES.get(type(order))
            if doing is not None:  # to be alive asks for nothing
                doing(self, client, order)

    # Orders

    def _calibrate(self, client: str, order: Calibrate) -> None:
        del client
        self._moving()
        for name in order.robots:
            self._member(name)
        if self._session.camera.size_px is None:
            raise _NotNowError("the camera has not shown anything yet")
        self._session.begin_calibration(order)

    def _end_calibration(self, client: str, order: EndCalibration) -> None:
        if self._session.drive is None:
            raise _NotNowError("no calibration drive is under way")
        self._session.drive.end(keep=order.keep, client=client)

    def _rest(self, order: Rest) -> None:
        session = self._session
        if order.robot is None:
            session.rest_all()
            if session.drive is not None:
                session.drive.pause()
        else:
            self._member(order.robot)
            session.desk.cancel(f"way of {order.robot}")
            if session.fleet is not None:
                session.fleet.rest(order.robot)

    def _by_hand(self, order: Hand) -> None:
        session, member = self._session, self._member(order.robot)
        limits = limits_at(member)
        forward = limits.speed_mps if order.forward >= 0 else limits.reverse_mps
        left = order.turn * limits.turn_rate_radps
        if session.drive is not None:
            self._moving()
            session.drive.by_hand(member, VelocityCommand(order.forward * forward, left))
            return
        fleet = self._fleet()
        if fleet.ground.floor.clockwise:
            left = -left
        command = VelocityCommand(order.forward * forward, left)
        if command == STOP and fleet.errands[member.name].task != "hand":
            return  # a stick at rest takes nothing away from a robot on its way
        self._moving()
        session.desk.cancel(f"way of {member.name}")
        errand = Errand("hand", HandDriven(command), until_s=session.t + HOLD_S)
        fleet.assign(member.name, errand)

    def _drive_to(self, client: str, order: DriveTo) -> None:
        session, member, fleet = self._session, self._member(order.robot), self._ready()
        start = fleet.place(member.name)
        ground, robot, limits = fleet.ground, member.options, limits_at(member)
        what = f"way of {member.name}"
        session.desk.cancel(what)

        def then(result: Any) -> None:
            if isinstance(result, AirgroundError):
                session.refuse(client, str(result))
            elif session.fleet is fleet and not session.operator.stopped:
                fleet.assign(member.name, Errand("goal", result.controller, result.goals_px))

        session.desk.give(what, lambda: plan_goals(ground, robot, limits, order, start), then)

    def _sketch(self, client: str, order: Sketch) -> None:
        session, member = self._session, self._member(order.robot)
        if session.fleet is None:
            raise _NotNowError("the camera does not know the ground yet: calibrate first")
        fleet, size = session.fleet, session.camera.size_px
        ground, limits = fleet.ground, limits_at(member)
        radius = member.options.radius_m
        what = f"sketch of {member.name}"
        session.desk.cancel(what)

        def then(result: Any) -> None:
            if isinstance(result, AirgroundError):
                session.refuse(client, str(result))
            elif session.fleet is fleet:
                session.paths[member.name] = result

        session.desk.give(what, lambda: plan_sketch(ground, limits, order, size, radius), then)

    def _follow(self, client: str, order: FollowPath) -> None:
        session, member, fleet = self._session, self._member(order.robot), self._ready()
        path, view = session.paths.get(member.name, (None, None))
        if view is None or view.sketch != order.sketch:
            raise _NotNowError("that path is not known any more: draw it again")
        if path is None or not view.drivable:
            raise _NotNowError(f"the path cannot be driven: {view.undrivable[0][0]}")
        ground, robot, limits = fleet.ground, member.options, limits_at(member)
        what = f"way of {member.name}"
        session.desk.cancel(what)
        ends = (tuple(map(float, view.points[-1, :2])),)

        def then(result: Any) -> None:
            if isinstance(result, AirgroundError):
                session.refuse(client, str(result))
            elif session.fleet is fleet and not session.operator.stopped:
                start, along = result
                after = Errand("path", along, ends, length=float(path.length))  # type: ignore[arg-type]
                first = (tuple(map(float, view.points[0, :2])),)
                fleet.assign(member.name, Errand("to_path", start, first, then=after))  # type: ignore[arg-type]
                session.paths[member.name] = (path, replace(view, released=True))

        session.desk.give(what, lambda: plan_path(ground, robot, limits, path), then)

    # What must be so

    def _member(self, name: str) -> Member:
        member = self._session.members.get(name)
        if member is None:
            known = ", ".join(self._session.members)
            raise _NotNowError(f"there is no robot {name!r}; there are {known}")
        return member

    def _moving(self) -> None:
        if self._session.operator.stopped:
            raise _NotNowError("STOP is pressed: release it first")

    def _fleet(self) -> Fleet:
        if self._session.drive is not None:
            raise _NotNowError("a calibration drive is under way: end it first")
        if self._session.fleet is None:
            raise _NotNowError("the camera does not know the ground yet: calibrate first")
        if self._session.fences_trouble:
            raise _NotNowError(self._session.fences_trouble)
        if self._session.desk.waits_for("fences"):
            raise _NotNowError("the fences are being drawn: try again")
        return self._session.fleet

    def _ready(self) -> Fleet:
        self._moving()
        return self._fleet()


_DOES: dict[type, Callable[[Dispatch, str, Any], None]] = {
    Calibrate: Dispatch._calibrate,
    EndCalibration: Dispatch._end_calibration,
    DriveTo: Dispatch._drive_to,
    Sketch: Dispatch._sketch,
    FollowPath: Dispatch._follow,
}
