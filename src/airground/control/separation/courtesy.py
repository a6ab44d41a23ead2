"""The soft part: robots steer round each other early, so that the hard part seldom has to brake them.

Wanted commands become velocities on the ground. Where the velocity of one robot relative to another would bring them
together within a horizon, it must leave the cone of such velocities by one of its sides: the right one, unless it
passes clearly on the left. All robots keep to the right of each other so, and two that face each other do not freeze.
Velocities nearest to the wanted ones, found together, share the effort; rows may be violated, as this is no promise.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from airground.control.separation.qp import nearest
from airground.control.separation.reach import Motion, dot
from airground.control.separation.rows import point_gap

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from airground.control.separation.around import Around
    from airground.control.separation.reach import ComplexArray, Fleet
    from airground.geometry.arrays import FloatArray

__all__ = ["Courtesy", "desires", "give_way"]

_SOFTNESS = 1e-3
_LEAST = 1e-4  # [m/s] below which a change is none
_IDLE = 0.02  # [m/s] below which a robot stands
_FULL = 0.15  # change as a share of the speed limit from which commands follow it alone
_SIDEWAYS = 1.5  # [rad] that a wanted turn counts at most


@dataclass(frozen=True, slots=True)
class Courtesy:
    """How robots give way before they must."""

    horizon_s: float = 4.0
    """Meetings that are further ahead are left alone [s]."""

    extra_m: float = 0.08
    """Distance that is kept beyond what must be kept [m]."""

    right: float = 0.4
    """Passing on the left needs a miss of more than this share of the distance to keep."""

    settle_s: float = 0.8
    """Time in which a gap may be used up [s]."""

    slide: float = 0.6
    """How fast those who are close and in each other's way go round each other, as a share of their closing speed."""

    slide_m: float = 0.5
    """Gap below which they begin to [m]."""

    steer_s: float = 0.5
    """Time in which a robot turns to a new course [s]."""

    idle_weight: float = 3.0
    """How much less what stands and wants to stand gives way."""


def desires(
    robots: Fleet,
    wanted: Motion,
    aims: Sequence[tuple[float, float] | None] | None,
    courtesy: Courtesy,
) -> tuple[ComplexArray, NDArray[np.bool_]]:
    """Velocities on the ground that robots would have if they were alone.

    Parameters
    ----------
    robots : Fleet
        As they move now.
    wanted : Motion
        What each shall do.
    aims : sequence of (x, y) or None, optional [m]
        Places that they are on the way to, where that is known; what is wanted of the others says where they go.
    courtesy : Courtesy
        Habits.

    Returns
    -------
    velocity : (N,) complex array [m/s]
        Desires.
    aimed : (N,) array of bool
        Whose aim is known.
    """
    bend = np.minimum(np.maximum(wanted.turn * courtesy.steer_s, -_SIDEWAYS), _SIDEWAYS)
    if robots.any_omni:
        bend = np.where(robots.omni, 0.0, bend)
    velocity = robots.facing * np.exp(1j * bend) * wanted.drive
    if aims is None:
        return velocity, np.zeros(len(velocity), dtype=np.bool_)
    at = np.array([complex(nan, nan) if aim is None else complex(*aim) for aim in aims])
    # what wants to stand still does, whatever it aims at; what backs up says so by its command
    stands = (wanted.drive == 0) & (wanted.turn == 0)
    aimed = np.isfinite(at) & ~stands & ((wanted.drive.real >= 0) | robots.omni)
    way = np.where(aimed, at - robots.at, 0.0)
    distance = np.abs(way)
    pace = np.minimum(robots.speed, distance / courtesy.settle_s)
    return np.where(aimed, way * (pace / np.maximum(distance, 1e-9)), velocity), aimed


