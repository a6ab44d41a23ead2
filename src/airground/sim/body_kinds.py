"""Ready-made bodies: robots, carts, cars, boxes, pillars, people."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground.geometry.arrays import FloatArray
from airground.sim.body import Body, Colour, Disc, Lamp, Mark, Part, Patch

if TYPE_CHECKING:
    from airground.sim.body_poses import PoseOfTime

__all__ = ["box", "car", "person", "pillar", "rectangle", "robot", "round_outline", "round_robot"]

RUBBER = (38.0, 36.0, 35.0)
GLASS = (74.0, 60.0, 48.0)


def rectangle(
    length_m: float, width_m: float, *, round_m: float = 0.0, at_m: tuple[float, float] = (0.0, 0.0)
) -> FloatArray:
    """Outline of a rectangle, with round corners.

    Parameters
    ----------
    length_m, width_m : float [m]
        Along and across the body.
    round_m : float [m]
        Radius of the corners; 0 for sharp ones.
    at_m : (float, float) [m]
        Its middle.

    Returns
    -------
    outline : (N, 2) array [m]
        Counter-clockwise.
    """
    half = np.array([length_m, width_m]) / 2
    signs = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    if round_m <= 0:
        return np.asarray(signs * half + at_m)
    quarter = np.linspace(0, np.pi / 2, 4)
    arcs = [
        sign * (half - round_m)
        + round_m * np.column_stack([np.cos(quarter + turn), np.sin(quarter + turn)])
        for sign, turn in zip(signs, np.arange(4) * np.pi / 2, strict=True)
    ]
    return np.asarray(np.concatenate(arcs) + at_m)


def round_outline(radius_m: float, corners: int = 16) -> FloatArray:
    """Outline of a circle.

    Parameters
    ----------
    radius_m : float [m]
        Of the circle.
    corners : int
        How many it is drawn with.

    Returns
    -------
    outline : (corners, 2) array [m]
        Counter-clockwise.
    """
    turn = np.arange(corners) * 2 * np.pi / corners
    return np.asarray(radius_m * np.column_stack([np.cos(turn), np.sin(turn)]))


def robot(
    name: str,
    pose: PoseOfTime,
    *marks: Mark,
    size_m: tuple[float, float, float] = (0.5, 0.4, 0.22),
    colour: Colour = (190.0, 120.0, 40.0),
    lamps: tuple[Lamp, ...] = (),
) -> Body:
    """Build a small robot on four wheels with a flat roof.

    Parameters
    ----------
    name : str
        Its name.
    pose : callable
        Where it is.
    *marks : Mark
        On its roof.
    size_m : (float, float, float) [m]
        Length, width, height.
    colour : Colour
        Of its hull.
    lamps : tuple of Lamp
        Its lights.

    Returns
    -------
    body : Body
        With a dark bumper ahead, so that a person sees where it goes.
    """
    length, width, height = size_m
    wheel = 0.55 * height
    wheels = tuple(
        Part(
            rectangle(wheel, 0.08 * width, at_m=(x * 0.27 * length, y * 0.5 * width)),
            0.0,
            wheel,
            RUBBER,
        )
        for y in (1, -1)
        for x in (1, -1)
    )
    trim: tuple[Mark, ...] = (
        Patch((0.07 * length, 0.8 * width), (40.0, 200.0, 245.0), (0.45 * length, 0.0)),
    )
    hull = Part(
        rectangle(length, width, round_m=0.12 * width),
        0.15 * height,
        height,
        colour,
        trim + marks,
    )
    return Body(name, pose, (*wheels, hull), lamps)


def round_robot(
    name: str,
    pose: PoseOfTime,
    *marks: Mark,
    radius_m: float = 0.09,
    height_m: float = 0.14,
    colour: Colour = (45.0, 42.0, 40.0),
    lamps: tuple[Lamp, ...] = (),
) -> Body:
    """Build a round robot, as in robot soccer.

    Parameters
    ----------
    name : str
        Its name.
    pose : callable
        Where it is.
    *marks : Mark
        On its roof.
    radius_m, height_m : float [m]
        Its size.
    colour : Colour
        Of its hull.
    lamps : tuple of Lamp
        Its lights.

    Returns
    -------
    body : Body
        One drum.
    """
    return Body(
        name, pose, (Part(round_outline(radius_m), 0.0, height_m, colour, tuple(marks)),), lamps
    )


def car(
    name: str,
    pose: PoseOfTime,
    *marks: Mark,
    size_m: tuple[float, float, float] = (4.4, 1.8, 1.45),
    colour: Colour = (150.0, 60.0, 40.0),
) -> Body:
    """Build a car: hull, cabin with glass, wheels.

    Parameters
    ----------
    name : str
        Its name.
    pose : callable
        Where it is.
    *marks : Mark
        On its roof.
    size_m : (float, float, float) [m]
        Length, width, height.
    colour : Colour
        Of its paint.

    Returns
    -------
    body : Body
        Its reference is the middle of its roof.
    """
    length, width, height = size_m
    wheels = tuple(
        Part(
            rectangle(0.15 * length, 0.08 * width, at_m=(x * 0.3 * length, y * 0.46 * width)),
            0.0,
            0.42 * height,
            RUBBER,
        )
        for y in (1, -1)
        for x in (1, -1)
    )
    lights = tuple(
        Patch((0.03 * length, 0.2 * width), paint, (x * 0.475 * length, y * 0.36 * width))
        for x, paint in ((1, (220.0, 235.0, 240.0)), (-1, (40.0, 40.0, 190.0)))
        for y in (1, -1)
    )
    hull = Part(
        rectangle(length, width, round_m=0.2 * width), 0.18 * height, 0.6 * height, colour, lights
    )
    back = -0.06 * length
    glass = Part(
        rectangle(0.56 * length, 0.9 * width, round_m=0.12 * width, at_m=(back, 0.0)),
        0.6 * height,
        0.92 * height,
        GLASS,
    )
    roof = Part(
        rectangle(0.42 * length, 0.86 * width, round_m=0.12 * width, at_m=(back, 0.0)),
        0.92 * height,
        height,
        colour,
        tuple(marks),
    )
    return Body(
        name,
        pose,
        (*wheels, hull, glass, roof),
        reference_m=None if marks else (back, 0.0, height),
    )


def box(
    name: str,
    pose: PoseOfTime,
    size_m: tuple[float, float, float],
    colour: Colour = (110.0, 155.0, 190.0),
    *marks: Mark,
    moves: bool = False,
) -> Body:
    """Build a box: a parcel, a pallet, a plain cart.

    Parameters
    ----------
    name : str
        Its name.
    pose : callable
        Where it is.
    size_m : (float, float, float) [m]
        Length, width, height.
    colour : Colour
        Of all of it.
    *marks : Mark
        On its roof.
    moves : bool
        Does it?

    Returns
    -------
    body : Body
        One prism.
    """
    part = Part(rectangle(*size_m[:2]), 0.0, size_m[2], colour, marks)
    return Body(name, pose, (part,), moves=moves)


def pillar(
    name: str,
    pose: PoseOfTime,
    *,
    radius_m: float = 0.1,
    height_m: float = 1.5,
    colour: Colour = (60.0, 170.0, 225.0),
) -> Body:
    """Build a pillar: a tall thing that hides what passes behind it.

    Parameters
    ----------
    name : str
        Its name.
    pose : callable
        Where it is.
    radius_m, height_m : float [m]
        Its size.
    colour : Colour
        Of all of it.

    Returns
    -------
    body : Body
        That does not move.
    """
    return Body(
        name, pose, (Part(round_outline(radius_m, 16), 0.0, height_m, colour),), moves=False
    )


def person(name: str, pose: PoseOfTime, *, colour: Colour = (120.0, 80.0, 70.0)) -> Body:
    """Build a person, roughly: legs, shoulders, head.

    Parameters
    ----------
    name : str
        Their name.
    pose : callable
        Where they are.
    colour : Colour
        Of their jacket.

    Returns
    -------
    body : Body
        1.75 m tall.
    """
    return Body(
        name,
        pose,
        (
            Part(rectangle(0.22, 0.34, round_m=0.1), 0.0, 0.85, (70.0, 60.0, 55.0)),
            Part(rectangle(0.26, 0.46, round_m=0.12), 0.85, 1.48, colour),
            Part(
                round_outline(0.1, 12),
                1.48,
                1.75,
                (60.0, 75.0, 95.0),
                (Disc(0.1, (40.0, 50.0, 70.0)),),
            ),
        ),
    )
