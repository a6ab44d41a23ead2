"""The MuJoCo world: passive and deterministic, like `EmbeddedWorld`. Time passes where it is told to."""

from __future__ import annotations

import weakref
from collections import deque
from math import floor, inf, isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim3d.backend import load_mujoco
from airground.sim3d.camera_pose import CameraPose
from airground.sim3d.canvas import Canvas
from airground.sim3d.eye import Eye3d
from airground.sim3d.options import World3dOptions
from airground.sim3d.route import RouteDriver
from airground.sim3d.scene import build_scene, paint_scene
from airground.sim3d.vehicle import TRUTH_HZ, Vehicle3d
from airground.vision.frame import Frame

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType
    from typing import Self

    from airground.control.command import VelocityCommand
    from airground.geometry.lens import DivisionLens
    from airground.robots.protocol import RobotReading
    from airground.sim3d.truth import Truth3d

__all__ = ["World3d"]

DRIVER_HZ = 20.0  # of others
MOST_PICTURES = 200
SETTLED_S = 0.5  # the vehicles sink into their contacts before the world begins


class _Picture(NamedTuple):
    """A picture before anybody has drawn it."""

    number: int
    exposed_s: float
    qpos: FloatArray
    pose: CameraPose


class World3d:
    """Robots, other vehicles and a camera in MuJoCo. A context manager; one thread at a time.

    Parameters
    ----------
    options : World3dOptions, optional
        What it is made of; the defaults where not given.
    seed : int
        Of the floor and of all noise.
    start_s : float [s]
        Time at which all stand at their places.
    camera_pose : callable, optional
        Where the camera is at a time, for one that moves; as the options say where not given.

    Raises
    ------
    InputError
        If MuJoCo is not installed, or the options cannot be built.
    """

    def __init__(
        self,
        options: World3dOptions | None = None,
        seed: int = 0,
        *,
        start_s: float = 0.0,
        camera_pose: Callable[[float], CameraPose] | None = None,
    ) -> None:
        self.options = options = options or World3dOptions()
        self.seed = seed
        camera = options.camera
        still = CameraPose.looking_at(camera.position_m, camera.target_m, roll_rad=camera.roll_rad)
        self.camera_pose: Callable[[float], CameraPose] = camera_pose or (lambda _: still)
        """Where the camera is at a time: the truth."""
        self._canvas = Canvas.of(camera)
        self._mujoco = mujoco = load_mujoco()
        self._model = mujoco.MjModel.from_xml_string(build_scene(options, self._canvas))
        self._data = mujoco.MjData(self._model)
        self._eye: Eye3d | None = None
        self._start_s, self._steps = float(start_s), 0
        rngs = np.random.default_rng([seed, 0x3D]).spawn(len(options.vehicles))
        self._vehicles = {
            one.name: Vehicle3d(one, r) for one, r in zip(options.vehicles, rngs, strict=True)
        }
        self._drivers = {other.name: RouteDriver(other) for other in options.others}
        self._pictures: deque[_Picture] = deque(maxlen=MOST_PICTURES)
        self._clocks: list[tuple[float, Callable[[], None]]] = [
            (TRUTH_HZ, self._note),
            (DRIVER_HZ, self._drive_others),
            *((robot.options.readings_hz, self._measuring(robot.name)) for robot in options.robots),
            (camera.rate_hz, self._expose),
        ]
        self._done = [0] * len(self._clocks)
        self._shot = 0
        mujoco.mj_step(self._model, self._data, round(SETTLED_S / options.step_s))
        self._tick()

    @property
    def now(self) -> float:
        """Time to which it has been advanced [s]."""
        return self._start_s + self._steps * self.options.step_s

    @property
    def lens(self) -> DivisionLens:
        """Of the camera: the truth."""
        return self._canvas.lens

    @property
    def time_offset_s(self) -> float:
        """To be added to a time of the camera for that of the first robot's readings [s]: the truth."""
        return self.options.robots[0].options.latency_s - self.options.camera.latency_s

    def advance(self, t: float) -> None:
        """Let time pass, in whole steps.

        Parameters
        ----------
        t : float [s]
            Until when; not before now.

        Raises
        ------
        InputError
            If it is.
        """
        if not (self.now - self.options.step_s < t and isfinite(t)):
            raise InputError(f"the world is at {self.now} s and cannot go to {t} s")
        last = self._step_at(t)
        while self._steps < last:
            until = min(last, *(self._due(k) for k in range(len(self._clocks))))
            changing = min(vehicle.motors.next_s for vehicle in self._vehicles.values())
            if changing < inf:
                until = min(until, max(self._step_at(changing, up=True), self._steps + 1))
            self._mujoco.mj_step(self._model, self._data, until - self._steps)
            self._steps = until
            self._tick()

    def command(self, name: str, t: float, command: VelocityCommand) -> None:
        """Send a command to a robot. Without one for half a second it stops by itself.

        Parameters
        ----------
        name : str
            Which robot of ours.
        t : float [s]
            When; not before now, and not before the last one.
        command : VelocityCommand
            What to do.

        Raises
        ------
        InputError
            If there is no such robot, or the command is not finite, or sideways, or too late.
        """
        vehicle = self._ours(name)
        if not (self.now - self.options.step_s < t and isfinite(t)):
            raise InputError(f"the world is at {self.now} s, and a command of {t} s is too late")
        vehicle.motors.tell(t, command)

    def readings(self, name: str, t: float) -> list[RobotReading]:
        """Give what a robot has told and nobody has asked for yet.

        Parameters
        ----------
        name : str
            Which robot of ours.
        t : float [s]
            Now; the world must have been advanced to here.

        Returns
        -------
        readings : list of RobotReading
            In order; stamped when they arrive.

        Raises
        ------
        InputError
            If there is no such robot, or the world has not come so far.
        """
        self._reached(t)
        return self._ours(name).readings(t)

    def frames(self, t: float) -> list[Frame]:
        """Draw the pictures that have arrived and nobody has asked for yet.

        Parameters
        ----------
        t : float [s]
            Now; the world must have been advanced to here.

        Returns
        -------
        frames : list of Frame
            In order; stamped when they arrive. Nothing is drawn that nobody asks for.

        Raises
        ------
        InputError
            If the world has not come so far.
        UnreachableError
            If nothing can be drawn here.
        """
        self._reached(t)
        late, found = self.options.camera.latency_s, []
        while self._pictures and self._pictures[0].exposed_s + late <= t + 1e-9:
            one = self._pictures.popleft()
            image = self.eye.image(one.qpos, one.pose, one.number)
            found.append(Frame(image, one.exposed_s + late, "world", one.number))
        return found

    def drop_frames(self) -> None:
        """Forget all pictures that nobody has asked for, undrawn."""
        self._pictures.clear()

    def truth(self, name: str, t: float) -> Truth3d:
        """Tell where a vehicle really was.

        Parameters
        ----------
        name : str
            One of ours or of others.
        t : float [s]
            When: the last minute is remembered.

        Returns
        -------
        truth : Truth3d
            Then.

        Raises
        ------
        InputError
            If there is no such vehicle, or the time is forgotten or to come.
        """
        return self._vehicle(name).log.at(t)

    @property
    def eye(self) -> Eye3d:
        """The camera, which is opened when one first asks."""
        if self._eye is None:
            paint_scene(self._model, self._mujoco, self.options, self.seed)
            camera = self.options.camera
            self._eye = Eye3d(self._mujoco, self._model, camera, self._canvas, self.seed)
            weakref.finalize(self, self._eye.close)  # before Python takes OpenGL apart at its end
        return self._eye

    def close(self) -> None:
        """Let go of the renderer; calling it again does nothing."""
        if self._eye is not None:
            self._eye.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _step_at(self, t: float, *, up: bool = False) -> int:
        steps = (t - self._start_s) / self.options.step_s
        return -floor(-steps + 1e-6) if up else floor(steps + 1e-6)

    def _due(self, clock: int) -> int:
        return round(self._done[clock] / (self._clocks[clock][0] * self.options.step_s))

    def _tick(self) -> None:
        """Do all that is due now."""
        due = [k for k in range(len(self._clocks)) if self._due(k) <= self._steps]
        if due:
            self._mujoco.mj_forward(self._model, self._data)  # what was stepped is half a step old
        for k in due:
            self._done[k] += 1
            self._clocks[k][1]()
        for vehicle in self._vehicles.values():
            vehicle.motors.act(self._data, self.now)

    def _note(self) -> None:
        for vehicle in self._vehicles.values():
            vehicle.note(self._data, self.now)

    def _drive_others(self) -> None:
        for name, driver in self._drivers.items():
            vehicle = self._vehicles[name]
            vehicle.motors.tell(self.now, driver.command(*vehicle.log.pose))

    def _measuring(self, name: str) -> Callable[[], None]:
        return lambda: self._vehicles[name].measure(self._data, self.now)

    def _expose(self) -> None:
        pose = self.camera_pose(self.now)
        self._pictures.append(_Picture(self._shot, self.now, self._data.qpos.copy(), pose))
        self._shot += 1

    def _vehicle(self, name: str) -> Vehicle3d:
        if name not in self._vehicles:
            raise InputError(
                f"no vehicle is called {name!r}; there are {', '.join(self._vehicles)}"
            )
        return self._vehicles[name]

    def _ours(self, name: str) -> Vehicle3d:
        if name in self._drivers:
            raise InputError(f"{name} is somebody else's: it can be neither told nor asked")
        return self._vehicle(name)

    def _reached(self, t: float) -> None:
        if not t <= self.now + self.options.step_s:
            raise InputError(f"the world is at {self.now} s, not at {t} s: advance it first")
