"""From causes to what is sent: at rest while there is one, and for some good ticks after it; what is latched waits."""

from __future__ import annotations

from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from airground.control.command import STOP, VelocityCommand
from airground.control.safety.limits import limited
from airground.control.safety.types import KEPT, Place, SafetyMemory, Sent, Stop, StopReason

if TYPE_CHECKING:
    from collections.abc import Mapping

    from airground.control.limits import Limits
    from airground.control.safety.bounds import SafetyBounds
    from airground.control.safety.obedience import Obedience
    from airground.control.safety.types import Cause

__all__ = ["Looked", "answer"]

ORDER = {reason: place for place, reason in enumerate(StopReason)}


class Looked(NamedTuple):
    """What a tick found besides causes."""

    t: float
    """Now [s]; may be NaN."""

    dt: float | None
    """Since the last tick [s]; None where that is not known."""

    obedience: Obedience
    """What the robot was told against what it was seen to do."""

    place: Place | None = None
    """Where it is on the floor; None where that is not known."""

    wanted: VelocityCommand = STOP
    """What would be sent, within the limits."""


def answer(
    command: VelocityCommand | None,
    memory: SafetyMemory,
    causes: list[Cause],
    looked: Looked,
    *,
    limits: Limits,
    bounds: SafetyBounds,
) -> Sent:
    """Say what is sent, and what is to be remembered.

    Parameters
    ----------
    command : VelocityCommand or None
        What came in.
    memory : SafetyMemory
        Of the last tick.
    causes : list of (StopReason, str)
        To stop; sorted by gravity in place.
    looked : Looked
        What else was found.
    limits : Limits
        How the robot brakes where stops are gentle.
    bounds : SafetyBounds
        How many good ticks, and whether stops are gentle.

    Returns
    -------
    sent : Sent
        The wanted command, or rest.
    """
    t, dt = looked.t, looked.dt
    stops: tuple[Stop, ...] = ()
    latched, held = memory.latched, memory.held | memory.latched
    if causes:
        causes.sort(key=lambda cause: ORDER[cause[0]])
        stops = tuple(Stop(t, *cause) for cause in causes)
        reasons = frozenset(stop.reason for stop in stops)
        latched |= {reason for reason in reasons if reason.latched}
        held |= reasons
    good = 0 if stops or dt is None else memory.good_ticks + 1
    if not latched and good >= bounds.good_ticks:
        held = frozenset()
    why: Stop | None = None
    if not held:
        sent = looked.wanted
    else:
        why = stops[0] if stops else _waiting(t, held, latched, good, bounds)
        gentle = bounds.gentle and dt is not None and not any(r.hard for r in held)
        sent = limited(STOP, memory.sent, dt, limits) if gentle and dt else STOP
    new = tuple(stop for stop in stops if stop.reason not in memory.held)
    return Sent(
        command=sent,
        asked=command,
        stop=why,
        causes=stops,
        memory=SafetyMemory(
            t=t if isfinite(t) else memory.t,
            sent=sent,
            place=looked.place,
            good_ticks=good,
            held=held,
            latched=latched,
            obedience=looked.obedience,
            stops=(memory.stops + new)[-KEPT:] if new else memory.stops,
            counts=_counted(memory.counts, new) if new else memory.counts,
        ),
    )


def _waiting(
    t: float,
    held: frozenset[StopReason],
    latched: frozenset[StopReason],
    good: int,
    bounds: SafetyBounds,
) -> Stop:
    """Say what it waits for while there is no cause any more."""
    if latched:
        reason = min(latched, key=ORDER.__getitem__)
        return Stop(t, reason, f"{reason.value}: waits to be released")
    reason = min(held, key=ORDER.__getitem__, default=StopReason.STARTING)
    line = f"{reason.value}: {good} of {bounds.good_ticks} good ticks before it goes on"
    return Stop(t, reason, line)


def _counted(counts: Mapping[StopReason, int], new: tuple[Stop, ...]) -> Mapping[StopReason, int]:
    more = dict(counts)
    for reason in {stop.reason for stop in new}:
        more[reason] = more.get(reason, 0) + 1
    return MappingProxyType(more)
