"""What the process of the embedded world does: lets it run, sends its frames and readings, takes its commands."""

from __future__ import annotations

from contextlib import suppress
from threading import Event, Thread
from typing import TYPE_CHECKING, NamedTuple

from airground.errors import UnreachableError
from airground.sim.live import LiveWorld
from airground.sim.live_world import EmbeddedWorld
from airground.vision.shared_images import SharedImages
from airground.vision.threads import use_threads

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

    from airground.sim.live_camera import EmbeddedCamera
    from airground.sim.live_options import EmbeddedOptions
    from airground.vision.frame import Clock
    from airground.vision.sources.protocol import SourceHealth

__all__ = ["SLOTS", "Setup", "Shown", "Told", "work"]

SLOTS = 4
"""Images in shared memory."""

NEWS_S = 0.05  # between two words of the camera where no frame comes
READINGS_S = 0.02  # between two looks at the robots where nobody commands


class Shown(NamedTuple):
    """A frame on its way."""

    mark: int
    """Number of its image in shared memory."""

    about: tuple[float, Clock, int, int, float | None]
    """All else, in the order of `Frame`."""


class Told(NamedTuple):
    """A word of the camera."""

    health: SourceHealth
    """As it stands."""

    shown: Shown | None = None
    """The newest frame, where there is a new one."""

    error: str = ""
    """What is to be raised as `UnreachableError`; empty for nothing."""


class Setup(NamedTuple):
    """What is to be run."""

    options: EmbeddedOptions
    """Of the world."""

    seed: int
    """Of the world."""

    clock: Callable[[], float]
    """The session's."""

    images: str
    """Name of the shared memory."""

    shape: tuple[int, ...]
    """Of an image in it."""


def work(camera_pipe: Connection, robots_pipe: Connection, setup: Setup) -> None:
    """Run an embedded world until the other side is gone.

    Parameters
    ----------
    camera_pipe : Connection
        `Told` goes out.
    robots_pipe : Connection
        (Commands taken so far, readings by robot) goes out; (name, command) comes in.
    setup : Setup
        What is to be run.
    """
    use_threads(1)
    images = SharedImages(setup.shape, SLOTS, setup.images)
    ended = Event()
    with LiveWorld(EmbeddedWorld(setup.options, setup.seed), setup.clock) as world:
        arguments = (camera_pipe, world.camera, images, ended)
        camera = Thread(target=_show, args=arguments, name="camera", daemon=True)
        camera.start()
        try:
            _drive(robots_pipe, world, ended)
        finally:
            ended.set()
            world.close()
            camera.join()
            images.close()


def _drive(pipe: Connection, world: LiveWorld, ended: Event) -> None:
    taken = 0
    with suppress(EOFError, OSError):  # nobody is there any more
        while not ended.is_set():
            commanded = pipe.poll(READINGS_S)
            while commanded:
                name, command = pipe.recv()
                world.robots[name].send(command)
                taken += 1
                commanded = pipe.poll()
            told = {
                name: readings for name, one in world.robots.items() if (readings := one.read())
            }
            pipe.send((taken, told))


def _show(pipe: Connection, camera: EmbeddedCamera, images: SharedImages, ended: Event) -> None:
    try:
        with suppress(EOFError, OSError):
            _keep_showing(pipe, camera, images, ended)
    finally:
        ended.set()  # a bug here ends the whole: nobody is to take silence for a camera


def _keep_showing(
    pipe: Connection, camera: EmbeddedCamera, images: SharedImages, ended: Event
) -> None:
    mark = 0
    while not ended.is_set():
        error, shown = "", None
        try:
            frame = camera.read(NEWS_S)
        except UnreachableError as lost:
            frame, error = None, str(lost)
            ended.wait(NEWS_S)
        if frame is not None:
            mark += 1
            images.write(mark, frame.image)
            shown = Shown(mark, (frame.t, frame.clock, frame.index, frame.segment, frame.late_s))
        pipe.send(Told(camera.health, shown, error))
