"""Causes to stop a robot in an image of which nothing metric is known."""

from __future__ import annotations

from math import copysign, hypot, isfinite
from typing import TYPE_CHECKING

from airground.control.safety.types import StopReason

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.control.limits import Limits
    from airground.control.safety.blind_types import BlindSituation
    from airground.control.safety.bounds import SafetyBounds
    from airground.control.safety.obedience import Motion
    from airground.control.safety.types import Cause

__all__ = ["border_causes", "mark_causes", "seen_motion"]

SLOW_MPS = 0.02  # what is not driving
NOISE_PXPS = 10.0  # of how a mark is seen to move
TURNING_RADPS = 0.2  # a mark beside the axle moves by a turn


def mark_causes(now: BlindSituation, bounds: SafetyBounds) -> list[Cause]:
    """Look at the mark: numbers and age.

    Parameters
    ----------
    now : BlindSituation
        With a finite time.
    bounds : SafetyBounds
        What is allowed.

    Returns
    -------
    causes : list of Cause
        One at most.
    """
    if now.uv is None or now.seen_t is None:
        return [(StopReason.TRACK, "the robot's mark has not been found")]
    told = [*now.uv, now.seen_t, *(now.uv_dot or ()), *(now.step_px or ())]
    told += [one for one in (now.speed_mps, now.turn_radps) if one is not None]
    if not isfinite(sum(told)):
        return [(StopReason.NOT_A_NUMBER, "what is known of the robot holds what is not a number")]
    age = now.t - now.seen_t
    if age < -bounds.future_s:
        line = f"the mark was seen {-age:.2f} s from now: clocks disagree"
        return [(StopReason.CLOCK, line)]
    if age > bounds.track_s:
        line = f"the robot was seen {age:.2f} s ago, at most {bounds.track_s:g} s"
        return [(StopReason.TRACK, line)]
    return []


def border_causes(
    now: BlindSituation,
    wanted: VelocityCommand,
    image_size_px: tuple[int, int],
    limits: Limits,
    bounds: SafetyBounds,
) -> list[Cause]:
    """Look at where in the image the mark is, and where it goes.

    Parameters
    ----------
    now : BlindSituation
        With a mark.
    wanted : VelocityCommand
        What would be sent.
    image_size_px : (int, int) [px]
        Width and height.
    limits : Limits
        How the robot brakes.
    bounds : SafetyBounds
        How far inside it must be.

    Returns
    -------
    causes : list of Cause
        None where the mark stays inside the margin, or comes nearer to it.
    """
    assert now.uv is not None
    margin = bounds.image_margin_px
    outside = [_beyond(at, size, margin) for at, size in zip(now.uv, image_size_px, strict=True)]
    speed = hypot(wanted.v, wanted.lateral)
    u, v = now.uv
    where = (
        f"({u:.0f}, {v:.0f}) px, the image is {image_size_px[0]}x{image_size_px[1]} px, "
        f"to keep {margin:g} px inside"
    )
    if speed < SLOW_MPS:  # it may stand there, and turn
        return []
    step = now.step_px
    if step is None or wanted.lateral != 0:
        if any(outside):
            line = f"{where}; which way leads inwards is not known yet: move it there by hand"
            return [(StopReason.IMAGE, line)]
        return []
    way = speed * bounds.reaction_s + speed * speed / (2 * limits.deceleration_mps2)
    way = way if wanted.v > 0 else -way
    for at, beyond, rate, size in zip(now.uv, outside, step, image_size_px, strict=True):
        move = rate * way
        then = _beyond(at + move, size, margin)
        if then != 0 and (beyond == 0 or move * beyond > 0):
            return [(StopReason.IMAGE, f"{where}; it would leave by {abs(then):.0f} px")]
    return []


def seen_motion(now: BlindSituation, following: Motion) -> Motion | None:
    """What the robot does, by the witness that agrees least with what it was told.

    Parameters
    ----------
    now : BlindSituation
        Odometer and image.
    following : (float, float, float) [m/s, m/s, rad/s]
        What it was told, as a robot follows it.

    Returns
    -------
    motion : (float, float, float) or None [m/s, m/s, rad/s]
        Speed, sideways speed and turn rate; what nobody tells is as told. None where nobody tells anything.
    """
    v, side, omega = following
    witnesses = [] if now.speed_mps is None else [now.speed_mps]
    if now.step_px is not None and now.uv_dot is not None and abs(omega) < TURNING_RADPS:
        (a, b), (p, q) = now.step_px, now.uv_dot
        scale = hypot(a, b)
        if scale > 0:
            off = (a * p + b * q) / scale**2 - v
            # Only what noise does not explain.
            witnesses.append(v + copysign(max(abs(off) - NOISE_PXPS / scale, 0.0), off))
    if not witnesses and now.turn_radps is None:
        return None
    speed = max(witnesses, key=lambda one: abs(one - v), default=v)
    return speed, side, omega if now.turn_radps is None else now.turn_radps


def _beyond(at: float, size: int, margin: float) -> float:
    """How far beyond the margin a coordinate is, with the side as its sign; 0 inside."""
    low, high = margin - 0.5, size - 0.5 - margin
    return at - low if at < low else at - high if at > high else 0.0
