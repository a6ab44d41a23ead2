"""One drive on a running session, by a program instead of a person: ``airground drive --site``."""

from __future__ import annotations

import queue
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.errors import InputError, UnreachableError
from airground.session.orders import Alive, DriveTo, FollowPath, Gone, SetSpeed, Sketch

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.session.handle import SessionHandle
    from airground.session.tick import RobotView, SessionTick

__all__ = ["SiteDriven", "SiteOrder", "drive_on_site"]

ME = "drive"
ALIVE_S = 0.2
FIND_S = 40.0  # for the robot to be seen and heard: a camera may take its time to start
PLAN_S = 20.0
SILENT_S = 2.0  # without a step: the session has ended
BEGIN_S = 5.0


@dataclass(frozen=True, slots=True)
class SiteOrder:
    """What is asked for."""

    robot: str
    """Which."""

    goals_px: tuple[tuple[float, float], ...] = ()
    """Raw pixels to drive to, in order; or"""

    points_px: tuple[tuple[float, float], ...] = ()
    """a sketch to follow."""

    heading_rad: float | None = None
    """Direction in the image at the end, from u towards v; any where None."""

    speed_mps: float | None = None
    """How fast; the robot's own where None."""


@dataclass(slots=True)
class SiteDriven:
    """How it went, as the camera saw it."""

    reached: bool = False
    """Whether the robot arrived."""

    trouble: str = ""
    """Why not, in one line."""

    time_s: float = 0.0
    """From the order to the end [s]."""

    goal_error_px: float | None = None
    """How far from the goal it is believed to stand, in the image [px]."""

    goal_error_m: float | None = None
    """The same on the ground [m]."""

    max_speed_mps: float = 0.0
    """Fastest that it was seen [m/s]."""

    stops: list[str] = field(default_factory=list)
    """Stops for safety, a line each."""

    path_px: list[float] = field(default_factory=list)
    """Distances from the path while following it [px]."""

    path_m: list[float] = field(default_factory=list)
    """The same on the ground [m]."""

    def document(self) -> dict[str, Any]:
        """Give the JSON object, with the keys of a drive in the embedded world.

        Returns
        -------
        document : dict
            What only the truth could tell is null.
        """
        return {
            "reached": self.reached,
            "trouble": self.trouble,
            "time_s": self.time_s,
            "goal_error_px": self.goal_error_px,
            "goal_error_m": self.goal_error_m,
            "path_rms_px": _rms(self.path_px),
            "path_rms_m": _rms(self.path_m),
            "oracle_path_rms_m": None,
            "sketch_rms_px": None,
            "max_speed_mps": self.max_speed_mps,
            "stops": len(self.stops),
            "stop_reasons": self.stops,
            "world": "site",
            "sight": "camera",
        }


def drive_on_site(
    live: SessionHandle,
    order: SiteOrder,
    *,
    patience_s: float,
    say: Callable[[str], None],
) -> SiteDriven:
    """Carry out an order on a running session with a calibration.

    Parameters
    ----------
    live : SessionHandle
        The session; nobody else is at its controls.
    order : SiteOrder
        What for.
    patience_s : float [s]
        After which it is given up.
    say : callable
        Is told what is being done.

    Returns
    -------
    driven : SiteDriven
        A robot that does not arrive is a result, not an error.

    Raises
    ------
    InputError
        If the session refuses the order, or the path cannot be driven.
    UnreachableError
        If the robot is not seen or not heard, or the session ends.
    """
    run = _Run(live, order)
    try:
        say(f"look for {order.robot}")
        run.find()
        if order.speed_mps is not None:
            live.submit(ME, SetSpeed(order.robot, order.speed_mps))
        if order.goals_px:
            say(f"{order.robot} drives to {len(order.goals_px)} goal(s)")
            live.submit(ME, DriveTo(order.robot, order.goals_px, order.heading_rad))
        else:
            say("make a path of the sketch")
            live.submit(ME, Sketch(order.robot, 1, order.points_px, order.speed_mps))
            run.release()
            say(f"{order.robot} drives to the path's start and follows it")
        return run.follow(patience_s)
    finally:
        live.submit(ME, Gone())
        run.end()


class _Run:
    def __init__(self, live: SessionHandle, order: SiteOrder) -> None:
        self._live, self._order = live, order
        self._ticks: queue.SimpleQueue[SessionTick] = queue.SimpleQueue()
        self.end = live.listen(self._ticks.put)
        self._alive_t = -1.0

    def find(self) -> None:
        """Wait until the robot is seen and heard."""
        until = self._live.now() + FIND_S
        while True:
            tick, view = self._next()
            if view.uv is not None and view.heard_s is not None and tick.camera.state == "live":
                return
            if tick.t > until:
                missing = "seen by the camera" if view.uv is None else "heard"
                raise UnreachableError(
                    f"{view.name} was not {missing} for {FIND_S:.0f} s; camera: {tick.camera.state} {tick.camera.line}"
                )

    def release(self) -> None:
        """Wait for the path and release it."""
        until = self._live.now() + PLAN_S
        while True:
            tick, _ = self._next()
            for path in tick.paths:
                if path.robot == self._order.robot:
                    if not path.drivable:
                        why = path.undrivable[0][0] if path.undrivable else "it is no path"
                        raise InputError(f"the path cannot be driven: {why}")
                    self._live.submit(ME, FollowPath(path.robot, path.sketch))
                    return
            if tick.t > until:
                raise InputError(f"no path came of the sketch within {PLAN_S:.0f} s")

    def follow(self, patience_s: float) -> SiteDriven:
        """Watch until it has arrived."""
        driven = SiteDriven()
        last_task = "goal" if self._order.goals_px else "path"
        began = self._live.now()
        stop = ""
        while True:
            tick, view = self._next()
            driven.time_s = tick.t - began
            driven.max_speed_mps = max(driven.max_speed_mps, abs(view.speed_mps or 0.0))
            if view.stop_reason not in ("", "starting", stop):
                driven.stops.append(f"{driven.time_s:.2f} s: {view.stop_reason}: {view.stop}")
            stop = view.stop_reason
            if view.task == last_task:
                driven.goal_error_px, driven.goal_error_m = view.error_px, view.error_m
                if view.task == "path" and view.error_px is not None and view.error_m is not None:
                    driven.path_px.append(view.error_px)
                    driven.path_m.append(view.error_m)
                if view.done:
                    driven.reached = True
                    return driven
            elif view.task == "none" and driven.time_s > BEGIN_S:
                driven.trouble = view.stop or tick.why or "the order was dropped"
            if tick.mode == "stopped":
                driven.trouble = tick.why
            elif driven.time_s > patience_s:
                driven.trouble = view.stop or f"not there after {patience_s:.0f} s"
            if driven.trouble:
                return driven

    def _next(self) -> tuple[SessionTick, RobotView]:
        """The next step, and the robot in it; lets the session know that somebody is there."""
        now = self._live.now()
        if now - self._alive_t > ALIVE_S:
            self._live.submit(ME, Alive())
            self._alive_t = now
        try:
            tick = self._ticks.get(timeout=SILENT_S)
        except queue.Empty:
            raise UnreachableError("the session has ended by itself") from None
        for client, why in tick.refused:
            if client == ME:
                raise InputError(why)
        views: dict[str, RobotView] = {view.name: view for view in tick.robots}
        if self._order.robot not in views:
            known = ", ".join(views)
            raise InputError(f"there is no robot {self._order.robot!r}; there are {known}")
        return tick, views[self._order.robot]


def _rms(values: list[float]) -> float | None:
    return float(np.sqrt(np.mean(np.square(values)))) if values else None
