"""A robot of the embedded world as a driver gives one: read, told, stopped."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING, Literal, Self

from airground.control.command import STOP, VelocityCommand
from airground.robots.protocol import RobotLink

if TYPE_CHECKING:
    from types import TracebackType

    from airground.robots.protocol import RobotReading
    from airground.sim.live_clockwork import Clockwork

__all__ = ["EmbeddedRobot"]

LOST_S = 0.5


class EmbeddedRobot:
    """A `Robot`; any thread may use it.

    Parameters
    ----------
    name : str
        Of a robot of the world.
    clockwork : Clockwork
        The world, and what lets it run.
    """

    def __init__(self, name: str, clockwork: Clockwork) -> None:
        self._name = name
        self._clockwork = clockwork
        self._sideways = clockwork.world.options.kind == "omni"
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
                silent_s = self._clockwork.clock() - self._heard_s
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
        readings = self._clockwork.readings(self._name)
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
        self._clockwork.command(self._name, command)
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
