"""The embedded world, running: a live camera and live robots for a session that cannot tell them from real ones."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Self

from airground.sim.live_camera import EmbeddedCamera
from airground.sim.live_clockwork import Clockwork
from airground.sim.live_robot import EmbeddedRobot, embedded

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import TracebackType

    from airground.sim.live_faults import Faults
    from airground.sim.live_truth import RobotTruth
    from airground.sim.live_world import EmbeddedWorld

__all__ = ["LiveWorld"]


class LiveWorld:
    """An embedded world that runs by a clock. A context manager: the camera draws while it is open.

    Parameters
    ----------
    world : EmbeddedWorld
        Belongs to this from now on.
    clock : callable
        The session's: gives seconds.
    """

    def __init__(self, world: EmbeddedWorld, clock: Callable[[], float]) -> None:
        self._clockwork = Clockwork(world, clock)
        self.camera = EmbeddedCamera(self._clockwork)
        """With the reading interface of `vision.sources.LiveSource`."""
        self.robots: Mapping[str, EmbeddedRobot] = MappingProxyType(
            embedded(world.options, self._clockwork)
        )
        """By name, in the order of their tags."""

    @property
    def faults(self) -> Faults:
        """What is wrong, to be switched."""
        return self._clockwork.world.faults

    @property
    def world(self) -> EmbeddedWorld:
        """The world itself; not to be advanced by anybody else."""
        return self._clockwork.world

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

        Raises
        ------
        InputError
            If there is no such robot.
        """
        return self._clockwork.truth(name)

    def start(self) -> Self:
        """Begin; the camera's first frame comes when the floor is painted.

        Returns
        -------
        self : LiveWorld
            The same.
        """
        self.camera.start()
        return self

    def close(self) -> None:
        """Stop all robots and the camera; calling it again does nothing."""
        for robot in self.robots.values():
            robot.close()
        self.camera.close()

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
