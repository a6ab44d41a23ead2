"""Several robots under one camera: each has its pilot, and what they wish passes a filter that keeps them apart."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from airground.control.separation.types import Body
from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from airground.control.pilot import Links, Pilot, PilotTick, Wish
    from airground.control.separation.filter import SeparationFilter
    from airground.control.separation.types import Passerby, Separated

__all__ = ["Team", "TeamMember", "TeamTick"]


@dataclass(frozen=True, slots=True, eq=False)
class TeamMember:
    """A robot that heeds the others."""

    pilot: Pilot
    """What steers it."""

    radius_m: float
    """Of the disc around its axle that holds all of it [m]."""

    omnidirectional: bool = False
    """Whether it drives sideways too."""


@dataclass(frozen=True, slots=True, eq=False)
class TeamTick:
    """All that was decided at one time."""

    ticks: Mapping[str, PilotTick]
    """By robot: what is sent to it, and why."""

    separated: Mapping[str, Separated]
    """By robot: what keeping apart made of its wish."""


class Team:
    """Steers several robots; all their pilots are built on one floor.

    Parameters
    ----------
    members : mapping of str to TeamMember
        By robot's name.
    separation : SeparationFilter
        Keeps them apart, inside the fence and clear of others.

    Raises
    ------
    InputError
        If their floors differ.
    """

    def __init__(self, members: Mapping[str, TeamMember], separation: SeparationFilter) -> None:
        self.members = dict(members)
        self.separation = separation
        floors = [member.pilot.state_filter.floor for member in self.members.values()]
        for floor in floors[1:]:
            if not (floor.ground_from_image == floors[0].ground_from_image).all():
                raise InputError("robots of a team must be steered on one floor; build them on it")

    def tick(
        self,
        t: float,
        dt: float,
        links: Mapping[str, Links] | None = None,
        passersby: Sequence[Passerby] = (),
    ) -> TeamTick:
        """Decide what to tell all robots.

        Parameters
        ----------
        t : float [s]
            Now, on the camera's clock.
        dt : float [s]
            Until the next tick.
        links : mapping of str to Links, optional
            By robot: when others were last heard.
        passersby : sequence of Passerby
            What else is on the ground.

        Returns
        -------
        tick : TeamTick
            A command for each robot.
        """
        links = links or {}
        wishes = {name: member.pilot.wish(t, dt) for name, member in self.members.items()}
        answer = self.separation.step(
            [self._body(name, wish) for name, wish in wishes.items()],
            [wish.command for wish in wishes.values()],
            dt,
            passersby,
            [self._aim(name, wish) for name, wish in wishes.items()],
        )
        separated = dict(zip(wishes, answer.robots, strict=True))
        ticks = {
            name: self.members[name].pilot.send(
                wish, links.get(name), instead=separated[name].command
            )
            for name, wish in wishes.items()
        }
        return TeamTick(ticks, separated)

    def _body(self, name: str, wish: Wish) -> Body:
        member, state = self.members[name], wish.state
        # What it was told, not what it does by now: of a drive that lags, a step's gain of speed on the latter would be
        # a fraction of what it can do. `SeparationFilter.reaction_s` is what covers the lag.
        known = isfinite(state.v + state.omega)
        return Body.seen(
            member.pilot.state_filter.floor,
            state,
            radius_m=member.radius_m,
            limits=member.pilot.safety.limits,
            omnidirectional=member.omnidirectional,
            told=member.pilot.memory.sent if known else None,
        )

    def _aim(self, name: str, wish: Wish) -> tuple[float, float] | None:
        if wish.guidance is None:
            return None
        floor = self.members[name].pilot.state_filter.floor
        x, y = floor.position_of(*wish.guidance.wanted_uv.tolist())
        return (x, y) if isfinite(x + y) else None
