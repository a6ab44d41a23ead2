"""The embedded world that a live system can be run on: robots that are commanded, a cart, a camera, and their faults.

It is passive and deterministic: time passes where it is told to. `airground.sim.live` lets it run by a clock.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import hypot, inf, isfinite
from typing import TYPE_CHECKING

import numpy as np

from airground.errors import InputError
from airground.geometry.arrays import FloatArray
from airground.sim.live_faults import Faults
from airground.sim.live_fleet import LiveFleet
from airground.sim.live_options import EmbeddedOptions, RobotPlace, robot_places
from airground.sim.live_pictures import Picture, Shutter
from airground.sim.live_scene import CART, ROBOT_M, live_bodies, live_scene
from airground.sim.live_sight import LiveSight
from airground.sim.live_truth import RobotTruth, robot_truth
from airground.sim.renderer import Renderer
from airground.sim.scene_camera import Pinhole
from airground.sim.world import demo_world
from airground.vision.frame import Frame, ImageArray

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.robots.protocol import RobotReading
    from airground.sim.camera import SimCamera
    from airground.sim.scene import Scene
    from airground.vision.sightings import Sightings

__all__ = ["EmbeddedWorld"]
MEASURE_S = 0.1


class EmbeddedWorld:
    """The demo's warehouse with robots to be driven. Several threads need a lock around all but `draw`.

    Parameters
    ----------
    options : EmbeddedOptions, optional
        What it is made of; the defaults where not given.
    seed : int
        Of the floor and of all noise.
    start_s : float [s]
        Time at which all stand at their places.
    """

    def __init__(
        self, options: EmbeddedOptions | None = None, seed: int = 0, *, start_s: float = 0.0
    ) -> None:
        self.options = options = options or EmbeddedOptions()
        places = robot_places(options)
        self.faults = Faults(place.name for place in places)
        """What is wrong, to be switched."""
        self.seed = seed
        self._now = self._measured_s = float(start_s)
        moving, jitter = np.random.default_rng([seed, 0xE3]).spawn(2)
        self._places = places
        self._fleet = LiveFleet(places, options, self.faults, moving, self._now)
        self.shutter = Shutter(options, jitter, self._now)
        """Knows which pictures are on their way."""
        self.bodies = live_bodies(places, self._fleet.shown, self._fleet.cloth, cart=options.cart)
        """All that stands and drives there."""
        self._pinhole = Pinhole.of_world(demo_world())
        self._sight = LiveSight(self.bodies, self._pinhole, options.sigma_px, seed)
        self._image: ImageArray | None = None
        self._seen: Sightings | None = None
        self.closest_m: float = inf
        """Least distance of the middles of two vehicles so far [m]: nothing keeps them from driving through each
        other."""

    @property
    def now(self) -> float:
        """Time to which it has been advanced [s]."""
        return self._now

    @property
    def robots(self) -> tuple[RobotPlace, ...]:
        """The robots of ours, in the order of their tags."""
        return self._places

    @property
    def radius_m(self) -> float:
        """Of the circle around a robot's axle that holds all of it [m]."""
        return hypot(ROBOT_M[0], ROBOT_M[1]) / 2

    @cached_property
    def scene(self) -> Scene:
        """What the camera looks at, false sightings included; its floor is painted when one first asks."""
        return live_scene(self.bodies, self.seed)

    @cached_property
    def renderer(self) -> Renderer:
        """Draws what the camera sees."""
        return Renderer(self.scene, self.seed)

    @property
    def camera(self) -> SimCamera:
        """The camera over the plane of the marks: the truth that a calibration should find; for tests."""
        return self._pinhole.plane(ROBOT_M[2])

    @property
    def time_offset_s(self) -> float:
        """To be added to a time of the camera for that of the robots' readings [s]: the truth; for tests."""
        return self.options.odometry.latency_s - self.options.latency_s

    def advance(self, t: float) -> None:
        """Let time pass.

        Parameters
        ----------
        t : float [s]
            Until when; not before now.

        Raises
        ------
        InputError
            If it is.
        """
        self._ahead(t)
        self._fleet.advance(t)
        self.shutter.run(t, self.faults.state.camera)
        self._now = max(t, self._now)
        self._measure()

    def skip(self, t: float) -> None:
        """Let much time pass quickly: robots come to rest, and nothing is seen or heard of it.

        Parameters
        ----------
        t : float [s]
            Until when; not before now.

        Raises
        ------
        InputError
            If it is.
        """
        self._ahead(t)
        self._fleet.skip(t)
        self.shutter.skip(t)
        self._now = max(t, self._now)

    def command(self, name: str, t: float, command: VelocityCommand) -> None:
        """Send a command to a robot. Without one for half a second it stops by itself.

        Parameters
        ----------
        name : str
            Which robot.
        t : float [s]
            When; not before now, and not before the last one.
        command : VelocityCommand
            What to do.

        Raises
        ------
        InputError
            If there is no such robot, or the command is not finite, or not for its kind, or too late.
        """
        self._fleet.command(name, t, command)

    def readings(self, name: str, t: float) -> list[RobotReading]:
        """Give what a robot has told and nobody has asked for yet.

        Parameters
        ----------
        name : str
            Which robot.
        t : float [s]
            Now; the world must have been advanced to here.

        Returns
        -------
        readings : list of RobotReading
            In order. Stamped as a driver would: later than the truth by the least delay of the link.

        Raises
        ------
        InputError
            If there is no such robot, or the world has not come so far.
        """
        self._reached(t)
        return self._fleet.readings(name, t)

    def frames(self, t: float) -> list[Frame]:
        """Draw the pictures that have arrived and nobody has asked for yet, here or by `sightings`.

        Parameters
        ----------
        t : float [s]
            Now; the world must have been advanced to here.

        Returns
        -------
        frames : list of Frame
            In order. Nothing is drawn that nobody asks for.

        Raises
        ------
        InputError
            If the world has not come so far.
        """
        return [self.draw(picture) for picture in self.pictures(t)]

    def sightings(self, t: float) -> list[Sightings]:
        """See what is in the pictures that have arrived and nobody has asked for yet, without drawing them.

        Parameters
        ----------
        t : float [s]
            Now; the world must have been advanced to here.

        Returns
        -------
        sightings : list of Sightings
            One for each picture, in order; stamped like it.

        Raises
        ------
        InputError
            If the world has not come so far.
        """
        return [self.look(picture) for picture in self.pictures(t)]

    def pictures(self, t: float) -> list[Picture]:
        """Give the pictures that have arrived and nobody has asked for yet: to `draw` or to `look` at.

        Parameters
        ----------
        t : float [s]
            Now; the world must have been advanced to here.

        Returns
        -------
        pictures : list of Picture
            In order.

        Raises
        ------
        InputError
            If the world has not come so far.
        """
        self._reached(t)
        return self.shutter.arrived(t)

    def draw(self, picture: Picture) -> Frame:
        """Draw a picture. One thread may do so while another advances the world.

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
        """
        if self._image is None or not picture.frozen:
            self._image = self.renderer.image(picture.exposed_s, picture.index)
        p = picture
        return Frame(self._image, p.t, "world", p.index, p.segment, p.late_s)

    def look(self, picture: Picture) -> Sightings:
        """See what is in a picture, without drawing it.

        Parameters
        ----------
        picture : Picture
            Not older than some seconds.

        Returns
        -------
        sightings : Sightings
            With the tags' numbers as labels.

        Raises
        ------
        InputError
            If nobody remembers what it shows.
        """
        if self._seen is None or not picture.frozen:
            robots = self.faults.state.robots
            covered = frozenset(name for name, faults in robots.items() if faults.covered)
            self._seen = self._sight.look(picture, covered)
        return replace(self._seen, t=picture.t)

    def truth(self, name: str, t: float) -> RobotTruth:
        """Tell where a robot really is, false sightings apart; for tests.

        Parameters
        ----------
        name : str
            Which robot, or "cart".
        t : float [s]
            When: the last seconds are remembered.

        Returns
        -------
        truth : RobotTruth
            Then.

        Raises
        ------
        InputError
            If there is no such robot, or the time lies in the future or is forgotten.
        """
        pose = self._cart if name == CART and self.options.cart else self._fleet.vehicle(name).pose
        return robot_truth(pose, float(t), self.camera)

    def _ahead(self, t: float) -> None:
        if not (self._now - 1e-9 <= t and isfinite(t)):
            raise InputError(f"the embedded world is at {self._now} s and cannot go to {t} s")

    def _reached(self, t: float) -> None:
        if not t <= self._now + 1e-9:
            raise InputError(
                f"the embedded world is at {self._now} s, not at {t} s: advance it first"
            )

    def _measure(self) -> None:
        if self._now < self._measured_s + MEASURE_S:
            return
        self._measured_s = self._now
        cart = self._cart(np.array([self._now]))[0] if self.options.cart else np.zeros((0, 2))
        others = [(float(x), float(y)) for x, y in cart]
        self.closest_m = min(self.closest_m, self._fleet.closest_m(*others))

    def _cart(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        return next(body for body in self.bodies if body.name == CART).pose(t)
