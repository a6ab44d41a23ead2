"""The soft part: robots steer round each other early, so that the hard part seldom has to brake them.

Wanted commands become velocities on the ground. Where the velocity of one robot relative to another would bring them
together within a horizon, it must leave the cone of such velocities by one of its sides: the right one, unless it
passes clearly on the left. All robots keep to the right of each other so, and two that face each other do not freeze.
Velocities nearest to the wanted ones, found together, share the effort; rows may be violated, as this is no promise.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from airground.control.separation.qp import nearest
from airground.control.separation.reach import Motion, dot
from airground.control.separation.rows import segment_gap

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
    course = np.exp(1j * (robots.theta + np.where(robots.omni, 0.0, bend)))
    velocity = course * wanted.drive
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
    towards = dot(normal, velocity[who])
    towards[:paired] -= dot(normal[:paired], velocity[other])
    if (towards <= bound + _LEAST).all():
        return wanted

    # each velocity along its course and across; what stands and wants to stand is moved less
    idle = np.abs(velocity) < _IDLE
    weight = np.where(idle, courtesy.idle_weight, 1.0)
    ahead = velocity / np.maximum(np.abs(velocity), _IDLE)
    course = np.where(idle, np.exp(1j * robots.theta), ahead).astype(np.complex128)
    count, at = len(weight), np.arange(len(who))
    axes = (course / weight).astype(np.complex128)
    matrix = np.zeros((len(who), 2 * count))
    for offset, axis in ((0, axes), (count, np.asarray(1j * axes))):
        matrix[at, offset + who] = dot(normal, axis[who])
        matrix[at[:paired], offset + other] = -dot(normal[:paired], axis[other])
    top = np.tile(robots.speed * weight, 2)
    along = np.conj(course) * velocity * weight
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
    who = np.concatenate([i, passing.who])
    way = np.concatenate([robots.at[j], passing.start]) - robots.at[who]
    theirs = np.concatenate([velocity[j], around.passing_dot])
    keep = np.concatenate([apart, passing.apart]) + courtesy.extra_m
    normal, bound, aside, least = _cones(way, velocity[who] - theirs, keep, courtesy, hand)
    slides = least < 0
    paired = np.arange(len(who)) < len(i)
    picks = [(paired, None), (paired & slides, slides)]
    picks += [(~paired, None), (~paired & slides, slides)]
    blocks = []
    for pick, sliding in picks:
        n, b = (normal, bound) if sliding is None else (aside, least)
        alone = np.where(paired, 0.0, dot(n, theirs))
        blocks.append((who[pick], n[pick], (b + alone)[pick]))
    other = np.concatenate([j, j[slides[: len(j)]]])
    if len(walls.who):
        at = robots.at[walls.who]
        gap, facing = segment_gap(at, at, walls.start, walls.end)
        blocks.append((walls.who, facing, np.maximum(gap - walls.apart, 0.0) / courtesy.settle_s))
    who, normal, bound = (np.concatenate(part) for part in zip(*blocks, strict=True))
    return who, other, normal, bound


def _cones(
    way: ComplexArray, closing: ComplexArray, apart: FloatArray, courtesy: Courtesy, hand: float
) -> tuple[ComplexArray, FloatArray, ComplexArray, FloatArray]:
    """Half-planes normal.closing <= bound for relative velocities: not to meet, and to go round each other."""
    distance = np.maximum(np.abs(way), 1e-9)
    unit = way / distance
    relative = np.conj(unit) * closing  # along the way, plus i times to its left
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
    return normal, bound, 1j * turn * unit, -courtesy.slide * near * meet


def _steered(
    robots: Fleet,
    wanted: Motion,
    desire: tuple[ComplexArray, NDArray[np.bool_]],
    planar: ComplexArray,
    steer_s: float,
) -> Motion:
    """What brings robots to other velocities than those desired, the less the nearer they are to them."""
    velocity, aimed = desire
    facing = np.exp(-1j * robots.theta)
    old, new = facing * velocity, facing * planar  # ahead, plus i times to the left
    idle = np.abs(velocity) < _IDLE
    back = np.where(idle, (new.real < 0) & (robots.reverse > 0), wanted.drive.real < 0)
    side = np.where(back, -1.0, 1.0)  # what reverses steers by its back
    old, new = old * side, new * side
    ahead = np.maximum(new.real, 0.0)
    gain = ahead - np.maximum(old.real, 0.0)
    pace = np.where(idle, ahead, np.maximum(np.abs(wanted.drive) + gain, 0.0))
    turn = np.where(idle, np.angle(new), np.angle(new * np.conj(old))) / steer_s
    turn += np.where(idle, 0.0, wanted.turn)
    drive = np.where(robots.omni, new * side, side * pace)
    turn = np.where(robots.omni, wanted.turn, turn)
    off = np.abs(planar - velocity)
    part = np.where(off > _LEAST, 1.0, 0.0)
    # a known aim is a better guide than the command, which may have slowed down only to turn
    known = aimed & ~robots.omni & ~idle
    part = np.where(known, np.minimum(off / (_FULL * robots.speed), 1.0), part)
    drive = np.where(known, ahead, drive)
    turn = np.where(known, np.angle(new) / steer_s, turn)
    return Motion(
        wanted.drive + part * (drive - wanted.drive), wanted.turn + part * (turn - wanted.turn)
    )
