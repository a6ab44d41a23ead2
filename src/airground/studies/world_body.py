"""Robot and camera of the MuJoCo world for the closed loop: our detector and tracker on its pictures, as they come."""

from __future__ import annotations

from typing import TYPE_CHECKING

from airground.sim3d.options import FAMILY
from airground.sim3d.vehicle import TRUTH_HZ
from airground.studies.compass_swing import CompassSwing
from airground.studies.rig_body import BodyPose, Sight, Told
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.tracker import Tracker

if TYPE_CHECKING:
    from collections.abc import Callable

    from airground.control.command import VelocityCommand
    from airground.sim3d.world import World3d
    from airground.vision.eyes import Look, Looks

__all__ = ["WorldBody", "tag_eyes"]


def tag_eyes() -> Eyes:
    """Our eyes for the world's tags.

    Returns
    -------
    eyes : Eyes
        Detector and tracker.
    """
    return Eyes(make_detector(f"tag:family={FAMILY}"), Tracker())


class WorldBody:
    """One robot of a world. The loop's time begins now; its steps must be whole hundredths of a second.

    Parameters
    ----------
    world : World3d
        Where it is; left open.
    name : str
        Of the robot.
    compass : CompassSwing, optional
        What its compass is known to read too much; nothing where not given.
    eyes : Looks, optional
        That look at the pictures; `tag_eyes` where not given.
    each : callable, optional
        Told of every picture.
    """

    def __init__(
        self,
        world: World3d,
        name: str,
        *,
        compass: CompassSwing | None = None,
        eyes: Looks | None = None,
        each: Callable[[Look], None] | None = None,
    ) -> None:
        self._world = world
        self._name = name
        self._compass = compass or CompassSwing(0.0, 0.0)
        self._eyes = eyes or tag_eyes()
        self._each = each
        self._label = str(next(one.tag for one in world.options.robots if one.name == name))
        self._start_s = world.now
        self._frame_t: float | None = None
        world.readings(name, world.now)  # what it told before is of before

    @property
    def frame_t(self) -> float | None:
        """Stamp of the newest picture in which the ground was found [s]; None before the first."""
        return self._frame_t

    @property
    def pose(self) -> BodyPose:
        """Of now, in truth."""
        t = round(self._world.now * TRUTH_HZ) / TRUTH_HZ
        truth = self._world.truth(self._name, t)
        return BodyPose(truth.xy, truth.theta, truth.v, truth.omega)

    def advance(self, t: float) -> None:
        """Let time pass.

        Parameters
        ----------
        t : float [s]
            Until when.
        """
        self._world.advance(self._start_s + t)

    def sightings(self) -> list[Sight]:
        """Look at the pictures that have arrived.

        Returns
        -------
        sightings : list of Sight
            Of the robot, in order.
        """
        found = []
        for frame in self._world.frames(self._world.now):
            look = self._eyes.look(frame)
            if self._each is not None:
                self._each(look)
            if look.lost:
                continue
            t = frame.t - self._start_s
            self._frame_t = t
            for track in look.state.tracks:
                if track.label == self._label and track.sighting is not None:
                    row, seen = track.sighting, look.sightings
                    found.append(Sight(t, seen.uv[row], seen.covariance[row]))
        return found

    def readings(self) -> list[Told]:
        """Hear the robot.

        Returns
        -------
        readings : list of Told
            In order, with the compass's swing taken out.
        """
        return [
            Told(
                one.t - self._start_s,
                None if one.heading is None else self._compass.corrected(one.heading),
                one.speed,
                one.turn_rate,
            )
            for one in self._world.readings(self._name, self._world.now)
        ]

    def command(self, command: VelocityCommand) -> None:
        """Send a command, now.

        Parameters
        ----------
        command : VelocityCommand
            To the robot.
        """
        self._world.command(self._name, self._world.now, command)
