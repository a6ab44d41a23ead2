"""From what a session knows to what a person is shown. Pixels are raw ones."""

from __future__ import annotations

from math import cos, isfinite, sin
from typing import TYPE_CHECKING

import numpy as np

from airground.control.command import STOP
from airground.session.tick import OtherView, RobotView

if TYPE_CHECKING:
    from airground.calibration import Calibration
    from airground.control.pilot import PilotTick
    from airground.control.safety.types import Sent
    from airground.geometry.arrays import FloatArray
    from airground.session.fleet import Fleet
    from airground.session.member import Member
    from airground.session.tick import Task
    from airground.vision.tracker import Track

__all__ = ["blind_view", "other_view", "steered_view"]

AHEAD_S = 1.0
LEAST_AHEAD_M = 0.3  # of the arrow of a robot that stands


def steered_view(
    t: float, member: Member, fleet: Fleet, tick: PilotTick, gives_way: str = ""
) -> RobotView:
    """A robot that is steered with a calibration.

    Parameters
    ----------
    t : float [s]
        Now.
    member : Member
        What it is.
    fleet : Fleet
        What it is asked to do.
    tick : PilotTick
        What was decided.
    gives_way : str
        Why what it does is not what it would do alone, in one line.

    Returns
    -------
    view : RobotView
        For a person.
    """
    state, calibration = tick.wish.state, fleet.ground.calibration
    floor, errand = fleet.ground.floor, fleet.errands[member.name]
    uv = ahead = covariance = None
    u, v = state.uv.tolist()
    if isfinite(u + v):
        raw = calibration.distort(state.uv)
        uv = _pair(raw)
        P = None if state.covariance is None else state.covariance[:2, :2]
        if P is not None and isfinite(P.sum()):
            J = calibration.jacobian(raw)
            covariance = _three(J @ P @ J.T)
        if isfinite(state.theta):
            x, y = floor.position_of(u, v)
            reach = max(state.v * AHEAD_S, LEAST_AHEAD_M) if isfinite(state.v) else LEAST_AHEAD_M
            tip = floor.pixel_of(x + reach * cos(state.theta), y + reach * sin(state.theta))
            ahead = _pair(calibration.distort(np.array(tip)))
    guidance = tick.guidance
    progress = 0.0
    if guidance is not None and errand.length > 0:
        progress = min(max(guidance.progress / errand.length, 0.0), 1.0)
    held = tick.sent.stop if guidance is not None or tick.sent.memory.latched else None
    return RobotView(
        name=member.name,
        uv=uv if uv is not None else _track_uv(member.track),
        covariance=covariance,
        ahead_uv=ahead,
        heading_rad=_finite(state.theta),
        speed_mps=_finite(state.v),
        turn_radps=_finite(state.omega),
        seen_s=_age(t, member.seen_t, calibration.time_offset_s),
        heard_s=_age(t, member.heard_t, 0.0),
        task=errand.task,
        done=fleet.arrived[member.name],
        progress=progress,
        goals_px=errand.goals_px,
        error_m=None if guidance is None else _finite(guidance.error_m),
        error_px=None if guidance is None else _finite(guidance.error_px),
        command=tick.command,
        stop=(gives_way if guidance is not None else "") if held is None else held.line,
        stop_reason="" if held is None else held.reason.value,
        speed_limit_mps=member.speed_mps,
    )


def blind_view(
    t: float, member: Member, task: Task, sent: Sent | None, line: str = ""
) -> RobotView:
    """A robot while there is no calibration.

    Parameters
    ----------
    t : float [s]
        Now.
    member : Member
        What is known of it.
    task : Task
        What it is doing.
    sent : Sent or None
        What it was told; None for to stand.
    line : str
        Why it stands, where nothing else says so.

    Returns
    -------
    view : RobotView
        For a person.
    """
    track, reading = member.track, member.reading
    stop = None if sent is None else sent.stop
    return RobotView(
        name=member.name,
        uv=_track_uv(track),
        covariance=None if track is None else _three(track.covariance[:2, :2]),
        ahead_uv=None,
        heading_rad=None if reading is None else reading.heading,
        speed_mps=None if reading is None else reading.speed,
        turn_radps=None if reading is None else reading.turn_rate,
        seen_s=_age(t, member.seen_t, 0.0),
        heard_s=_age(t, member.heard_t, 0.0),
        task=task,
        done=False,
        progress=0.0,
        goals_px=(),
        error_m=None,
        error_px=None,
        command=STOP if sent is None else sent.command,
        stop=line if stop is None else stop.line,
        stop_reason="" if stop is None else stop.reason.value,
        speed_limit_mps=member.speed_mps,
    )


def other_view(track: Track, calibration: Calibration | None) -> OtherView:
    """Something that is not ours.

    Parameters
    ----------
    track : Track
        Of it.
    calibration : Calibration or None
        The one in force.

    Returns
    -------
    view : OtherView
        With its speed and the deviation of that, where they can be told.
    """
    speed = sigma = xy_dot = ahead = None
    if calibration is not None and bool(calibration.is_ground(track.uv)):
        velocity, own = calibration.ground_velocity(track.uv, track.uv_dot)
        to_ground = np.linalg.inv(calibration.jacobian(track.uv))
        covariance = own + to_ground @ track.covariance[2:, 2:] @ to_ground.T
        length = float(np.hypot(*velocity))
        if isfinite(length):
            along = velocity / length if length > 0 else np.array([1.0, 0.0])
            variance = float(along @ covariance @ along)
            if length == 0 or length**2 < variance:  # no direction to speak of
                variance = float(np.trace(covariance)) / 2
            speed, sigma, xy_dot = length, variance**0.5, _pair(velocity)
    ahead = _pair(track.uv + track.uv_dot * AHEAD_S)
    return OtherView(
        name=f"tag {track.name}" if track.name.isdigit() else track.name,
        uv=(float(track.uv[0]), float(track.uv[1])),
        covariance=_three(track.covariance[:2, :2]),
        xy_dot=xy_dot,
        speed_mps=speed,
        speed_sigma_mps=sigma,
        ahead_uv=ahead,
    )


def _track_uv(track: Track | None) -> tuple[float, float] | None:
    return None if track is None else _pair(track.uv)


def _pair(uv: FloatArray) -> tuple[float, float] | None:
    u, v = uv.tolist()
    return (u, v) if isfinite(u + v) else None


def _three(C: FloatArray) -> tuple[float, float, float]:
    return float(C[0, 0]), float(C[0, 1]), float(C[1, 1])


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _age(t: float, then: float | None, offset_s: float) -> float | None:
    return None if then is None else t - then - offset_s
