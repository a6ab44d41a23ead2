"""What the separation filter is told of robots and others, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite, sqrt
from typing import TYPE_CHECKING, Self

import numpy as np

from airground.control.limits import Limits
from airground.errors import InputError

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.control.floor import Floor
    from airground.control.state import RobotState

__all__ = ["Body", "Passerby", "Separated", "Separation"]


@dataclass(frozen=True, slots=True)
class Body:
    """A robot on the ground, at the time when its next command takes effect.

    Numbers of its motion may be NaN: what is not known of it is then handled as `SeparationFilter` says.
    """

    xy: tuple[float, float]
    """Where its axle is [m]."""

    theta: float
    """Heading [rad]."""

    v: float = 0.0
    """Speed along the heading [m/s]."""

    omega: float = 0.0
    """Rate of the heading [rad/s]."""

    lateral: float = 0.0
    """Speed along the heading plus 90 degrees [m/s]."""

    radius_m: float = 0.25
    """Of the disc around the axle that holds all of the robot [m]."""

    sigma_m: float = 0.0
    """Standard deviation of its position, along the worst direction [m]."""

    limits: Limits = field(default_factory=Limits)
    """What it may do."""

    omnidirectional: bool = False
    """Whether it drives sideways too; a positive turn radius in `limits` makes it a car."""

    def __post_init__(self) -> None:
        _check(self.radius_m, self.sigma_m, "robot")

    @classmethod
    def seen(
        cls,
        floor: Floor,
        state: RobotState,
        *,
        radius_m: float,
        limits: Limits,
        omnidirectional: bool = False,
        told: VelocityCommand | None = None,
    ) -> Self:
        """Build it from what is believed of a robot in the image.

        Parameters
        ----------
        floor : Floor
            Relation of image and ground.
        state : RobotState
            Its state when the command takes effect; its covariance gives `sigma_m`, none gives 0.
        radius_m : float [m]
            Of the disc around the axle that holds all of it.
        limits : Limits
            What it may do.
        omnidirectional : bool
            Whether it drives sideways too.
        told : VelocityCommand, optional
            How it moves; as the state has it where not given.

        Returns
        -------
        body : Body
            NaN where the state is, or is not on visible ground.
        """
        x, y = floor.position_of(*state.uv.tolist())
        moves = state if told is None else told
        sigma = 0.0
        if state.covariance is not None:
            (a, b), (_, d) = state.covariance[:2, :2].tolist()
            largest = (a + d) / 2 + sqrt(((a - d) / 2) ** 2 + b * b) if isfinite(a + b + d) else 0.0
            sigma = sqrt(max(0.0, largest))
            x = x if isfinite(a + b + d) else np.nan
        return cls(
            (x, y),
            state.theta,
            moves.v,
            moves.omega,
            moves.lateral,
            radius_m,
            sigma,
            limits,
            omnidirectional,
        )


@dataclass(frozen=True, slots=True)
class Passerby:
    """Something else that moves or stands on the ground, and heeds nobody."""

    xy: tuple[float, float]
    """Where its middle is [m]."""

    xy_dot: tuple[float, float] = (0.0, 0.0)
    """Its velocity [m/s], which it is taken to keep."""

    radius_m: float = 0.25
    """Of the disc that holds it [m]."""

    sigma_m: float = 0.0
    """Standard deviation of its position, along the worst direction [m]."""

    def __post_init__(self) -> None:
        _check(self.radius_m, self.sigma_m, "passer-by")


@dataclass(frozen=True, slots=True)
class Separated:
    """What one robot is told after the filter."""

    command: VelocityCommand
    """Within its limits, what it can reach within the step."""

    reason: str = ""
    """Why it is not what was wanted, in one line; empty where only the robot's own limits changed it, if anything."""

    changed: float = 0.0
    """How much the filter took from it or added [m/s], turn rates counted at the robot's rim."""


@dataclass(frozen=True, slots=True)
class Separation:
    """The filter's answer."""

    robots: tuple[Separated, ...]
    """One per robot, in their order."""

    clearance_m: float
    """Least gap between two discs, or a disc and a boundary, before margins [m]; infinite where there is nothing."""

    trouble: str = ""
    """Why all or some were braked without a search for something better; empty where all is well."""

    @property
    def commands(self) -> tuple[VelocityCommand, ...]:
        """The commands alone."""
        return tuple(one.command for one in self.robots)


def _check(radius_m: float, sigma_m: float, what: str) -> None:
    if not (isfinite(radius_m) and radius_m > 0):
        raise InputError(f"radius_m of a {what} must be positive, not {radius_m}")
    if not (isfinite(sigma_m) and sigma_m >= 0):
        raise InputError(f"sigma_m of a {what} must be 0 or more, not {sigma_m}")
