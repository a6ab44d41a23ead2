"""What all controllers have in common: state and progress in, command and progress out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from airground.control.command import VelocityCommand
    from airground.control.state import RobotState
    from airground.geometry.arrays import FloatArray

__all__ = ["Controller", "Guidance", "ImageTrajectory"]


@dataclass(frozen=True, slots=True, eq=False)
class Guidance:
    """A controller's answer."""

    command: VelocityCommand
    """What the robot shall do; rest once it is done."""

    progress: float
    """What the controller must be told at the next step; its sense is the controller's own."""

    done: bool
    """Whether the robot has arrived and stands."""

    error_px: float
    """Distance in the image from where it should be [px]: to the goal, or from the path."""

    error_m: float
    """The same on the ground [m]."""

    wanted_uv: FloatArray
    """(2,) [px]. Where it should be, in the pixels of the model."""

    trouble: str = ""
    """Why it cannot go on, in one line; the command is rest then. Empty where all is well."""


class Controller(Protocol):
    """Brings a robot where an operator wants it; frozen: what changes is in state and progress."""

    def step(self, state: RobotState, progress: float, dt: float) -> Guidance:
        """Say what to do now.

        Parameters
        ----------
        state : RobotState
            Of the robot, when the command takes effect.
        progress : float
            0 at first, then what the last step gave.
        dt : float [s]
            Until the next step.

        Returns
        -------
        guidance : Guidance
            The command and how things are.
        """
        ...


class ImageTrajectory(Protocol):
    """A smooth motion of an image point, wanted of a robot."""

    @property
    def duration(self) -> float:
        """Of the motion [s]; infinite where it goes round."""
        ...

    def at(self, t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Where it is.

        Parameters
        ----------
        t : float [s]
            Since its start.

        Returns
        -------
        uv : (2,) array [px]
            Point, in the pixels of the model.
        uv_dot : (2,) array [px/s]
            Its velocity.
        uv_ddot : (2,) array [px/s^2]
            Its acceleration.
        """
        ...
