"""What a live robot is to us: it is read, it is told, it is stopped. Drivers never block the loop that asks them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, Self, runtime_checkable

if TYPE_CHECKING:
    from types import TracebackType

    from airground.control.command import VelocityCommand

__all__ = ["Robot", "RobotLink", "RobotReading"]


@dataclass(frozen=True, slots=True)
class RobotReading:
    """What a robot tells about its own motion; None for what it does not tell."""

    t: float
    """When, on the session's clock [s]: the driver has brought the robot's stamps onto it (`StampClock`)."""

    heading: float | None = None
    """Compass [rad]; any number of turns."""

    speed: float | None = None
    """Along the heading [m/s]; negative in reverse."""

    turn_rate: float | None = None
    """Of the heading [rad/s]."""


@dataclass(frozen=True, slots=True)
class RobotLink:
    """How a driver's connection stands. A snapshot."""

    state: Literal["opening", "live", "lost", "closed"] = "opening"
    """opening: never heard; live: heard lately; lost: silent; closed: by us."""

    received: int = 0
    """Messages that were understood."""

    refused: int = 0
    """Messages that were not: malformed, not finite, stamped from nowhere."""

    sent: int = 0
    """Commands handed to the link."""

    note: str = ""
    """What a user should know, in one line; empty where all is well."""


@runtime_checkable
class Robot(Protocol):
    """A robot that is driven by velocity commands. A context manager; leaving it stops the robot."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    @property
    def link(self) -> RobotLink:
        """How its connection stands."""
        ...

    def read(self) -> list[RobotReading]:
        """Give what has arrived since one last asked; never waits.

        Returns
        -------
        readings : list of RobotReading
            Oldest first.
        """
        ...

    def send(self, command: VelocityCommand) -> VelocityCommand:
        """Tell it what to do; never waits, never raises for a lost link.

        Parameters
        ----------
        command : VelocityCommand
            What to do.

        Returns
        -------
        sent : VelocityCommand
            As it was sent.
        """
        ...

    def stop(self) -> None:
        """Tell it to stand, by the surest way there is; never raises."""
        ...

    def close(self) -> None:
        """Stop it and let go of the link; calling it again does nothing."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