def give_way(
    robots: Fleet,
    wanted: Motion,
    desire: tuple[ComplexArray, NDArray[np.bool_]],
    around: Around,
    *,
    courtesy: Courtesy,
    clockwise: bool,
) -> Motion:
    """Commands that steer round others.

    Parameters
    ----------
    robots : Fleet
        As they move now.
    wanted : Motion
        What each shall do, within its limits apart from accelerations.
    desire : tuple of (N,) array
        Velocities, and whose aim is known, of `desires`.
    around : Around
        What is near them.
    courtesy : Courtesy
        Horizon and habits.
    clockwise : bool
        Whether headings count clockwise, so that right is the other side.

    Returns
    -------
    motion : Motion
        The same object where nobody is in the way.
    """
    velocity, _ = desire
    rows = _half_planes(robots, velocity, around, courtesy, -1.0 if clockwise else 1.0)
    who, other, normal, bound = rows
    paired = len(other)
    towards = dot(normal, velocity[who]) - bound
    towards[:paired] -= dot(normal[:paired], velocity[other])
    if towards.max(initial=0.0) <= _LEAST:
        return wanted

    # each velocity along its course and across; what stands and wants to stand is moved less
    pace = np.abs(velocity)
    idle = pace < _IDLE
    weight = np.where(idle, courtesy.idle_weight, 1.0)
    course: ComplexArray = np.where(idle, robots.facing, velocity / np.maximum(pace, _IDLE))
    count, at = len(weight), np.arange(len(who))
    axes = np.asarray(course / weight, dtype=np.complex128)
    parted = np.zeros((len(who), 2, count))
    # normal.axis, and that with the axis turned by a quarter: the parts of one product
    parts = normal.conj() * axes[who]
    parted[at, 0, who], parted[at, 1, who] = parts.real, -parts.imag
    parts = normal[:paired].conj() * axes[other]
    parted[at[:paired], 0, other], parted[at[:paired], 1, other] = -parts.real, parts.imag
    matrix = parted.reshape(len(who), 2 * count)
    speed = robots.speed * weight
    top = np.concatenate([speed, speed])
    along = course.conj() * velocity * weight
    want = np.concatenate([along.real, along.imag])
    found = nearest(want, -top, top, matrix, bound, softness=_SOFTNESS)
    if found is None:
        return wanted  # the hard part holds without it
    planar: ComplexArray = (found[:count] + 1j * found[count:]) * axes
    planar *= np.minimum(1.0, robots.speed / np.maximum(np.abs(planar), 1e-9))
    return _steered(robots, wanted, desire, planar, courtesy.steer_s)


def _half_planes(
    robots: Fleet, velocity: ComplexArray, around: Around, courtesy: Courtesy, hand: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], ComplexArray, FloatArray]:
    """Bounds on velocities along normals: relative ones of pairs, then those of robots alone."""
    (i, j, apart), walls, passing = around.pairs, around.walls, around.passing
    pairs, who, other, theirs = len(i), i, j, velocity[j]
    place, keep = robots.at[j], apart
    if len(passing.who):
        who = np.concatenate([i, passing.who])
        theirs = np.concatenate([theirs, around.passing_dot])
        place = np.concatenate([place, passing.start])
        keep = np.concatenate([apart, passing.apart])
    blocks = []
    if len(who):
        way, closing = place - robots.at[who], velocity[who] - theirs
        cones = _cones(way, closing, keep + courtesy.extra_m, courtesy, hand)
        normal, bound, aside, slide = cones
        slides = slide < 0
        if len(who) > pairs:  # passers-by heed nobody: bounds on the robots' own velocities
            bound[pairs:] += dot(normal[pairs:], theirs[pairs:])
            slide[pairs:] += dot(aside[pairs:], theirs[pairs:])
        if slides.any():
            other = np.concatenate([j, j[slides[:pairs]]])
        for part in (slice(pairs), slice(pairs, None)):  # pairs first
            blocks.append((who[part], normal[part], bound[part]))
            pick = slides[part]
            if pick.any():
                blocks.append((who[part][pick], aside[part][pick], slide[part][pick]))
    if len(walls.who):
        gap, facing = point_gap(robots.at[walls.who], walls.start, walls.end)
        blocks.append((walls.who, facing, np.maximum(gap - walls.apart, 0.0) / courtesy.settle_s))
    if not blocks:
        return j, j, velocity[j], apart  # all of them empty
    who, normal, bound = (np.concatenate(part) for part in zip(*blocks, strict=True))
    return who, other, normal, bound


