"""A robot whose heading is unknown may drive gently straight on, so that the image shows it."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite
from typing import TYPE_CHECKING

from airground.control.command import VelocityCommand
from airground.control.safety.types import StopReason
from airground.control.state import RobotState

if TYPE_CHECKING:
    from airground.control.safety.bounds import SafetyBounds
    from airground.control.safety.types import Cause

__all__ = ["gently", "headless", "search_causes", "without_heading"]

TINY = 1e-9  # of rounding


def gently(command: VelocityCommand, bounds: SafetyBounds) -> VelocityCommand:
    """What of a command is let pass while the heading is unknown.

    Parameters
    ----------
    command : VelocityCommand
        Wanted; NaN stays NaN.
    bounds : SafetyBounds
        How fast.

    Returns
    -------
    command : VelocityCommand
        Straight on or back, and slow.
    """
    if not command.finite:
        return command
    return VelocityCommand(min(max(command.v, -bounds.search_mps), bounds.search_mps), 0.0)


def headless(state: RobotState) -> RobotState:
    """Leave the place of a state whose heading is unknown, and rest in place of its motion.

    Parameters
    ----------
    state : RobotState
        Its theta, v and omega may be NaN.

    Returns
    -------
    state : RobotState
        The same where the heading is known.
    """
    if isfinite(state.theta):
        return state
    return replace(state, theta=0.0, v=0.0, omega=0.0)


def without_heading(bounds: SafetyBounds) -> SafetyBounds:
    """Give the bounds that hold while the heading is unknown.

    Parameters
    ----------
    bounds : SafetyBounds
        Usual ones.

    Returns
    -------
    bounds : SafetyBounds
        That do not ask how well the heading is known.
    """
    return replace(bounds, heading_sigma_rad=inf)


def search_causes(sent: VelocityCommand, spare: float, bounds: SafetyBounds) -> list[Cause]:
    """Look at what keeps a robot from looking for its heading.

    Parameters
    ----------
    sent : VelocityCommand
        What it was last told.
    spare : float [m]
        Clearance from the fence beyond what it must have; infinite without a fence.
    bounds : SafetyBounds
        What is allowed.

    Returns
    -------
    causes : list of Cause
        None where it may.
    """
    causes: list[Cause] = []
    if bounds.search_mps == 0:
        line = "the heading is unknown, and driving to find it is not allowed (search_mps)"
        causes.append((StopReason.STATE_SIGMA, line))
    elif abs(sent.v) > bounds.search_mps + TINY or abs(sent.omega) + abs(sent.lateral) > TINY:
        causes.append((StopReason.STATE_SIGMA, "the heading was lost under way: stop first"))
    if spare < bounds.search_m:
        line = f"the heading is unknown and the fence {max(spare, 0.0):.2f} m away, at least {bounds.search_m:g} m"
        causes.append((StopReason.LEAVING, line))
    return causes
