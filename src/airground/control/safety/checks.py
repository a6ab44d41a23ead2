"""Causes to stop a robot, each looked for by itself: time, links, state, place."""

from __future__ import annotations

from math import hypot, isfinite, isnan, pi, remainder, sqrt
from typing import TYPE_CHECKING

from airground.control.safety.types import Place, StopReason

if TYPE_CHECKING:
    from airground.control.floor import Floor
    from airground.control.limits import Limits
    from airground.control.safety.bounds import SafetyBounds
    from airground.control.safety.calibration_sigma import CalibrationSigma
    from airground.control.safety.types import Cause, Situation
    from airground.control.state import RobotState

__all__ = ["jump_causes", "link_causes", "place_causes", "state_causes", "time_causes"]


def time_causes(t: float, before: float | None, bounds: SafetyBounds) -> list[Cause]:
    """Look at the clock.

    Parameters
    ----------
    t : float [s]
        Now; finite.
    before : float or None [s]
        At the last tick.
    bounds : SafetyBounds
        What is allowed.

    Returns
    -------
    causes : list of Cause
        One at most.
    """
    if before is None:
        return []
    dt = t - before
    if not dt > 0:
        how = "stands still" if dt == 0 else f"went back by {-dt:.3g} s"
        return [(StopReason.CLOCK, f"the clock {how}")]
    if dt > bounds.clock_jump_s:
        return [(StopReason.CLOCK, f"the clock jumped by {dt:.3g} s")]
    if dt > bounds.tick_s:
        return [
            (StopReason.LATE_TICK, f"{dt:.2f} s since the last tick, at most {bounds.tick_s:g} s")
        ]
    return []


def link_causes(now: Situation, bounds: SafetyBounds) -> list[Cause]:
    """Look at when camera, operator and robot were last heard.

    Parameters
    ----------
    now : Situation
        With a finite time.
    bounds : SafetyBounds
        How old news may be.

    Returns
    -------
    causes : list of Cause
        None where all are heard, or nobody listens.
    """
    causes: list[Cause] = []
    for heard, most, what in (
        (now.operator_t, bounds.operator_s, (StopReason.OPERATOR_LINK, "operator was heard")),
        (now.robot_t, bounds.robot_s, (StopReason.ROBOT_LINK, "robot was heard")),
        (now.frame_t, bounds.camera_s, (StopReason.CAMERA, "newest picture was taken")),
    ):
        if heard is not None:
            causes += _age(now.t, heard, most, what, bounds)
    return causes


def _age(
    t: float, then: float, most: float, what: tuple[StopReason, str], bounds: SafetyBounds
) -> list[Cause]:
    reason, doing = what
    age = t - then
    if isnan(age):
        return [(StopReason.NOT_A_NUMBER, f"the time when the {doing} is not a number")]
    if age < -bounds.future_s:
        return [(StopReason.CLOCK, f"the {doing} {-age:.2f} s from now: clocks disagree")]
    if age > most:
        return [(reason, f"the {doing} {age:.2f} s ago, at most {most:g} s")]
    return []


def state_causes(
    now: Situation, state: RobotState, floor: Floor, bounds: SafetyBounds
) -> tuple[list[Cause], Place | None]:
    """Look at the state: numbers, age, uncertainty.

    Parameters
    ----------
    now : Situation
        With a finite time.
    state : RobotState
        In it.
    floor : Floor
        Ground and image.
    bounds : SafetyBounds
        What is allowed.

    Returns
    -------
    causes : list of Cause
        None where it can be trusted.
    place : Place or None
        Where the robot is; None where that cannot be said.
    """
    u, v = state.uv.tolist()
    # One sum of all: what is not finite in it makes it so.
    if not isfinite(state.t + u + v + state.theta + state.v + state.omega + state.lateral) or isnan(
        state.seen_t
    ):
        return [(StopReason.NOT_A_NUMBER, "the state holds what is not a number")], None
    causes: list[Cause] = []
    if abs(state.t - now.t) > bounds.state_s:
        line = f"the state is about {state.t - now.t:+.2f} s from now, at most {bounds.state_s:g} s"
        causes.append((StopReason.STATE_TIME, line))
    causes += _age(
        now.t, state.seen_t, bounds.track_s, (StopReason.TRACK, "robot was seen"), bounds
    )
    uncertain, sigma = _sigma_causes(state, bounds)
    x, y = floor.position_of(u, v)
    if not (isfinite(x) and isfinite(y)):
        line = f"({u:.0f}, {v:.0f}) px is on the horizon or beyond"
        return [*causes, (StopReason.HORIZON, line), *uncertain], None
    return causes + uncertain, Place(x, y, state.theta, sigma)


