"""Robots on a floor for tests of their separation, and how they move at their limits."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, sin
from typing import TYPE_CHECKING

import numpy as np

from airground.control import Floor, Limits, VelocityCommand
from airground.control.separation.fence import Fence
from airground.control.separation.types import Body
from airground.geometry import LimitedHomography
from airground.sim import SimCamera

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

DT = 0.1
SUBSTEPS = 8
CAR = Limits(turn_radius_m=0.4)
CAMERA = SimCamera.looking_down(
    focal_length_px=900.0, tilt_rad=0.4, height_m=12.0, image_size_px=(1280, 960)
)
MIDDLE = np.array([640.0, 480.0])
FLOOR = Floor(LimitedHomography(CAMERA.g), MIDDLE)


def fenced(*obstacles: ArrayLike, half: float = 2.5) -> Fence:
    square = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return Fence(FLOOR, (FLOOR.pixel(square),), tuple(FLOOR.pixel(one) for one in obstacles))


def body(x: float, y: float, theta: float = 0.0, v: float = 0.0, **other: object) -> Body:
    return replace(Body((x, y), theta, v, radius_m=0.2), **other)  # type: ignore[arg-type]


def driven(one: Body, told: VelocityCommand) -> tuple[Body, list[tuple[float, float]]]:
    """A robot after a step in which it comes to its command at its limits; its places meanwhile."""
    h, m = DT / SUBSTEPS, one.limits
    (x, y), theta, v, omega, lateral = one.xy, one.theta, one.v, one.omega, one.lateral
    places = []
    for _ in range(SUBSTEPS):
        off, across = told.v - v, told.lateral - lateral
        faster = hypot(told.v, told.lateral) > hypot(v, lateral)
        most = (m.acceleration_mps2 if faster else m.deceleration_mps2) * h
        share = min(1.0, most / max(hypot(off, across), 1e-12))
        v, lateral = v + share * off, lateral + share * across
        turn = m.turn_acceleration_radps2 * h
        omega += min(max(told.omega - omega, -turn), turn)
        theta += omega * h
        x += (v * cos(theta) - lateral * sin(theta)) * h
        y += (v * sin(theta) + lateral * cos(theta)) * h
        places.append((x, y))
    return replace(one, xy=(x, y), theta=theta, v=v, omega=omega, lateral=lateral), places
