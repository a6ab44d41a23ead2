"""The embedded world in a process of its own, as real cameras and robots are elsewhere: here one hears and tells.

In the session's own process drawing and driving would take most of a core, and Python's lock with it, from the loop.
"""

from __future__ import annotations

from multiprocessing import Pipe
from threading import Lock
from time import monotonic
from types import MappingProxyType
from typing import TYPE_CHECKING, Self

from airground.errors import UnreachableError
from airground.sim.live_apart_work import SLOTS, Setup, work
from airground.sim.live_robot import EmbeddedRobot, embedded
from airground.sim.world import demo_world
from airground.vision.child import Child
from airground.vision.frame import Frame
from airground.vision.shared_images import SharedImages
from airground.vision.sources.protocol import SourceHealth

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from multiprocessing.connection import Connection
    from types import TracebackType

    from airground.control.command import VelocityCommand
    from airground.robots.protocol import RobotReading
    from airground.sim.live_apart_work import Shown
    from airground.sim.live_options import EmbeddedOptions

__all__ = ["CameraApart", "PipeWire", "WorldApart"]

MOST_UNHEARD = 100  # commands under way to a world that does not answer: a pipe holds some 250
DIED = "the embedded world: its process has died"


class WorldApart:
    """An embedded world that runs elsewhere by a clock. A context manager: it is to be closed.

    Parameters
    ----------
    options : EmbeddedOptions
        What it is made of.
    seed : int
        Of floor and noise.
    clock : callable
        The session's: gives seconds; can be pickled, and counts alike in every process.
    """

    def __init__(self, options: EmbeddedOptions, seed: int, clock: Callable[[], float]) -> None:
        width, height = demo_world().camera.image_size_px
        self._images = SharedImages((height, width, 3), SLOTS)
        ours, theirs = Pipe()
        setup = Setup(options, seed, clock, self._images.name, self._images.shape)
        self._child = Child("the embedded world", work, theirs, setup)
        theirs.close()
        self._wire = PipeWire(ours, clock)
        self.camera = CameraApart(self._child, self._images)
        """With the reading interface of `vision.sources.LiveSource`."""
        self.robots: Mapping[str, EmbeddedRobot] = MappingProxyType(embedded(options, self._wire))
        """By name, in the order of their tags."""

    def close(self) -> None:
        """Stop all robots and end the world; calling it again does nothing."""
        for robot in self.robots.values():
            robot.close()
        self.camera.close()
        self._wire.close()
        self._child.close()
        self._images.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class PipeWire:
    """A `Wire` to robots in another process.

    Parameters
    ----------
    pipe : Connection
        Commands go in, readings come out; belongs to this from now on.
    clock : callable
        The session's.
    """

    def __init__(self, pipe: Connection, clock: Callable[[], float]) -> None:
        self._pipe = pipe
        self._clock = clock
        self._lock = Lock()
        self._waiting: dict[str, list[RobotReading]] = {}
        self._told = self._heard = 0  # commands sent, and those that the other side has taken
        self._gone = False

    def clock(self) -> float:
        """Now, on the session's clock.

        Returns
        -------
        t : float [s]
            Of the session.
        """
        return self._clock()

    def readings(self, name: str) -> list[RobotReading]:
        """Give what a robot has told and nobody has asked for yet.

        Parameters
        ----------
        name : str
            Which robot.

        Returns
        -------
        readings : list of RobotReading
            Oldest first; none from a process that is gone.
        """
        with self._lock:
            self._take()
            return self._waiting.pop(name, [])

    def command(self, name: str, command: VelocityCommand) -> None:
        """Send a command; it is lost where the other process is gone, or takes none.

        Parameters
        ----------
        name : str
            To which robot.
        command : VelocityCommand
            What to do.
        """
        with self._lock:
            if self._told - self._heard >= MOST_UNHEARD:  # a full pipe would make us wait
                self._take()
            if self._gone or self._told - self._heard >= MOST_UNHEARD:
                return
            try:
                self._pipe.send((name, command))
                self._told += 1
            except (OSError, ValueError):
                self._gone = True

    def close(self) -> None:
        """Hear and tell nothing more; calling it again does nothing."""
        with self._lock:
            self._gone = True
            self._pipe.close()

    def _take(self) -> None:
        try:
            while not self._gone and self._pipe.poll():
                self._heard, told = self._pipe.recv()
                for name, readings in told.items():
                    self._waiting.setdefault(name, []).extend(readings)
        except (EOFError, OSError):
            self._gone = True


class CameraApart:
    """Frames of an embedded world elsewhere; one thread reads.

    Parameters
    ----------
    child : Child
        Its process.
    images : SharedImages
        Where its frames are.
    """

    frame_count: int | None = None
    name = "embedded"

    def __init__(self, child: Child, images: SharedImages) -> None:
        self._pipe = child.pipe
        self._images = images
        self._health = SourceHealth()
        self._closed = False

    @property
    def health(self) -> SourceHealth:
        """What the camera has met so far, as it told last."""
        return self._health

    def read(self, timeout_s: float | None = None) -> Frame | None:
        """Wait for a frame that was not read before.

        Parameters
        ----------
        timeout_s : float, optional [s]
            For how long; zero only looks, None waits until the camera is closed or given up.

        Returns
        -------
        frame : Frame or None
            The newest; None where none came in time, or the camera is closed.

        Raises
        ------
        UnreachableError
            If nothing has come for too long, or the other process has died. Reading again is allowed.
        """
        end_s = None if timeout_s is None else monotonic() + timeout_s
        while not self._closed:
            try:
                shown = self._newest(None if end_s is None else max(end_s - monotonic(), 0.0))
                if shown is not None:
                    image = self._images.read(shown.mark)
                    if image is not None:  # nobody was so slow that newer ones took its place
                        return Frame(image, *shown.about)
            except (EOFError, OSError) as error:
                self._health = SourceHealth("lost")
                raise UnreachableError(DIED) from error
            if end_s is not None and monotonic() >= end_s:
                return None
        return None

    def close(self) -> None:
        """Read no more; calling it again does nothing."""
        self._closed = True
        self._health = SourceHealth("ended")

    def _newest(self, timeout_s: float | None) -> Shown | None:
        """The newest frame that has come."""
        newest: Shown | None = None
        wait_s = timeout_s
        while self._pipe.poll(wait_s):
            told = self._pipe.recv()
            self._health = told.health
            if told.error:
                raise UnreachableError(told.error)
            newest = told.shown or newest
            wait_s = 0.0
        return newest
