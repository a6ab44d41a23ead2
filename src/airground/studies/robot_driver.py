"""Drives a robot of the MuJoCo world by what the robot itself tells: swings its compass, drives segments, turns."""

from __future__ import annotations

from dataclasses import replace
from math import copysign, pi, remainder, tau
from typing import TYPE_CHECKING

import numpy as np

from airground.control.command import STOP, VelocityCommand
from airground.studies.compass_swing import CompassSwing, swing_compass

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from airground.robots.protocol import RobotReading
    from airground.sim3d.world import World3d
    from airground.vision.frame import Frame

__all__ = ["SEGMENT_S", "SPEED_MPS", "RobotDriver", "paper_headings", "random_headings"]

SPEED_MPS = 0.15
"""Along segments [m/s]."""

SEGMENT_S = 3.0
"""Of one segment [s]."""

SEGMENTS = 8
TURN_RAD = pi / 6
STEP_S = 0.05  # of the loop that drives
REST_S = 0.5  # before the first segment, and after each turn
SWING_S = 13.0  # of turning on the spot, more than once round
TURN_S = 8.0  # most for a turn
SURE_RAD = 0.02
TURN_RADPS = (0.12, 0.6)  # least, so that it does not stick, and most
RANDOM_TURN_RAD = (pi / 7, pi * 3 / 4)
TRIED = 4  # turns, of which the best one is made


def paper_headings() -> tuple[float, ...]:
    """Headings of the paper's drive.

    Returns
    -------
    headings : tuple of float [rad]
        Of eight segments, each 30 degrees further than the one before; from the first.
    """
    return tuple(k * TURN_RAD for k in range(SEGMENTS))


def random_headings(
    rng: np.random.Generator,
    *,
    segments: int = SEGMENTS,
    reach_m: tuple[float, float] = (1.1, 0.6),
) -> tuple[float, ...]:
    """Turn at random, stay in view, and see much of it.

    Parameters
    ----------
    rng : Generator
        Of the turns.
    segments : int
        How many.
    reach_m : (float, float) [m]
        How far from the drive's start the robot may get, along its first heading and across it, by its own reckoning,
        if any turn allows it.

    Returns
    -------
    headings : tuple of float [rad]
        Of the segments, from the first.
    """
    length, reach = SPEED_MPS * SEGMENT_S, np.array(reach_m)
    headings, ends = [0.0], [np.array([length, 0.0])]
    while len(headings) < segments:
        size = rng.uniform(*RANDOM_TURN_RAD, size=TRIED) * rng.choice([-1.0, 1.0], size=TRIED)
        tried = headings[-1] + size
        there = ends[-1] + length * np.column_stack([np.cos(tried), np.sin(tried)])
        outside = np.maximum(np.abs(there) - reach, 0.0).sum(axis=1)
        from_others = np.hypot(*(there[:, None] - np.stack(ends)).T).min(axis=0)
        k = int(np.argmax(from_others - 10 * outside))
        headings.append(float(tried[k]))
        ends.append(there[k])
    return tuple(headings)


class RobotDriver:
    """Commands the robot twenty times a second, hears it, and hands on the camera's pictures as they come.

    Parameters
    ----------
    world : World3d
        Where it is.
    name : str
        Of the robot.
    compass : CompassSwing, optional
        What its compass is known to read too much; nothing where not given.
    """

    def __init__(self, world: World3d, name: str, compass: CompassSwing | None = None) -> None:
        self.heard: list[RobotReading] = []
        """All readings since it was last swung, headings corrected."""
        self.compass = compass or CompassSwing(0.0, 0.0)
        """What its compass is known to read too much."""
        self._world = world
        self._name = name

    def swing(self) -> None:
        """Turn round on the spot, and learn from the encoders how the compass errs. Nothing is filmed."""
        for command, seconds in ((VelocityCommand(0.0, TURN_RADPS[1]), SWING_S), (STOP, REST_S)):
            for _ in range(round(seconds / STEP_S)):
                self._advance(command)
        t, heading, rate = (
            np.array(column, dtype=np.float64)
            for column in zip(*((k.t, k.heading, k.turn_rate) for k in self.heard), strict=True)
        )
        self.compass = swing_compass(t, heading, rate)
        self.heard = []
        self._world.drop_frames()

    def segments(self, headings: Sequence[float]) -> Iterator[Frame]:
        """Drive segments, with turns on the spot between them.

        Parameters
        ----------
        headings : sequence of float [rad]
            Of the segments, from where the robot points at first.

        Yields
        ------
        frame : Frame
            All pictures of the drive.
        """
        yield from self.hold(REST_S, STOP)
        first = self._heading() - headings[0]
        for k, heading in enumerate(headings):
            if k:
                yield from self._turn(first + heading)
            yield from self.hold(SEGMENT_S, VelocityCommand(SPEED_MPS, 0.0))
        yield from self.hold(REST_S, STOP)

    def hold(self, seconds: float, command: VelocityCommand) -> Iterator[Frame]:
        """Repeat a command.

        Parameters
        ----------
        seconds : float [s]
            For how long.
        command : VelocityCommand
            Which one.

        Yields
        ------
        frame : Frame
            All pictures meanwhile.
        """
        for _ in range(round(seconds / STEP_S)):
            yield from self._step(command)

    def _turn(self, wanted: float) -> Iterator[Frame]:
        end = self._world.now + TURN_S
        while abs(off := remainder(wanted - self._heading(), tau)) > SURE_RAD:
            if self._world.now > end:
                break
            least, most = TURN_RADPS
            rate = copysign(min(max(1.5 * abs(off), least), most), off)
            yield from self._step(VelocityCommand(0.0, rate))
        yield from self.hold(REST_S, STOP)

    def _heading(self) -> float:
        heading = self.heard[-1].heading
        assert heading is not None
        return heading

    def _step(self, command: VelocityCommand) -> Iterator[Frame]:
        self._advance(command)
        yield from self._world.frames(self._world.now)

    def _advance(self, command: VelocityCommand) -> None:
        world = self._world
        world.command(self._name, world.now, command)
        world.advance(world.now + STEP_S)
        for reading in world.readings(self._name, world.now):
            assert reading.heading is not None
            heading = self.compass.corrected(reading.heading)
            self.heard.append(replace(reading, heading=heading))
