"""All that is asked about, and an answer to it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from airground.calibration.identify_chain import Span
    from airground.calibration.identify_windows import Fragment, RobotMotion
    from airground.geometry.arrays import FloatArray
    from airground.geometry.limited import LimitedHomography

__all__ = ["Scene", "Solution", "without"]

ENTRY = 2.0
"""What a fragment must gain, beyond the logarithm of their number."""

G_PARAMETERS = 7
"""Of g and the clocks' offset."""

SHARPER = 4.0
"""Logarithm of the variance of velocities in an image over that of what follows: what a parameter is known better."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """All fragments and all robots."""

    parts: list[Fragment]
    """Fragments."""

    robots: list[RobotMotion]
    """Robots."""

    one_frame: bool
    """Whether all readings are in one ground frame."""

    left_handed: bool
    """Whether the ground frame is left-handed, as north-east is."""

    reach: tuple[float, float]
    """Least and greatest offset of the clocks [s]."""

    length: float
    """Of a window [s]."""

    @property
    def entry(self) -> float:
        """What a span must gain."""
        return ENTRY + float(np.log(max(1, len(self.parts))))

    def share(self, part: Fragment, robot: RobotMotion) -> float:
        """What a window counts, of an independent velocity.

        Parameters
        ----------
        part : Fragment
            Which fragment.
        robot : RobotMotion
            Which robot.

        Returns
        -------
        share : float
            At most 1.
        """
        return min(1.0, part.step / robot.memory_s)


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """An answer, and what speaks for it."""

    model: LimitedHomography
    """g, in the first identified robot's frame."""

    lag: float
    """Offset of the clocks [s]."""

    turns: FloatArray
    """(R,) [rad]. What to add to each robot's headings; NaN for robots that were not found."""

    spans: tuple[Span, ...]
    """What follows which robot."""

    level: float
    """Noise over speed of what follows."""

    def of(self, robot: int) -> tuple[Span, ...]:
        """What follows a robot.

        Parameters
        ----------
        robot : int
            Which.

        Returns
        -------
        spans : tuple of Span
            In order of time.
        """
        return tuple(span for span in self.spans if span.robot == robot)

    def cost(self, scene: Scene) -> float:
        """What g, the offset and the headings' zeros must be paid with (Bayesian information criterion).

        Parameters
        ----------
        scene : Scene
            Fragments and robots.

        Returns
        -------
        cost : float
            In log likelihood.
        """
        if not self.spans:
            return 0.0
        counted = sum(s.counted for s in self.spans)
        extra = 0 if scene.one_frame else len({s.robot for s in self.spans}) - 1
        each = 0.5 * (np.log(max(counted, 2.0)) + SHARPER)
        return float((G_PARAMETERS + extra) * each)

    def score(self, scene: Scene) -> float:
        """Log likelihood ratio to vehicles on their own, all paid for.

        Parameters
        ----------
        scene : Scene
            Fragments and robots.

        Returns
        -------
        score : float
            Negative where chance explains as much.
        """
        return sum(s.gain - scene.entry for s in self.spans) - self.cost(scene)


def without(solution: Solution, robot: int) -> Solution:
    """The same without what follows one robot.

    Parameters
    ----------
    solution : Solution
        An answer.
    robot : int
        Which robot.

    Returns
    -------
    solution : Solution
        Fewer spans.
    """
    return replace(solution, spans=tuple(s for s in solution.spans if s.robot != robot))
