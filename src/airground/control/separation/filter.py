"""Keeps robots apart, inside a fence and clear of others, with a small change to what each is told.

First robots steer round each other (`courtesy`); then the nearest motion is taken from which all can still
come to rest in ground of their own (`rows`). The second step is what holds: it needs nothing of the first,
nor that others do as they were told, only that each can brake as its limits say.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import exp, inf, isfinite
from typing import TYPE_CHECKING

import numpy as np

from airground.control.command import STOP, VelocityCommand
from airground.control.separation.around import PASSERBY, joined, look_around, strips
from airground.control.separation.courtesy import Courtesy, desires, give_way
from airground.control.separation.reach import (
    Fleet,
    Motion,
    braked,
    fleet,
    reachable,
    stop_after,
    within,
)
from airground.control.separation.rows import Rows, certain, gather
from airground.control.separation.types import Separated, Separation
from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from airground.control.separation.fence import Fence
    from airground.control.separation.types import Body, Passerby

__all__ = ["SeparationFilter"]

_OPEN = 1e3  # [m]
_CHANGED = 1e-3  # [m/s] below which a change needs no reason
_NAMES = ("the fence", "a keep-out area", "the end of the view")  # as Fence.kinds


@dataclass(frozen=True, slots=True)
class SeparationFilter:
    """Changes the commands of several robots as little as it must.

    What is promised: from a state in which all could stop in time, robots never touch each other or cross the fence, as
    long as they brake as their limits say and are where `sigmas` deviations say. Passers-by that keep their velocity
    are not driven into; what they do to a robot at rest is not in its hands. That all arrive is not
    promised: two that meet in a gap too narrow for both wait there, until one is told to back out.
    """

    fence: Fence | None = None
    """Where robots may be; None bounds nothing."""

    margin_m: float = 0.03
    """Gap to keep between robots, and to boundaries [m]."""

    sigmas: float = 3.0
    """Deviations of positions that are kept free beyond it."""

    reaction_s: float = 0.05
    """Time that may pass before a robot begins to brake [s]: lag, a lost packet."""

    settle_s: float = 0.25
    """Time constant with which a gap may be used up [s]; 0 lets robots brake at the last moment."""

    passing_s: float = 4.0
    """Robots do not enter what a passer-by will sweep within this time [s]; one that is in it is held up only where
    it could not stop in time."""

    courtesy: Courtesy | None = field(default_factory=Courtesy)
    """How robots steer round each other; None brakes only."""

    clockwise: bool = False
    """Whether headings count clockwise (`Floor.clockwise`); robots keep to the right as seen from above."""

    def __post_init__(self) -> None:
        for name in ("margin_m", "sigmas", "reaction_s", "settle_s", "passing_s"):
            value = getattr(self, name)
            if not (isfinite(value) and value >= 0):
                raise InputError(f"{name} must be 0 or more and finite, not {value}")

    def step(
        self,
        bodies: Sequence[Body],
        wanted: Sequence[VelocityCommand],
        dt: float,
        passersby: Sequence[Passerby] = (),
        aims: Sequence[tuple[float, float] | None] | None = None,
    ) -> Separation:
        """Say what robots shall do in the next step.

        A command with NaN counts as a stop. A robot whose place or motion is not known is stopped, and as nobody knows
        where it is, all others are too; so are they where a passer-by has NaN.

        Parameters
        ----------
        bodies : sequence of Body
            All robots, at the time when the commands take effect.
        wanted : sequence of VelocityCommand
            What each shall do.
        dt : float [s]
            Until the next step.
        passersby : sequence of Passerby
            What else is there.
        aims : sequence of (x, y) or None, optional [m]
            Place on the ground that each robot is on the way to, such as a goal or a corner of its path. It only makes
            the courtesy better: a command that slows down to turn says little about where a robot wants to go.

        Returns
        -------
        answer : Separation
            A command for each.

        Raises
        ------
        InputError
            If there are not as many commands or aims as robots, or `dt` is not positive.
        """
        if len(bodies) != len(wanted):
            raise InputError(f"{len(bodies)} robots but {len(wanted)} commands; give one for each")
        if aims is not None and len(aims) != len(bodies):
            raise InputError(
                f"{len(bodies)} robots but {len(aims)} aims; give one or None for each"
            )
        if not (isfinite(dt) and dt > 0):
            raise InputError(f"dt must be positive and finite, not {dt}")
        if not bodies:
            return Separation((), inf)
        lost = _lost(bodies, passersby)
        if lost:
            return _all_stop(bodies, dt, lost)

        robots = fleet(bodies)
        told = [(c.v + 1j * c.lateral, c.omega) if c.finite else (0j, 0.0) for c in wanted]
        drives, turns = zip(*told, strict=True)
        asked = within(robots, Motion(np.array(drives), np.array(turns)))
        brake = braked(robots, dt)
        pace = np.maximum(robots.pace, robots.speed)
        stopping = 2 * dt + self.reaction_s + (pace + robots.gain * dt) / robots.loss
        polite = self.courtesy or Courtesy(horizon_s=0.0, settle_s=0.0)
        around = look_around(
            robots,
            self.fence,
            passersby,
            margin_m=self.margin_m,
            sigmas=self.sigmas,
            reach=pace * np.maximum(stopping, max(self.passing_s, polite.horizon_s)),
            wall_reach=pace * np.maximum(stopping, polite.settle_s),
        )
        if around.empty:
            return _free(reachable(robots, asked, dt), around.clearance_m)
        steered = asked
        if self.courtesy is not None:
            desire = desires(robots, asked, aims, self.courtesy)
            steered = give_way(
                robots, asked, desire, around, courtesy=self.courtesy, clockwise=self.clockwise
            )
        both = Motion(np.array([asked.drive, steered.drive]), np.array([asked.turn, steered.turn]))
        plain, target = map(Motion, *reachable(robots, both, dt))

        base = stop_after(robots, brake, dt, self.reaction_s)
        ahead = strips(around, np.maximum(stopping, self.passing_s))
        beside = joined(around.walls, around.strays, strips(around, stopping), ahead)
        rows = gather(base, around.pairs, beside)
        if len(ahead.who):
            late = rows.room[-len(ahead.who) :]
            late[late < 0] = _OPEN  # who is in the way of a passer-by may cross it
        gamma = 1.0 if self.settle_s == 0 else 1.0 - exp(-dt / self.settle_s)
        chosen, tight, solved = certain(
            robots, brake, target, rows, dt=dt, reaction_s=self.reaction_s, gamma=gamma
        )
        trouble = "" if solved else "the solver gave no answer: robots near something brake"
        why = _why(rows, np.flatnonzero(tight), len(bodies))
        cut, changed = _off(robots, chosen, target), _off(robots, chosen, plain)
        answers = []
        for k, (drive, turn) in enumerate(zip(*(part.tolist() for part in chosen), strict=True)):
            reason = ""
            if changed[k] > _CHANGED:
                reason = why[k] if cut[k] > _CHANGED and why[k] else "gives way"
                reason = f"{reason}; {trouble}" if trouble and why[k] else reason
            command = VelocityCommand(drive.real, turn, drive.imag)
            answers.append(Separated(command, reason, changed[k]))
        return Separation(tuple(answers), around.clearance_m, trouble)


def _free(motion: Motion, clearance_m: float) -> Separation:
    """Robots with nothing near them do what they shall."""
    each = zip(motion.drive.tolist(), motion.turn.tolist(), strict=True)
    answers = (Separated(VelocityCommand(drive.real, turn, drive.imag)) for drive, turn in each)
    return Separation(tuple(answers), clearance_m)


def _off(robots: Fleet, chosen: Motion, other: Motion) -> list[float]:
    """How far motions differ [m/s], turn rates counted at the rim."""
    rim = np.abs(robots.radius * (chosen.turn - other.turn))
    off: list[float] = np.maximum(np.abs(chosen.drive - other.drive), rim).tolist()
    return off


def _why(rows: Rows, tight: NDArray[np.intp], count: int) -> list[str]:
    """What keeps each robot from doing as it shall; the nearest has the last word."""
    why = [""] * count
    if not len(tight):
        return why
    each = zip(*(part[tight].tolist() for part in (rows.room, rows.who, rows.label)), strict=True)
    nearest_last = sorted(zip(tight.tolist(), each, strict=True), key=lambda one: -one[1][0])
    for row, (room, first, label) in nearest_last:
        says = "keeps clear of" if room >= 0 else "may only move away from"
        if row < len(rows.other):
            why[first], why[label] = f"{says} robot {label}", f"{says} robot {first}"
        elif label <= PASSERBY:
            why[first] = f"{says} passer-by {PASSERBY - label}"
        else:
            why[first] = f"{says} {_NAMES[-1 - label]}"
    return why


def _lost(bodies: Sequence[Body], passersby: Sequence[Passerby]) -> str:
    for k, body in enumerate(bodies):
        x, y = body.xy
        if not isfinite(x + y + body.theta + body.v + body.omega + body.lateral):
            return f"nobody knows where robot {k} is or how it moves"
    for k, other in enumerate(passersby):
        if not all(map(isfinite, (*other.xy, *other.xy_dot))):
            return f"nobody knows where passer-by {k} is or how it moves"
    return ""


def _all_stop(bodies: Sequence[Body], dt: float, trouble: str) -> Separation:
    told = []
    for body in bodies:
        command = STOP
        if all(map(isfinite, (body.v, body.omega, body.lateral))):
            motion = braked(fleet([replace(body, xy=(0.0, 0.0), theta=0.0)]), dt)
            drive = complex(motion.drive[0])
            command = VelocityCommand(drive.real, float(motion.turn[0]), drive.imag)
        told.append(Separated(command, f"brakes, {trouble}", abs(body.v)))
    return Separation(tuple(told), float("nan"), trouble)
