"""A robot of the embedded world as a driver gives one: read, told, stopped."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING, Literal, Protocol, Self

from airground.control.command import STOP, VelocityCommand
from airground.robots.protocol import RobotLink
from airground.sim.live_options import robot_places

if TYPE_CHECKING:
    from types import TracebackType

    from airground.robots.protocol import RobotReading
    from airground.sim.live_options import EmbeddedOptions

__all__ = ["EmbeddedRobot", "Wire", "embedded"]

LOST_S = 0.5


class Wire(Protocol):
    """The way to a world: the world itself, or a pipe to its process. Any thread may use it."""

    def clock(self) -> float:
        """Now, on the session's clock.

        Returns
        -------
        t : float [s]
            Of the session.
        """
        ...

    def readings(self, name: str) -> list[RobotReading]:
        """Give what a robot has told and nobody has asked for yet; never waits.

        Parameters
        ----------
        name : str
            Which robot.

        Returns
        -------
        readings : list of RobotReading
            Oldest first.
        """
        ...

    def command(self, name: str, command: VelocityCommand) -> None:
        """Send a command; never waits.

        Parameters
        ----------
        name : str
            To which robot.
        command : VelocityCommand
            What to do; finite.
        """
        ...


class EmbeddedRobot:
    """A `Robot`; any thread may use it.

    Parameters
    ----------
    name : str
        Of a robot of the world.
    wire : Wire
        The way to it.
    sideways : bool
        Whether it has wheels for that.
    """

    def __init__(self, name: str, wire: Wire, *, sideways: bool = False) -> None:
        self._name = name
        self._wire = wire
        self._sideways = sideways
        self._lock = Lock()  # of the counts; never held while the world is asked
        self._received = self._sent = 0
        self._heard_s: float | None = None
        self._closed = False

    @property
    def name(self) -> str:
        """What it is called."""
        return self._name

    @property
    def link(self) -> RobotLink:
        """How its connection stands."""
        with self._lock:
            state: Literal["opening", "live", "lost", "closed"] = "opening"
            note = ""
            if self._closed:
                state = "closed"
            elif self._heard_s is not None:
                silent_s = self._wire.clock() - self._heard_s
                state = "live" if silent_s <= LOST_S else "lost"
                note = "" if state == "live" else f"silent for {silent_s:.1f} s"
            return RobotLink(state, received=self._received, sent=self._sent, note=note)

    def read(self) -> list[RobotReading]:
        """Give what has arrived since one last asked.

        Returns
        -------
        readings : list of RobotReading
            Oldest first; never waits.
        """
        if self._closed:
            return []
        readings = self._wire.readings(self._name)
        if readings:
            with self._lock:
                self._received += len(readings)
                self._heard_s = readings[-1].t
        return readings

    def send(self, command: VelocityCommand) -> VelocityCommand:
        """Tell it what to do.

        Parameters
        ----------
        command : VelocityCommand
            What; one that is not finite stops it.

        Returns
        -------
        sent : VelocityCommand
            As it was sent: without a sideways speed where it has no wheels for that; at rest after `close`.
        """
        if self._closed or not command.finite:
            command = STOP
        if command.lateral and not self._sideways:
            command = VelocityCommand(command.v, command.omega)
        if not self._closed:
            self._tell(command)
        return command

    def stop(self) -> None:
        """Tell it to stand."""
        if not self._closed:
            self._tell(STOP)

    def close(self) -> None:
        """Stop it and let go of it; calling it again does nothing."""
        self.stop()
        self._closed = True

    def _tell(self, command: VelocityCommand) -> None:
        self._wire.command(self._name, command)
        with self._lock:
            self._sent += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def embedded(options: EmbeddedOptions, wire: Wire) -> dict[str, EmbeddedRobot]:
    """Make the robots of a world.

    Parameters
    ----------
    options : EmbeddedOptions
        Of it.
    wire : Wire
        The way to it.

    Returns
    -------
    robots : dict of str to EmbeddedRobot
        By name, in the order of their tags.
    """
    sideways = options.kind == "omni"
    places = robot_places(options)
    return {place.name: EmbeddedRobot(place.name, wire, sideways=sideways) for place in places}
