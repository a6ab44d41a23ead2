"""Lets the embedded world run by a clock, for several threads: the only place where its lock is taken."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.control.command import VelocityCommand
    from airground.robots.protocol import RobotReading
    from airground.sim.live_pictures import Picture
    from airground.sim.live_truth import RobotTruth
    from airground.sim.live_world import EmbeddedWorld

__all__ = ["Clockwork"]

SKIP_S = (
    2.0  # after a longer gap the computer has slept: nobody waits for the world to make up for it
)


class Clockwork:
    """A world and the clock it runs by. Whoever asks lets it come up to now first; nobody waits for drawing.

    Parameters
    ----------
    world : EmbeddedWorld
        Belongs to this from now on.
    clock : callable
        Gives seconds; a world that is behind it by more than two seconds skips them.
    """

    def __init__(self, world: EmbeddedWorld, clock: Callable[[], float]) -> None:
        self.world = world
        self.clock = clock
        self._lock = Lock()

    def readings(self, name: str) -> list[RobotReading]:
        """Give what a robot has told and nobody has asked for yet.

        Parameters
        ----------
        name : str
            Which robot.

        Returns
        -------
        readings : list of RobotReading
            In order.
        """
        with self._lock:
            return self.world.readings(name, self._come())

    def command(self, name: str, command: VelocityCommand) -> None:
        """Send a command to a robot, now.

        Parameters
        ----------
        name : str
            Which robot.
        command : VelocityCommand
            What to do; finite.
        """
        with self._lock:
            self.world.command(name, self._come(), command)

    def coming(self) -> tuple[float, tuple[Picture, ...], float]:
        """Give the pictures that have been taken and not been handed out.

        Returns
        -------
        now : float [s]
            On the clock.
        pictures : tuple of Picture
            In order.
        next_s : float [s]
            When the next one will be taken.
        """
        with self._lock:
            now = self._come()
            return now, self.world.shutter.coming(), self.world.shutter.next_s

    def arrived(self, picture: Picture) -> bool:
        """Hand out a picture, and leave out those before it.

        Parameters
        ----------
        picture : Picture
            One that was coming.

        Returns
        -------
        arrived : bool
            False where it was lost on its way after all.
        """
        with self._lock:
            self._come()
            return any(one.index == picture.index for one in self.world.pictures(picture.arrives_s))

    def truth(self, name: str) -> RobotTruth:
        """Tell where a robot really is now; for tests.

        Parameters
        ----------
        name : str
            Which robot, or "cart".

        Returns
        -------
        truth : RobotTruth
            Now.
        """
        with self._lock:
            return self.world.truth(name, self._come())

    def _come(self) -> float:
        """Let the world come up to now."""
        t = max(self.clock(), self.world.now)
        if t - self.world.now > SKIP_S:
            self.world.skip(t)
        else:
            self.world.advance(t)
        return t