class _Cones(NamedTuple):
    """Half-planes normal.closing <= bound for relative velocities."""

    normal: ComplexArray
    bound: FloatArray
    aside: ComplexArray
    """The normal that makes them go round each other; it counts where `slide` is negative."""

    slide: FloatArray


def _cones(
    way: ComplexArray, closing: ComplexArray, apart: FloatArray, courtesy: Courtesy, hand: float
) -> _Cones:
    """Bounds on relative velocities: not to meet, and to go round each other."""
    distance = np.maximum(np.abs(way), 1e-9)
    unit = way / distance
    relative = unit.conj() * closing  # along the way, plus i times to its left
    sine = np.minimum(apart / distance, 1.0)
    miss = hand * relative.imag / np.maximum(np.abs(closing) * sine, 1e-9)  # of what is to be kept
    turn = np.where(miss < courtesy.right, hand, -hand)
    reach = distance - apart
    steer = (reach > 0) & (reach < courtesy.horizon_s * relative.real)
    # the normal of the cone's side, into the cone
    normal = unit * np.where(steer, sine + 1j * turn * np.sqrt(1.0 - sine**2), 1.0)
    bound = np.where(steer, 0.0, np.maximum(reach, 0.0) / courtesy.settle_s)
    near = np.minimum(np.maximum(1.0 - reach / courtesy.slide_m, 0.0), 1.0)
    meet = np.where(np.abs(miss) < 1.0, np.maximum(relative.real, 0.0), 0.0)
    return _Cones(normal, bound, 1j * turn * unit, -courtesy.slide * near * meet)


def _steered(
    robots: Fleet,
    wanted: Motion,
    desire: tuple[ComplexArray, NDArray[np.bool_]],
    planar: ComplexArray,
    steer_s: float,
) -> Motion:
    """What brings robots to other velocities than those desired, the less the nearer they are to them."""
    velocity, aimed = desire
    idle = np.abs(velocity) < _IDLE
    back = wanted.drive.real < 0
    if idle.any():
        towards = dot(robots.facing, planar)
        back = np.where(idle, (towards < 0) & (robots.reverse > 0), back)
    side = np.where(back, -1.0, 1.0)  # what reverses steers by its back
    front = robots.facing.conj() * side
    old, new = front * velocity, front * planar  # ahead, plus i times to the left
    ahead, angle = np.maximum(new.real, 0.0), np.arctan2(new.imag, new.real)
    gain = ahead - np.maximum(old.real, 0.0)
    pace = np.where(idle, ahead, np.maximum(np.abs(wanted.drive) + gain, 0.0))
    bent = new * old.conj()
    bend = np.arctan2(bent.imag, bent.real)
    turn = np.where(idle, angle / steer_s, bend / steer_s + wanted.turn)
    drive: ComplexArray = (side * pace).astype(np.complex128)
    if robots.any_omni:
        drive = np.where(robots.omni, new * side, drive)
        turn = np.where(robots.omni, wanted.turn, turn)
    off = np.abs(planar - velocity)
    part = np.where(off > _LEAST, 1.0, 0.0)
    # a known aim is a better guide than the command, which may have slowed down only to turn
    known = aimed & ~robots.omni & ~idle
    part = np.where(known, np.minimum(off / (_FULL * robots.speed), 1.0), part)
    drive = np.where(known, ahead, drive)
    turn = np.where(known, angle / steer_s, turn)
    return Motion(
        wanted.drive + part * (drive - wanted.drive), wanted.turn + part * (turn - wanted.turn)
    )
