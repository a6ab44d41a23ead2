"""The layer between any controller and any robot: what leaves it is within the limits, or a stop with its reason.

It has no clock and no state of its own: what it must know of the past goes in and comes out as a `SafetyMemory`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, inf, isfinite, nan, pi, remainder, sin
from typing import TYPE_CHECKING

from airground.control.command import STOP, VelocityCommand
from airground.control.floor import Floor
from airground.control.limits import Limits
from airground.control.safety.answer import Looked, answer
from airground.control.safety.bounds import SafetyBounds
from airground.control.safety.calibration_sigma import CalibrationSigma
from airground.control.safety.checks import (
    jump_causes,
    link_causes,
    place_causes,
    state_causes,
    time_causes,
)
from airground.control.safety.fence import (
    STANDS_MPS,
    leaving_causes,
    outside_causes,
    spare_m,
)
from airground.control.safety.limits import limited, steady
from airground.control.safety.search import gently, headless, search_causes, without_heading
from airground.control.safety.types import (
    Cause,
    FenceTest,
    Place,
    SafetyMemory,
    Sent,
    Situation,
    StopReason,
)
from airground.errors import InputError
from airground.geometry.arrays import FloatArray

if TYPE_CHECKING:
    from airground.control.safety.obedience import Obedience

__all__ = ["SafetyLayer"]

ORDER = {reason: place for place, reason in enumerate(StopReason)}
PRESSED: Cause = (StopReason.OPERATOR, "STOP was pressed; release it to go on")
UNMOVED = frozenset({StopReason.STARTING})


@dataclass(frozen=True, slots=True, eq=False)
class SafetyLayer:
    """Limits and checks for one robot. Every command passes `check`, and what comes out is sent and logged."""

    floor: Floor
    """Ground and image."""

    limits: Limits
    """What the robot may do."""

    covariance: FloatArray | None
    """(6, 6). Of g, row by row; None only where g is the truth."""

    bounds: SafetyBounds = field(default_factory=SafetyBounds)
    """When it stops."""

    fence: FenceTest | None = None
    """Where the robot may be; everywhere where not given."""

    image_size_px: tuple[int, int] | None = None
    """Width and height of the image [px]; where not given, the robot may be outside."""

    _sigma: CalibrationSigma | None = field(init=False, repr=False)
    """The calibration's uncertainty at a place."""

    def __post_init__(self) -> None:
        sigma = None
        if self.covariance is not None:
            sigma = CalibrationSigma(self.floor, self.covariance)
            object.__setattr__(self, "covariance", sigma.covariance)
        object.__setattr__(self, "_sigma", sigma)
        if self.image_size_px is not None and not min(self.image_size_px) > 0:
            raise InputError(f"image_size_px must be positive, not {self.image_size_px}")
        if self.fence is not None:
            theirs, ours = self.fence.floor.ground_from_image, self.floor.ground_from_image
            if not (theirs == ours).all():
                raise InputError("the fence stands on another floor; build both on one Floor")

    def check(
        self, command: VelocityCommand | None, situation: Situation, memory: SafetyMemory
    ) -> Sent:
        """Let a command pass, held within the limits, or stop the robot and say why.

        Parameters
        ----------
        command : VelocityCommand or None
            What a controller wants; None where it gave nothing.
        situation : Situation
            All that is known now.
        memory : SafetyMemory
            What the last call gave; `SafetyMemory()` at the first.

        Returns
        -------
        sent : Sent
            The command to send, and why. It never raises, whatever live input holds.
        """
        try:
            causes, looked = self._look(command, situation, memory)
        except Exception as error:  # whatever goes wrong in here or in a fence, the robot must stop
            fault = (StopReason.FAULT, f"{type(error).__name__}: {error}".splitlines()[0])
            causes = [PRESSED, fault] if situation.stop else [fault]
            t: object = situation.t
            when = float(t) if isinstance(t, float | int) else nan
            looked, command = Looked(when, None, memory.obedience), None
        return answer(command, memory, causes, looked, limits=self.limits, bounds=self.bounds)

    def _look(
        self, command: VelocityCommand | None, now: Situation, memory: SafetyMemory
    ) -> tuple[list[Cause], Looked]:
        """All causes to stop, and what was seen."""
        causes: list[Cause] = []
        if now.stop:
            causes.append(PRESSED)
        if not isfinite(now.t):
            causes.append((StopReason.NOT_A_NUMBER, f"the time is {now.t}"))
            return causes, Looked(now.t, None, memory.obedience)
        late = time_causes(now.t, memory.t, self.bounds)
        dt = None if late or memory.t is None else now.t - memory.t
        causes += late
        causes += link_causes(now, self.bounds)
        causes += _answer_causes(command, now)
        bounds, state = self.bounds, now.state
        if now.searching:
            bounds = without_heading(bounds)
            command = None if command is None else gently(command, bounds)
            state = None if state is None else headless(state)
        wanted = STOP
        if command is not None and command.finite and dt is not None:
            wanted = limited(command, memory.sent, dt, self.limits)

        place: Place | None = None
        if state is None:
            causes.append((StopReason.TRACK, "there is no state: the robot has not been found"))
        else:
            found, place = state_causes(now, state, self.floor, bounds)
            causes += found
            if place is not None:
                u, v = state.uv.tolist()
                causes += place_causes(u, v, self._sigma, self.image_size_px, self.bounds)
        if now.searching:  # what it does cannot be compared with what it was told
            spare = inf
            if self.fence is not None and place is not None:
                spare = spare_m(place.x, place.y, place.sigma_m, self.fence, bounds)
            causes += search_causes(memory.sent, spare, bounds)
            return causes, Looked(now.t, dt, memory.obedience, None, wanted)
        obedience, found = self._obedience(place, memory, dt)
        causes += found
        if self.fence is not None and place is not None and now.state is not None:
            found, spare = outside_causes(place, self.fence, self.bounds)
            causes += found
            if not found and command is not None and command.finite and dt is not None:
                moving = (now.state.v, now.state.omega, now.state.lateral)
                for motion in self._motions(command, wanted, memory, moving):
                    causes += leaving_causes(
                        place, spare, motion, self.fence, limits=self.limits, bounds=self.bounds
                    )
        return causes, Looked(now.t, dt, obedience, place, wanted)

    def _motions(
        self,
        command: VelocityCommand,
        wanted: VelocityCommand,
        memory: SafetyMemory,
        moving: tuple[float, float, float],
    ) -> list[tuple[float, float, float]]:
        """Motions from which the robot must be able to stop: what it will do, and what it does if that is faster."""
        if not memory.going:  # it does not start towards where it may not go
            return [steady(command.v, command.omega, command.lateral, self.limits)]
        motions = [(wanted.v, wanted.omega, wanted.lateral)]
        if abs(moving[0]) + abs(moving[2]) > abs(wanted.v) + abs(wanted.lateral) + STANDS_MPS:
            motions.append(moving)
        return motions

    def _obedience(
        self, place: Place | None, memory: SafetyMemory, dt: float | None
    ) -> tuple[Obedience, list[Cause]]:
        """Compare what the robot did since the last tick with what it was told."""
        if dt is None:
            return memory.obedience, []
        seen, causes, before = None, list[Cause](), memory.place
        if place is not None and before is not None:
            causes = jump_causes(place, before, dt, self.limits, self.bounds)
            # Before it ever went, it may be carried to its place.
            if not causes and memory.held != UNMOVED:
                dx, dy = place.x - before.x, place.y - before.y
                turn = remainder(place.theta - before.theta, 2 * pi)
                middle = before.theta + turn / 2
                c, s = cos(middle), sin(middle)
                seen = ((c * dx + s * dy) / dt, (c * dy - s * dx) / dt, turn / dt)
        obedience = memory.obedience.after(memory.sent, seen, dt, self.bounds)
        if obedience.differs_s > self.bounds.persist_s:
            (v, _, omega), (seen_v, _, seen_omega) = obedience.told, obedience.seen
            line = (
                f"told {v:.2f} m/s and {omega:.2f} rad/s, does {seen_v:.2f} m/s "
                f"and {seen_omega:.2f} rad/s, for {obedience.differs_s:.1f} s"
            )
            causes.append((StopReason.DISOBEDIENCE, line))
        return obedience, causes


def _answer_causes(command: VelocityCommand | None, now: Situation) -> list[Cause]:
    """Look at what controller and separation say."""
    causes: list[Cause] = []
    if now.separation:
        causes.append((StopReason.SEPARATION, now.separation))
    if now.disobeys:
        causes.append((StopReason.DISOBEDIENCE, now.disobeys))
    if now.trouble:
        causes.append((StopReason.CONTROLLER, now.trouble))
    if command is None:
        causes.append((StopReason.CONTROLLER, "the controller gave no command"))
    elif not command.finite:
        line = f"the command is {command.v:g} m/s, {command.omega:g} rad/s, {command.lateral:g} m/s"
        causes.append((StopReason.NOT_A_NUMBER, line))
    return causes
