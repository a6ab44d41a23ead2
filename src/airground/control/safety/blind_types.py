"""What is known of a robot while nothing metric is known of the image."""

from __future__ import annotations

from dataclasses import dataclass

from airground.control.safety.types import Situation

__all__ = ["BlindSituation"]


@dataclass(frozen=True, slots=True, eq=False)
class BlindSituation:
    """All that is known when a command is about to be sent and there is no calibration; times are on one clock."""

    t: float
    """Now [s]."""

    uv: tuple[float, float] | None = None
    """Where the robot's mark is in the image [px]; None where it was not found."""

    seen_t: float | None = None
    """Of its newest sighting [s]."""

    uv_dot: tuple[float, float] | None = None
    """How the mark moves [px/s]; None where that is not known."""

    step_px: tuple[float, float] | None = None
    """What a metre forwards is in the image [px/m], as the robot's own motion told (`LocalMap.px_per_m`); None where
    that is not known."""

    speed_mps: float | None = None
    """By odometer, along the heading [m/s]; None where it does not tell."""

    turn_radps: float | None = None
    """Of the heading, by whatever tells it [rad/s]; None where nothing does."""

    frame_t: float | None = None
    """Exposure of the newest picture that arrived [s]; None where nobody watches the camera."""

    operator_t: float | None = None
    """When the operator was last heard [s]; None where there is no operator's link to watch."""

    robot_t: float | None = None
    """When the robot was last heard [s]; None where it does not answer."""

    stop: bool = False
    """Whether the operator's STOP is pressed; it holds until it is released."""

    disobeys: str = ""
    """Why the robot is taken not to do what it is told, in one line, where others than this layer have seen that."""

    separation: str = ""
    """Why robots are too close, in one line; empty where they are not."""

    trouble: str = ""
    """Why there is no command, in one line; empty where there is one."""

    @property
    def situation(self) -> Situation:
        """The same without the image."""
        return Situation(
            t=self.t,
            state=None,
            frame_t=self.frame_t,
            operator_t=self.operator_t,
            robot_t=self.robot_t,
            stop=self.stop,
            disobeys=self.disobeys,
            separation=self.separation,
            trouble=self.trouble,
        )
