"""Robots that are steered with a calibration: belief, task, separation and safety of all of them, on one floor."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import TYPE_CHECKING

import numpy as np

from airground.control.estimation.state_filter import StateFilter
from airground.control.pilot import Links, Pilot
from airground.control.safety.layer import SafetyLayer
from airground.control.separation.filter import SeparationFilter
from airground.control.separation.types import Passerby
from airground.control.speed_hold import SpeedHold
from airground.control.team import Team, TeamMember

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from airground.control import Controller, Limits
    from airground.control.separation.fence import Fence
    from airground.control.team import TeamTick
    from airground.geometry.arrays import FloatArray
    from airground.robots import RobotReading
    from airground.session.ground import Ground
    from airground.session.member import Member
    from airground.session.options import RobotOptions, SessionOptions
    from airground.session.tick import Task
    from airground.vision.tracker import Track

__all__ = ["NOTHING", "Errand", "Fleet", "limits_at"]

OTHERS_S = 0.5  # something else that was not seen for so long is not avoided any more: it would be where it is not


@dataclass(frozen=True, slots=True, eq=False)
class Errand:
    """What a robot was asked to do."""

    task: Task
    """Of which kind."""

    controller: Controller | None
    """What brings it there; None to stand."""

    goals_px: tuple[tuple[float, float], ...] = ()
    """Where it leads, in raw pixels."""

    length: float = 0.0
    """Progress at its end; 0 where that is not told."""

    then: Errand | None = None
    """What follows when it has arrived."""

    until_s: float | None = None
    """When it ends by itself [s]; None for not."""


NOTHING = Errand("none", None)


class Fleet:
    """All robots of a session, once the camera is known.

    Parameters
    ----------
    ground : Ground
        Where they drive.
    options : SessionOptions
        Of the session.
    members : mapping of str to Member
        The robots.
    fresh : bool
        Whether the calibration was made in this session: then headings of gyroscopes count too.
    size_px : (int, int) or None [px]
        Of the image.
    """

    def __init__(
        self,
        ground: Ground,
        options: SessionOptions,
        members: Mapping[str, Member],
        *,
        fresh: bool,
        size_px: tuple[int, int] | None,
    ) -> None:
        self.ground = ground
        self._options = options
        self._offset_s = ground.calibration.time_offset_s
        self._size_px = size_px if ground.calibration.lens is None else None
        self._biases = {name: _bias(ground, one.options, fresh) for name, one in members.items()}
        self._others: Sequence[Track] = ()
        self._found: list[tuple[float, float, float, float, float]] = []
        self.errands: dict[str, Errand] = dict.fromkeys(members, NOTHING)
        self.arrived: dict[str, bool] = dict.fromkeys(members, False)
        team = {
            name: TeamMember(
                self._pilot(one),
                one.options.radius_m,
                omnidirectional=one.options.kind == "omni",
            )
            for name, one in members.items()
        }
        self.team = Team(team, SeparationFilter())
        self.set_fence(ground.fence)

    def pilot(self, name: str) -> Pilot:
        """Who steers a robot.

        Parameters
        ----------
        name : str
            Of the robot.

        Returns
        -------
        pilot : Pilot
            Its.
        """
        return self.team.members[name].pilot

    def set_fence(self, fence: Fence | None) -> None:
        """Hold robots in other bounds from now on.

        Parameters
        ----------
        fence : Fence or None
            On this floor.
        """
        self.ground = replace(self.ground, fence=fence)
        self.team.separation = SeparationFilter(
            fence=fence,
            margin_m=self._options.margin_m,
            clockwise=self.ground.floor.clockwise,
            reaction_s=max(
                (o.state.speed_lag_s + 0.05 for o in self._options.robots), default=0.05
            ),
        )
        for member in self.team.members.values():
            member.pilot.safety = self._safety(member.pilot.safety.limits, member.radius_m)

    def set_limits(self, name: str, limits: Limits) -> None:
        """Let a robot drive at another speed.

        Parameters
        ----------
        name : str
            Which.
        limits : Limits
            From now on.
        """
        member = self.team.members[name]
        member.pilot.safety = self._safety(limits, member.radius_m)

    def see(self, name: str, t: float, uv: FloatArray, covariance: FloatArray) -> None:
        """Take a sighting.

        Parameters
        ----------
        name : str
            Of the robot.
        t : float [s]
            As the camera stamped it.
        uv : (2,) array [px]
            In raw pixels.
        covariance : (2, 2) array [px2]
            Of that.
        """
        undistorted = self.ground.calibration.undistort(uv)
        self.pilot(name).state_filter.see(t + self._offset_s, undistorted, covariance)

    def hear(self, name: str, readings: Sequence[RobotReading]) -> None:
        """Take readings.

        Parameters
        ----------
        name : str
            Of the robot.
        readings : sequence of RobotReading
            Oldest first.
        """
        bias = self._biases[name]
        for one in readings:
            heading = None
            if bias is not None and one.heading is not None:
                heading = one.heading - bias
            self.pilot(name).state_filter.read(
                one.t, heading=heading, speed=one.speed, turn_rate=one.turn_rate
            )

    def assign(self, name: str, errand: Errand) -> None:
        """Give a robot something else to do.

        Parameters
        ----------
        name : str
            Which.
        errand : Errand
            What.
        """
        self.errands[name] = errand
        self.arrived[name] = False
        self.pilot(name).assign(errand.controller)

    def rest(self, name: str) -> None:
        """Let a robot stand.

        Parameters
        ----------
        name : str
            Which.
        """
        if self.errands[name] is not NOTHING:
            self.assign(name, NOTHING)

    def place(self, name: str) -> FloatArray:
        """Where a robot is now.

        Parameters
        ----------
        name : str
            Which.

        Returns
        -------
        uv : (2,) array [px]
            Undistorted; NaN where that is not known.
        """
        uv = self.pilot(name).memory.place
        if uv is None:
            return np.full(2, nan)
        return np.asarray(self.ground.floor.pixel(np.array([uv.x, uv.y])))

    def tick(self, t: float, links: Mapping[str, Links], others: Sequence[Track]) -> TeamTick:
        """Decide what all robots are told.

        Parameters
        ----------
        t : float [s]
            Now.
        links : mapping of str to Links
            When others were last heard, on the session's clock.
        others : sequence of Track
            What else is in view.

        Returns
        -------
        tick : TeamTick
            A command for each robot.
        """
        for name, errand in self.errands.items():
            if errand.until_s is not None and t > errand.until_s:
                self.rest(name)
        tick = self.team.tick(t, self._options.period_s, links, self._passersby(t, others))
        for name, one in tick.ticks.items():
            then = self.errands[name].then
            if one.done and then is not None:
                self.assign(name, then)
            elif one.done and not self.arrived[name]:
                self.arrived[name] = True
        return tick

    def _passersby(self, t: float, others: Sequence[Track]) -> list[Passerby]:
        """Everything else on the ground; found once for each frame, and taken to go on as it goes in between."""
        if others is not self._others:
            self._others = others
            self._found = [k for k in (self._passerby(one) for one in others) if k is not None]
        radius = self._options.others_radius_m
        return [
            Passerby((x + vx * (t - then), y + vy * (t - then)), (vx, vy), radius)
            for then, x, y, vx, vy in self._found
        ]

    def _passerby(self, one: Track) -> tuple[float, float, float, float, float] | None:
        if not one.confirmed or one.lost_for > OTHERS_S:
            return None
        calibration = self.ground.calibration
        x, y = self.ground.floor.position(calibration.undistort(one.uv)).tolist()
        uv_dot = calibration.undistort_velocity(one.uv, one.uv_dot)
        vx, vy = calibration.model.ground_velocity(calibration.undistort(one.uv), uv_dot).tolist()
        if not isfinite(x + y + vx + vy):
            return None
        return one.t + self._offset_s, x, y, vx, vy

    def _pilot(self, member: Member) -> Pilot:
        robot, limits = member.options, limits_at(member)
        target = self.ground.calibration.targets.get(robot.name)
        state = replace(robot.state, time_offset_s=0.0)
        if target is not None and target.lever_arm_m is not None:
            state = replace(state, lever_arm_m=target.lever_arm_m)
        return Pilot(
            StateFilter(self.ground.floor, state),
            self._safety(limits, robot.radius_m),
            speed_hold=SpeedHold(),
        )

    def _safety(self, limits: Limits, radius_m: float) -> SafetyLayer:
        bounds = self._options.bounds
        fence = self.ground.fence
        if fence is not None:
            bounds = replace(bounds, fence_margin_m=max(bounds.fence_margin_m, radius_m))
        return SafetyLayer(
            self.ground.floor,
            limits,
            self.ground.calibration.covariance,
            bounds,
            fence=fence,
            image_size_px=self._size_px,
        )


def limits_at(member: Member) -> Limits:
    """Limits of a robot at the speed that the operator set.

    Parameters
    ----------
    member : Member
        Which.

    Returns
    -------
    limits : Limits
        Not above its own.
    """
    own = member.options.limits
    return replace(
        own,
        speed_mps=min(own.speed_mps, member.speed_mps),
        reverse_mps=min(own.reverse_mps, member.speed_mps),
    )


def _bias(ground: Ground, robot: RobotOptions, fresh: bool) -> float | None:
    """What its compass reads too much; None where its heading must not be used."""
    target = ground.calibration.targets.get(robot.name)
    if robot.compass == "relative" and not (fresh and target is not None):
        return None
    if target is None or target.heading_bias_rad is None:
        return 0.0
    return target.heading_bias_rad
