"""What every command passes while there is no calibration: the safety layer without a floor.

Time, links, the operator's STOP, limits, obedience and memory are those of `SafetyLayer`. In place of the ground it
has the image: a mark that is lost stops the robot, and so does one that would leave the image.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite, nan
from typing import TYPE_CHECKING

from airground.control.command import STOP
from airground.control.limits import Limits
from airground.control.safety.answer import Looked, answer
from airground.control.safety.blind_checks import border_causes, mark_causes, seen_motion
from airground.control.safety.bounds import SafetyBounds
from airground.control.safety.checks import link_causes, time_causes
from airground.control.safety.limits import limited
from airground.control.safety.types import Cause, SafetyMemory, Sent, StopReason
from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.control.safety.blind_types import BlindSituation
    from airground.control.safety.obedience import Obedience

__all__ = ["BlindSafety"]

PRESSED: Cause = (StopReason.OPERATOR, "STOP was pressed; release it to go on")
UNMOVED = frozenset({StopReason.STARTING})


@dataclass(frozen=True, slots=True, eq=False)
class BlindSafety:
    """Limits and checks for one robot in an image of which nothing metric is known."""

    limits: Limits
    """What the robot may do."""

    image_size_px: tuple[int, int]
    """Width and height of the image [px]."""

    bounds: SafetyBounds = field(default_factory=SafetyBounds)
    """When it stops; what is said there of ground and state does not count here."""

    def __post_init__(self) -> None:
        if not min(self.image_size_px) > 0:
            raise InputError(f"image_size_px must be positive, not {self.image_size_px}")

    def check(
        self, command: VelocityCommand | None, situation: BlindSituation, memory: SafetyMemory
    ) -> Sent:
        """Let a command pass, held within the limits, or stop the robot and say why.

        Parameters
        ----------
        command : VelocityCommand or None
            What is wanted; None where nothing was given.
        situation : BlindSituation
            All that is known now.
        memory : SafetyMemory
            What the last call gave, or the last one of a `SafetyLayer`: either goes on from the other's.

        Returns
        -------
        sent : Sent
            The command to send, and why. It never raises, whatever live input holds.
        """
        try:
            causes, looked = self._look(command, situation, memory)
        except Exception as error:  # whatever goes wrong in here, the robot must stop
            fault = (StopReason.FAULT, f"{type(error).__name__}: {error}".splitlines()[0])
            causes = [PRESSED, fault] if situation.stop else [fault]
            t: object = situation.t
            when = float(t) if isinstance(t, float | int) else nan
            looked, command = Looked(when, None, memory.obedience), None
        return answer(command, memory, causes, looked, limits=self.limits, bounds=self.bounds)

    def _look(
        self, command: VelocityCommand | None, now: BlindSituation, memory: SafetyMemory
    ) -> tuple[list[Cause], Looked]:
        """All causes to stop, and what was seen."""
        bounds = self.bounds
        causes: list[Cause] = [PRESSED] if now.stop else []
        if not isfinite(now.t):
            causes.append((StopReason.NOT_A_NUMBER, f"the time is {now.t}"))
            return causes, Looked(now.t, None, memory.obedience)
        late = time_causes(now.t, memory.t, bounds)
        dt = None if late or memory.t is None else now.t - memory.t
        causes += late
        causes += link_causes(now.situation, bounds)
        causes += _told_causes(command, now)
        wanted = STOP
        if command is not None and command.finite and dt is not None:
            wanted = limited(command, memory.sent, dt, self.limits)
        lost = mark_causes(now, bounds)
        causes += lost
        if not lost:
            causes += border_causes(now, wanted, self.image_size_px, self.limits, bounds)
        obedience, found = self._obedience(now, memory, dt, seen=not lost)
        causes += found
        return causes, Looked(now.t, dt, obedience, None, wanted)

    def _obedience(
        self, now: BlindSituation, memory: SafetyMemory, dt: float | None, *, seen: bool
    ) -> tuple[Obedience, list[Cause]]:
        """Compare what the robot does with what it was told."""
        if dt is None:
            return memory.obedience, []
        motion = None
        if seen and memory.held != UNMOVED:  # before it ever went, it may be carried to its place
            motion = seen_motion(now, memory.obedience.following)
        obedience = memory.obedience.after(memory.sent, motion, dt, self.bounds)
        if obedience.differs_s <= self.bounds.persist_s:
            return obedience, []
        (v, _, omega), (seen_v, _, seen_omega) = obedience.told, obedience.seen
        line = (
            f"told {v:.2f} m/s and {omega:.2f} rad/s, does {seen_v:.2f} m/s "
            f"and {seen_omega:.2f} rad/s, for {obedience.differs_s:.1f} s"
        )
        return obedience, [(StopReason.DISOBEDIENCE, line)]


def _told_causes(command: VelocityCommand | None, now: BlindSituation) -> list[Cause]:
    """Look at what is wanted, and at what others say."""
    causes: list[Cause] = []
    if now.separation:
        causes.append((StopReason.SEPARATION, now.separation))
    if now.disobeys:
        causes.append((StopReason.DISOBEDIENCE, now.disobeys))
    if now.trouble:
        causes.append((StopReason.CONTROLLER, now.trouble))
    if command is None:
        causes.append((StopReason.CONTROLLER, "there is no command"))
    elif not command.finite:
        line = f"the command is {command.v:g} m/s, {command.omega:g} rad/s, {command.lateral:g} m/s"
        causes.append((StopReason.NOT_A_NUMBER, line))
    return causes