def _sigma_causes(state: RobotState, bounds: SafetyBounds) -> tuple[list[Cause], float]:
    if state.covariance is None:
        if isfinite(bounds.position_sigma_m) or isfinite(bounds.heading_sigma_rad):
            line = (
                "nothing is known of the state's uncertainty; give a covariance or infinite bounds"
            )
            return [(StopReason.STATE_SIGMA, line)], 0.0
        return [], 0.0
    P = state.covariance.tolist()
    if not isfinite(sum(map(sum, P))):
        return [(StopReason.NOT_A_NUMBER, "the state's covariance holds what is not a number")], 0.0
    xx, xy, yy, heading = P[0][0], P[0][1], P[1][1], P[2][2]
    worst = (xx + yy) / 2 + hypot((xx - yy) / 2, xy)
    if not (min(xx, yy, heading) >= 0 and worst >= 0):
        return [(StopReason.NOT_A_NUMBER, "the state's covariance has a negative variance")], 0.0
    position, turn = sqrt(worst), sqrt(heading)
    causes: list[Cause] = []
    if position > bounds.position_sigma_m:
        line = f"position known to {position:.2g} m, at most {bounds.position_sigma_m:g} m"
        causes.append((StopReason.STATE_SIGMA, line))
    if turn > bounds.heading_sigma_rad:
        line = f"heading known to {turn:.2g} rad, at most {bounds.heading_sigma_rad:g} rad"
        causes.append((StopReason.STATE_SIGMA, line))
    return causes, position


def place_causes(
    u: float,
    v: float,
    sigma: CalibrationSigma | None,
    image_size_px: tuple[int, int] | None,
    bounds: SafetyBounds,
) -> list[Cause]:
    """Look at where in the image the robot is.

    Parameters
    ----------
    u, v : float [px]
        There; finite, on visible ground.
    sigma : CalibrationSigma or None
        The calibration's uncertainty; None where it is taken as exact.
    image_size_px : (int, int) or None [px]
        Of the image; None where it does not bound anything.
    bounds : SafetyBounds
        What is allowed.

    Returns
    -------
    causes : list of Cause
        None where the image can be trusted there.
    """
    causes: list[Cause] = []
    if image_size_px is not None:
        low = bounds.image_margin_px - 0.5
        width, height = image_size_px
        if not (low <= u <= width - 1 - low and low <= v <= height - 1 - low):
            line = f"({u:.0f}, {v:.0f}) px, the image is {width}x{height} px"
            causes.append((StopReason.IMAGE, line))
    if sigma is not None:
        relative = sigma.at(u, v)
        if not relative <= bounds.calibration_sigma:
            line = (
                f"ground velocities good to {relative:.1%}, at most {bounds.calibration_sigma:.1%}"
            )
            causes.append((StopReason.CALIBRATION, line))
    return causes


def jump_causes(
    place: Place, before: Place, dt: float, limits: Limits, bounds: SafetyBounds
) -> list[Cause]:
    """Look at how far the state went since the last tick.

    Parameters
    ----------
    place : Place
        Where the robot is.
    before : Place
        Where it was.
    dt : float [s]
        Since then.
    limits : Limits
        How fast it may be.
    bounds : SafetyBounds
        What is allowed beyond that.

    Returns
    -------
    causes : list of Cause
        None for what a robot can do.
    """
    way = hypot(place.x - before.x, place.y - before.y)
    turn = abs(remainder(place.theta - before.theta, 2 * pi))
    causes: list[Cause] = []
    if way > bounds.jump_m + limits.speed_mps * dt:
        causes.append((StopReason.STATE_JUMP, f"the robot's place moved {way:.2f} m in {dt:.2f} s"))
    if turn > bounds.jump_rad + limits.turn_rate_radps * dt:
        causes.append((StopReason.STATE_JUMP, f"its heading turned {turn:.2f} rad in {dt:.2f} s"))
    return causes
