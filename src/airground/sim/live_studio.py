"""Draws the embedded camera's pictures in a process of its own, as a real camera's are made elsewhere.

In the session's own process drawing would take half of a core, and Python's lock with it, from the loop that drives.
"""

from __future__ import annotations

import signal
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.shared_memory import SharedMemory
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import UnreachableError
from airground.sim.live_scene import live_scene
from airground.sim.live_world import EmbeddedWorld
from airground.sim.renderer import Renderer
from airground.vision.frame import Frame, ImageArray

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from airground.geometry.arrays import FloatArray
    from airground.sim.body_poses import PoseOfTime
    from airground.sim.live_options import EmbeddedOptions
    from airground.sim.live_pictures import Picture

__all__ = ["Studio"]

SPAN_S = 0.0035  # about an exposure's middle; what is drawn must have happened
SAMPLES = 5
CLOSING_S = 1.0

Poses = dict[str, tuple["FloatArray", "FloatArray"]]


class Studio:
    """Draws pictures of a world elsewhere. `open` it, from the thread that draws.

    Parameters
    ----------
    world : EmbeddedWorld
        Whose bodies are drawn.
    """

    def __init__(self, world: EmbeddedWorld) -> None:
        self._world = world
        self._size = world.camera.image_size_px
        self._memory: SharedMemory | None = None
        self._image: ImageArray | None = None

    def open(self) -> None:
        """Begin, and wait until the floor is painted.

        Raises
        ------
        UnreachableError
            If the other process does not come up.
        """
        context = get_context("spawn")  # a fork of a program with threads may hang
        width, height = self._size
        self._memory = SharedMemory(create=True, size=width * height * 3)
        self._pipe, theirs = context.Pipe()
        arguments = (theirs, self._memory.name, self._world.options, self._world.seed)
        self._process = context.Process(target=_paint, args=arguments, daemon=True)
        self._process.start()
        theirs.close()
        self._exchange(None)

    def draw(self, picture: Picture) -> Frame:
        """Draw a picture.

        Parameters
        ----------
        picture : Picture
            Not older than some seconds.

        Returns
        -------
        frame : Frame
            With it.

        Raises
        ------
        InputError
            If nobody remembers what it shows.
        UnreachableError
            If the other process has died.
        """
        if self._image is None or not picture.frozen:
            times = picture.exposed_s + np.linspace(-SPAN_S, SPAN_S, SAMPLES)
            poses = {body.name: body.pose(times) for body in self._world.bodies if body.moves}
            self._exchange((picture.exposed_s, picture.index, times, poses))
            width, height = self._size
            assert self._memory is not None
            shared = np.ndarray((height, width, 3), np.uint8, self._memory.buf)
            self._image = shared.copy()
        p = picture
        return Frame(self._image, p.t, "world", p.index, p.segment, p.late_s)

    def close(self) -> None:
        """Draw no more; calling it again does nothing."""
        if self._memory is None:
            return
        self._pipe.close()  # the other process ends by that
        self._process.join(CLOSING_S)
        if self._process.is_alive():
            self._process.terminate()
        self._memory.close()
        self._memory.unlink()
        self._memory = None

    def _exchange(self, order: object) -> None:
        try:
            if order is not None:
                self._pipe.send(order)
            self._pipe.recv()
        except (EOFError, OSError) as error:
            raise UnreachableError("the embedded camera's own process has died") from error


def _paint(pipe: Connection, memory_name: str, options: EmbeddedOptions, seed: int) -> None:
    """Draw what is asked for until the other side is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who started us
    world = EmbeddedWorld(options, seed)
    at_first = np.array([0.0, 1e-3])
    known = {body.name: (at_first, *body.pose(at_first * 0.0)) for body in world.bodies}

    def pose_of(name: str) -> PoseOfTime:
        def pose(t: FloatArray) -> tuple[FloatArray, FloatArray]:
            times, xy, theta = known[name]
            at = np.column_stack([np.interp(t, times, xy[:, k]) for k in (0, 1)])
            return at, np.interp(t, times, theta)

        return pose

    bodies = tuple(
        replace(body, pose=pose_of(body.name)) if body.moves else body for body in world.bodies
    )
    renderer = Renderer(live_scene(bodies, seed), seed)
    renderer.clean(0.0)  # paints the floor
    memory = SharedMemory(memory_name)
    width, height = world.camera.image_size_px
    shared = np.ndarray((height, width, 3), np.uint8, memory.buf)
    try:
        pipe.send("ready")
        while True:
            exposed_s, index, times, poses = pipe.recv()
            known.update({name: (times, *pose) for name, pose in poses.items()})
            shared[:] = renderer.image(exposed_s, index)
            pipe.send(index)
    except (EOFError, OSError):  # nobody wants pictures any more
        pass
    finally:
        del shared
        memory.close()
